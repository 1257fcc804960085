// Images and cameras out of serialised messages of ROS 2.
#pragma once

#include <nanobind/nanobind.h>

namespace ygslam::python {

void bind_ros_images(nanobind::module_& m);

}  // namespace ygslam::python
