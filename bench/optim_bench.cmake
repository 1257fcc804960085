# The optimisers, beside Ceres where it is installed.
add_executable(optim_bench ${CMAKE_CURRENT_LIST_DIR}/optim_bench.cpp)
target_link_libraries(optim_bench PRIVATE ygslam_optim ygslam_geometry ygslam_compiler
                      benchmark::benchmark)
if(TARGET ygslam_ceres_referee)
  target_link_libraries(optim_bench PRIVATE ygslam_ceres_referee)
endif()
