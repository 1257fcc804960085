# A large map made up, saved and loaded: size, times, memory. Takes a minute: run by itself.
add_executable(map_file_bench ${CMAKE_CURRENT_LIST_DIR}/map_file_bench.cpp)
target_link_libraries(map_file_bench PRIVATE ygslam_map_file ygslam_compiler CLI11::CLI11)
