# A recording played to and fro for as long as one likes: does memory or time per frame grow?
add_executable(long_run ${CMAKE_CURRENT_LIST_DIR}/long_run.cpp)
target_link_libraries(long_run PRIVATE ygslam_compiler ygslam_system CLI11::CLI11)
