# What most files include, compiled once for all modules and once more, with GoogleTest, for the tests.
# No heavier library belongs here: GCC instantiates what a precompiled header left open in every file.
set(headers <algorithm> <array> <chrono> <cmath> <filesystem> <fstream> <functional> <map> <memory>
            <numbers> <numeric> <optional> <ranges> <set> <span> <sstream> <string> <unordered_map>
            <variant> <vector>
            <Eigen/Cholesky> <Eigen/Core> <Eigen/Eigenvalues> <Eigen/Geometry> <Eigen/SVD>)
file(WRITE ${CMAKE_BINARY_DIR}/precompiled.cpp "")

# ygslam_precompiled(NAME headers...): a target to name in REUSE_FROM.
function(ygslam_precompiled name)
  add_library(${name} OBJECT EXCLUDE_FROM_ALL ${CMAKE_BINARY_DIR}/precompiled.cpp)
  target_link_libraries(${name} PRIVATE ygslam_compiler Eigen3::Eigen)
  target_precompile_headers(${name} PRIVATE ${ARGN})
endfunction()

ygslam_precompiled(ygslam_precompiled ${headers})
# What computes nothing for each pixel or point: quick to compile counts for more than quick to run. A
# precompiled header brings its level of optimisation along, so each level has its own.
add_library(ygslam_quick INTERFACE)
target_compile_options(ygslam_quick INTERFACE $<$<CONFIG:Release>:-O1>)
ygslam_precompiled(ygslam_precompiled_quick ${headers})
target_link_libraries(ygslam_precompiled_quick PRIVATE ygslam_quick)
if(YGSLAM_BUILD_TESTS)
  ygslam_precompiled(ygslam_precompiled_test ${headers} <gtest/gtest.h>)
  target_link_libraries(ygslam_precompiled_test PRIVATE ygslam_quick GTest::gtest)
endif()
