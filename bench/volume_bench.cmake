# The dense volume on a recording with true poses: times of integrating, withdrawing and meshing,
# memory. Takes minutes: run by itself.
add_executable(volume_bench ${CMAKE_CURRENT_LIST_DIR}/volume_bench.cpp
               ${CMAKE_CURRENT_LIST_DIR}/volume_bench_frames.cpp)
target_include_directories(volume_bench PRIVATE ${CMAKE_CURRENT_LIST_DIR})
target_link_libraries(volume_bench PRIVATE ygslam_volume ygslam_io ygslam_compiler CLI11::CLI11
                      opencv_imgcodecs opencv_core)
set_target_properties(volume_bench PROPERTIES UNITY_BUILD OFF)
