# How far the corners of a saved map lie from where they belong.
add_executable(corner_noise ${CMAKE_CURRENT_LIST_DIR}/corner_noise.cpp)
target_link_libraries(corner_noise PRIVATE ygslam_compiler ygslam_system ygslam_map_file ygslam_eval CLI11::CLI11)
