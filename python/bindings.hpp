// Each binds what its file is named after.
#pragma once

#include <nanobind/nanobind.h>

namespace ygslam::python {

void bind_camera(nanobind::module_& m);
void bind_imu(nanobind::module_& m);
void bind_results(nanobind::module_& m);
void bind_room(nanobind::module_& m);
void bind_ros_images(nanobind::module_& m);
void bind_slam(nanobind::module_& m);
void bind_wheels(nanobind::module_& m);
void bind_sequence(nanobind::module_& m);

}  // namespace ygslam::python
