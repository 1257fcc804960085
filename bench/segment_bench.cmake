# The segmenter beside OpenVINO's own loop over the bare network.
add_executable(segment_bench ${CMAKE_CURRENT_LIST_DIR}/segment_bench.cpp)
target_link_libraries(segment_bench PRIVATE ygslam_segment ygslam_io ygslam_compiler openvino::runtime)
