# What a saved map's keyframes say about the time of each row; bench/row_residuals.py draws it.
add_executable(row_residuals ${CMAKE_CURRENT_LIST_DIR}/row_residuals.cpp)
target_link_libraries(row_residuals PRIVATE ygslam_compiler ygslam_system ygslam_map_file CLI11::CLI11)
