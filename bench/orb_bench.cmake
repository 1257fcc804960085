# ORB beside OpenCV's (the only user of OpenCV's features2d), and the tool that learns its tests.
add_executable(learn_brief_pattern ${CMAKE_SOURCE_DIR}/tools/learn_brief_pattern.cpp
               ${CMAKE_CURRENT_LIST_DIR}/texture.cpp)
target_include_directories(learn_brief_pattern PRIVATE ${CMAKE_CURRENT_LIST_DIR})
target_link_libraries(learn_brief_pattern PRIVATE ygslam_features ygslam_compiler
                      opencv_imgcodecs opencv_imgproc opencv_core)

find_path(OPENCV_FEATURES2D_INCLUDE_DIR opencv2/features2d.hpp PATH_SUFFIXES opencv4)
find_library(OPENCV_FEATURES2D_LIBRARY opencv_features2d)
if(OPENCV_FEATURES2D_INCLUDE_DIR AND OPENCV_FEATURES2D_LIBRARY)
  add_executable(orb_bench ${CMAKE_CURRENT_LIST_DIR}/orb_bench.cpp ${CMAKE_CURRENT_LIST_DIR}/texture.cpp)
  target_include_directories(orb_bench PRIVATE ${CMAKE_CURRENT_LIST_DIR})
  target_include_directories(orb_bench SYSTEM PRIVATE ${OPENCV_FEATURES2D_INCLUDE_DIR})
  target_link_libraries(orb_bench PRIVATE ygslam_features ygslam_compiler benchmark::benchmark
                        opencv_imgproc opencv_core ${OPENCV_FEATURES2D_LIBRARY})
else()
  message(STATUS "orb_bench left out: OpenCV's features2d is not installed")
endif()
