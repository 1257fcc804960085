include(TestSuites)

# ygslam_test(NAME MODULE SOURCES files... [DEPENDS modules...] [LIBS libraries...]): the executable
# NAME_test, an entry NAME.Suite of ctest for each of its suites.
function(ygslam_test name module)
  cmake_parse_arguments(arg "" "" "SOURCES;DEPENDS;LIBS" ${ARGN})
  if(NOT YGSLAM_BUILD_TESTS)
    return()
  endif()
  list(TRANSFORM arg_DEPENDS PREPEND ygslam_)
  add_executable(${name}_test ${arg_SOURCES})
  target_link_libraries(${name}_test PRIVATE ygslam_${module} ygslam_compiler ygslam_quick ${arg_DEPENDS} ${arg_LIBS}
                        GTest::gtest GTest::gmock GTest::gtest_main)
  target_precompile_headers(${name}_test REUSE_FROM ygslam_precompiled_test)
  ygslam_test_suites(${name}_test ${name})
endfunction()

# ygslam_module(NAME [DEPENDS modules...] [LIBS libraries...] [TEST_DEPENDS ...] [TEST_LIBS ...]
#               [ROOMS sub-folders...] [OTHER_TESTS files...] [QUICK] [NUMERIC])
# One folder of src/ = one static library = one layer. Sources are the *.cpp of the folder and of its
# rooms; *_test.cpp beside them, but OTHER_TESTS, become the executable NAME_test. QUICK: see
# YgslamPrecompiled.cmake. NUMERIC: conversions that may change a value are warnings (-Wconversion), in
# the tests too.
function(ygslam_module name)
  cmake_parse_arguments(arg "QUICK;NUMERIC" "" "DEPENDS;LIBS;TEST_DEPENDS;TEST_LIBS;ROOMS;OTHER_TESTS" ${ARGN})
  list(TRANSFORM arg_ROOMS APPEND /*.cpp)
  file(GLOB sources CONFIGURE_DEPENDS *.cpp ${arg_ROOMS})
  set(tests ${sources})
  list(FILTER sources EXCLUDE REGEX "_test\\.cpp$")
  list(FILTER tests INCLUDE REGEX "_test\\.cpp$")
  foreach(other ${arg_OTHER_TESTS})
    list(REMOVE_ITEM tests ${CMAKE_CURRENT_SOURCE_DIR}/${other})
  endforeach()
  list(TRANSFORM arg_DEPENDS PREPEND ygslam_)
  set(warnings "")
  if(arg_NUMERIC)  # GCC's, which leaves out changes of sign alone
    set(warnings $<$<CXX_COMPILER_ID:GNU>:-Wconversion>)
  endif()

  if(sources)
    add_library(ygslam_${name} STATIC ${sources})
    set(scope PUBLIC)
    set_property(GLOBAL APPEND PROPERTY YGSLAM_MODULES ygslam_${name})
    target_link_libraries(ygslam_${name} PRIVATE ygslam_compiler)
    target_compile_options(ygslam_${name} PRIVATE ${warnings})
    if(arg_QUICK)
      target_link_libraries(ygslam_${name} PRIVATE ygslam_quick)
      target_precompile_headers(ygslam_${name} REUSE_FROM ygslam_precompiled_quick)
    else()
      target_precompile_headers(ygslam_${name} REUSE_FROM ygslam_precompiled)
    endif()
  else()
    add_library(ygslam_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_include_directories(ygslam_${name} ${scope} ${CMAKE_SOURCE_DIR}/src)
  target_link_libraries(ygslam_${name} ${scope} ${arg_DEPENDS} Eigen3::Eigen)
  if(arg_LIBS)
    target_link_libraries(ygslam_${name} ${scope} ${arg_LIBS})
  endif()

  if(tests)
    ygslam_test(${name} ${name} SOURCES ${tests} DEPENDS ${arg_TEST_DEPENDS} LIBS ${arg_TEST_LIBS})
  endif()
  if(TARGET ${name}_test)
    target_compile_options(${name}_test PRIVATE ${warnings})
  endif()
endfunction()
