# What `cmake --install` lays down: library, header, CMake package, command line, and the inference
# runtime beside them, so that neither the source tree nor the Python environment is needed later.
include(GNUInstallDirs)

# `make demo` builds the program alone; `cmake --install` and `cpack` build nothing by themselves.
install(CODE "execute_process(COMMAND \"${CMAKE_COMMAND}\" --build \"${CMAKE_BINARY_DIR}\" --target ygslam_library ygslam_cli
                COMMAND_ERROR_IS_FATAL ANY)")
include(CMakePackageConfigHelpers)

set(runtime_dir ${CMAKE_INSTALL_LIBDIR}/ygslam)
install(TARGETS ygslam_library EXPORT ygslamTargets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY include/ygslam DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT ygslamTargets NAMESPACE ygslam:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/ygslam)
file(WRITE ${CMAKE_BINARY_DIR}/ygslamConfig.cmake
     "include(\"\${CMAKE_CURRENT_LIST_DIR}/ygslamTargets.cmake\")\n")
write_basic_package_version_file(${CMAKE_BINARY_DIR}/ygslamConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/ygslamConfig.cmake ${CMAKE_BINARY_DIR}/ygslamConfigVersion.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/ygslam)

set_target_properties(ygslam_cli PROPERTIES INSTALL_RPATH "$ORIGIN/../${runtime_dir}")
install(TARGETS ygslam_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(FILES ${CMAKE_BINARY_DIR}/ygslam.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 OPTIONAL)
install(FILES ${CMAKE_BINARY_DIR}/ygslam.bash RENAME ygslam
        DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
# Debian's zsh looks at another place for what a package brings than for what was built there.
install(CODE [[
  if(CMAKE_INSTALL_PREFIX MATCHES "/usr/?$")
    set(zsh_place vendor-completions)
  else()
    set(zsh_place site-functions)
  endif()]])
install(FILES ${CMAKE_BINARY_DIR}/_ygslam DESTINATION "${CMAKE_INSTALL_DATADIR}/zsh/\${zsh_place}")

# OpenVINO: the core, the CPU plugin, the readers of ONNX and IR, and the thread pool they use.
get_target_property(openvino_library openvino::runtime IMPORTED_LOCATION_RELEASE)
get_filename_component(openvino_dir "${openvino_library}" DIRECTORY)
file(GLOB openvino_files "${openvino_dir}/libopenvino.so*" "${openvino_dir}/libopenvino_*_cpu_plugin.so"
     "${openvino_dir}/libopenvino_onnx_frontend.so*" "${openvino_dir}/libopenvino_ir_frontend.so*"
     "${openvino_dir}/libtbb.so*" "${openvino_dir}/libtbbmalloc.so*" "${openvino_dir}/plugins.xml")
install(FILES ${openvino_files} DESTINATION ${runtime_dir})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
# The licences of what is passed on (OpenVINO, oneTBB, oneDNN and theirs).
file(GLOB openvino_licences LIST_DIRECTORIES TRUE "${openvino_dir}/../../openvino-*.dist-info/licenses")
install(DIRECTORY ${openvino_licences} DESTINATION ${CMAKE_INSTALL_DOCDIR}/openvino)
# The Python programs behind `bench` and `eval --plot`.
install(DIRECTORY tools/report DESTINATION ${CMAKE_INSTALL_DATADIR}/ygslam
        PATTERN "__pycache__" EXCLUDE)

# `cpack -G DEB` in the build folder: a package for the Debian or Ubuntu it was built on.
set(CPACK_PACKAGE_NAME ygslam)
set(CPACK_PACKAGE_CONTACT "YG-SLAM developers <ygslam@example.org>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
if(CMAKE_CROSSCOMPILING AND CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)  # else it would be that of this machine
endif()
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${openvino_dir}")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3-venv")
include(CPack)
