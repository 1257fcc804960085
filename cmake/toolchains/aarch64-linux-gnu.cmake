# Builds for 64-bit ARM on another machine, and runs there what was built under QEMU: the preset `arm64`.
# `tools/setup.sh arm64` installs what this names.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
get_filename_component(CMAKE_SYSROOT "${CMAKE_CURRENT_LIST_DIR}/../../.venv/arm64-root" ABSOLUTE)
if(NOT EXISTS "${CMAKE_SYSROOT}/ready")
  message(FATAL_ERROR "No libraries for 64-bit ARM in ${CMAKE_SYSROOT}: run `tools/setup.sh arm64` first")
endif()
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(OpenVINO_DIR "${CMAKE_SYSROOT}/opt/openvino/openvino/cmake" CACHE PATH "OpenVINO's CMake files")
set(CMAKE_DISABLE_FIND_PACKAGE_Ceres ON)  # its CMake files name libraries of the machine itself
# A Raspberry Pi 5's. QEMU's own has SVE, with which OpenVINO's masks are nonsense there.
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static;-cpu;cortex-a76;-L;${CMAKE_SYSROOT})
