# Compiler settings shared by every target.
find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env
      CCACHE_SLOPPINESS=pch_defines,time_macros CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} ${CCACHE_PROGRAM})
endif()

add_library(ygslam_compiler INTERFACE)
target_compile_options(ygslam_compiler INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor
                       -Wno-psabi -fno-math-errno -fPIC)  # all alike: they share precompiled headers
# Who installs the Python package waits for it: GCC spends a tenth of its time on collecting garbage, which it
# leaves until it has half a gigabyte.
if(SKBUILD AND NOT CMAKE_CROSSCOMPILING AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(ygslam_compiler INTERFACE "SHELL:--param ggc-min-heapsize=524288")
endif()
if(YGSLAM_WERROR)
  target_compile_options(ygslam_compiler INTERFACE -Werror)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # GCC 12 sees overlaps and overruns in inlined std::string and Eigen code that are not there.
  target_compile_options(ygslam_compiler INTERFACE -Wno-restrict -Wno-array-bounds -Wno-stringop-overflow
                         -fpch-preprocess)  # lets ccache see which header was precompiled
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  # Loops over lanes join truth values with & and | on purpose: they have no branches.
  target_compile_options(ygslam_compiler INTERFACE -Wno-bitwise-instead-of-logical)
endif()
# Contracting a*b+c differently in two translation units would make equal formulas unequal.
target_compile_options(ygslam_compiler INTERFACE -ffp-contract=on)

# What was tested where `char` has a sign must not mean something else where it has none.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm")
  target_compile_options(ygslam_compiler INTERFACE -fsigned-char)
endif()

if(YGSLAM_ARCH STREQUAL "auto")
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    target_compile_options(ygslam_compiler INTERFACE -march=x86-64-v3)
  endif()
elseif(YGSLAM_ARCH)
  target_compile_options(ygslam_compiler INTERFACE -march=${YGSLAM_ARCH})
endif()

if(YGSLAM_FUZZ)
  target_compile_options(ygslam_compiler INTERFACE -fsanitize=fuzzer-no-link)
endif()
if(YGSLAM_SANITIZE)
  target_compile_options(ygslam_compiler INTERFACE -fsanitize=${YGSLAM_SANITIZE}
                         -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(ygslam_compiler INTERFACE -fsanitize=${YGSLAM_SANITIZE})
endif()
