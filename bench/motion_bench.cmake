# Dynamic points of recorded frames: precision, recall and time of every kind of check; the flow
# beside OpenCV's.
add_executable(motion_bench ${CMAKE_CURRENT_LIST_DIR}/motion_bench.cpp
               ${CMAKE_CURRENT_LIST_DIR}/flow_table.cpp ${CMAKE_CURRENT_LIST_DIR}/texture.cpp)
target_include_directories(motion_bench PRIVATE ${CMAKE_CURRENT_LIST_DIR})
target_link_libraries(motion_bench PRIVATE ygslam_motion ygslam_compiler opencv_imgcodecs
                      opencv_imgproc opencv_video opencv_core)
