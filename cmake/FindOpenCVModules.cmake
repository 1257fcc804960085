# Debian ships OpenCV's own CMake file only in libopencv-dev, which pulls in every module and the
# whole of VTK. This finds the few modules we use from their own packages: imported targets
# opencv_core and opencv_imgproc; for tests and benchmarks opencv_imgcodecs and opencv_video, for
# benchmarks opencv_features2d, too.
set(modules core imgproc)
if(YGSLAM_BUILD_TESTS OR YGSLAM_BUILD_BENCH)
  list(APPEND modules imgcodecs video)
endif()
if(YGSLAM_BUILD_BENCH)
  list(APPEND modules features2d)
endif()
find_package(OpenCV 4 QUIET COMPONENTS ${modules})
if(NOT OpenCV_FOUND)
  find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
  foreach(module ${modules})
    find_library(OPENCV_${module}_LIBRARY opencv_${module} REQUIRED)
    find_path(OPENCV_${module}_HEADER opencv2/${module}.hpp PATH_SUFFIXES opencv4 REQUIRED)
    add_library(opencv_${module} SHARED IMPORTED GLOBAL)
    set_target_properties(opencv_${module} PROPERTIES
      IMPORTED_LOCATION "${OPENCV_${module}_LIBRARY}"
      INTERFACE_INCLUDE_DIRECTORIES "${OPENCV_INCLUDE_DIR}")
  endforeach()
endif()
set(OpenCVModules_FOUND TRUE)
