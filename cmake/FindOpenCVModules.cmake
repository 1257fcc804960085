# Debian ships OpenCV's own CMake file only in libopencv-dev, which pulls in every module and the
# whole of VTK. This finds the few modules we use from their own packages:
# imported targets opencv_core, opencv_imgproc, opencv_imgcodecs, opencv_calib3d, opencv_video.
find_package(OpenCV 4 QUIET COMPONENTS core imgproc imgcodecs calib3d video)
if(NOT OpenCV_FOUND)
  find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
  foreach(module core imgproc imgcodecs calib3d video)
    find_library(OPENCV_${module}_LIBRARY opencv_${module} REQUIRED)
    find_path(OPENCV_${module}_HEADER opencv2/${module}.hpp PATH_SUFFIXES opencv4 REQUIRED)
    add_library(opencv_${module} SHARED IMPORTED GLOBAL)
    set_target_properties(opencv_${module} PROPERTIES
      IMPORTED_LOCATION "${OPENCV_${module}_LIBRARY}"
      INTERFACE_INCLUDE_DIRECTORIES "${OPENCV_INCLUDE_DIR}")
  endforeach()
endif()
set(OpenCVModules_FOUND TRUE)
