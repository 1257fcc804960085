# Dynamic points of recorded frames: precision, recall and time of every kind of check.
add_executable(motion_bench ${CMAKE_CURRENT_LIST_DIR}/motion_bench.cpp)
target_link_libraries(motion_bench PRIVATE ygslam_motion ygslam_compiler opencv_imgcodecs
                      opencv_imgproc opencv_core)
