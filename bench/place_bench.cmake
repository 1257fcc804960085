# Places found in a map by single frames. Takes minutes: run by itself.
add_executable(place_bench ${CMAKE_CURRENT_LIST_DIR}/place_bench.cpp)
target_link_libraries(place_bench PRIVATE ygslam_compiler ygslam_system ygslam_map_file CLI11::CLI11)
