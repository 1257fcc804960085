// ygslam.Imu and ygslam.Wheels.
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>

#include <filesystem>
#include <ygslam/slam.hpp>

#include "arrays.hpp"
#include "bindings.hpp"
#include "frame_input.hpp"
#include "text.hpp"

namespace nb = nanobind;

namespace ygslam::python {
namespace {

void construct(api::Imu* self, const nb::object& T_camera_imu, double rate_hz, double gyro_noise,
               double accel_noise, double gyro_walk, double accel_walk,
               std::optional<double> time_offset_s) {
  const api::Pose pose = pose_of(T_camera_imu, "T_camera_imu");
  new (self) api::Imu{pose, rate_hz, gyro_noise, accel_noise, gyro_walk, accel_walk, time_offset_s};
}

std::string text_of(const api::Imu& imu) {
  const auto& t = imu.T_camera_imu.translation_m;
  return text("Imu({:g} Hz, at [{:.3f}, {:.3f}, {:.3f}] m on the camera)", imu.rate_hz, t[0], t[1],
              t[2]);
}

void construct_wheels(api::Wheels* self, const nb::object& T_base_camera, double way_scale,
                      double turn_scale, double way_noise, double turn_noise,
                      double time_offset_s) {
  const api::Pose pose = pose_of(T_base_camera, "T_base_camera");
  new (self) api::Wheels{pose, way_scale, turn_scale, way_noise, turn_noise, time_offset_s};
}

std::string text_of_wheels(const api::Wheels& wheels) {
  const auto& t = wheels.T_base_camera.translation_m;
  return text("Wheels(camera at [{:.3f}, {:.3f}, {:.3f}] m on the base)", t[0], t[1], t[2]);
}

}  // namespace

void bind_wheels(nb::module_& m) {
  const api::Wheels usual;
  nb::class_<api::Wheels>(m, "Wheels", "A robot that carries the camera on wheels.")
      .def("__init__", &construct_wheels, nb::arg("T_base_camera"), nb::kw_only(),
           nb::arg("way_scale") = usual.way_scale, nb::arg("turn_scale") = usual.turn_scale,
           nb::arg("way_noise") = usual.way_noise, nb::arg("turn_noise") = usual.turn_noise,
           nb::arg("time_offset_s") = usual.time_offset_s,
           "T_base_camera: (4, 4), from the colour camera's optical frame to the base (x ahead, z "
           "up). way_scale, turn_scale: true way and turn for told ones. way_noise: [m/sqrt(m)], "
           "turn_noise: [rad/sqrt(m)]. time_offset_s: a stamp of the wheels less the camera's of "
           "the same instant.")
      .def_static(
          "read",
          [](const std::filesystem::path& path) { return api::Wheels::read(path.string()); },
          nb::arg("path"), "An odom.yaml.")
      .def_prop_ro(
          "T_base_camera",
          [](const api::Wheels& wheels) { return to_matrix(wheels.T_base_camera); },
          nb::rv_policy::automatic, "(4, 4)")
      .def_ro("way_scale", &api::Wheels::way_scale)
      .def_ro("turn_scale", &api::Wheels::turn_scale)
      .def_ro("way_noise", &api::Wheels::way_noise, "m/sqrt(m)")
      .def_ro("turn_noise", &api::Wheels::turn_noise, "rad/sqrt(m)")
      .def_ro("time_offset_s", &api::Wheels::time_offset_s)
      .def("__repr__", &text_of_wheels);
}

void bind_imu(nb::module_& m) {
  const api::Imu usual;
  nb::class_<api::Imu>(m, "Imu",
                       "An IMU that is fixed to the camera. Of its noise the data sheet tells, of "
                       "its place the camera's maker.")
      .def(
          "__init__", &construct, nb::arg("T_camera_imu"), nb::kw_only(),
          nb::arg("rate_hz") = usual.rate_hz, nb::arg("gyro_noise") = usual.gyro_noise_radps_sqrthz,
          nb::arg("accel_noise") = usual.accel_noise_mps2_sqrthz,
          nb::arg("gyro_walk") = usual.gyro_walk_radps2_sqrthz,
          nb::arg("accel_walk") = usual.accel_walk_mps3_sqrthz,
          nb::arg("time_offset_s") = nb::none(),
          "T_camera_imu: (4, 4), from its frame to the colour camera's optical frame. Densities of "
          "noise [rad/s/sqrt(Hz), m/s2/sqrt(Hz)] and of the biases' random walk [rad/s2/sqrt(Hz), "
          "m/s3/sqrt(Hz)]. time_offset_s: a stamp of the IMU less the camera's of the same "
          "instant; without it it is found.")
      .def_static(
          "read", [](const std::filesystem::path& path) { return api::Imu::read(path.string()); },
          nb::arg("path"), "An imu.yaml.")
      .def_prop_ro(
          "T_camera_imu", [](const api::Imu& imu) { return to_matrix(imu.T_camera_imu); },
          nb::rv_policy::automatic, "(4, 4)")
      .def_ro("rate_hz", &api::Imu::rate_hz)
      .def_ro("gyro_noise", &api::Imu::gyro_noise_radps_sqrthz, "rad/s/sqrt(Hz)")
      .def_ro("accel_noise", &api::Imu::accel_noise_mps2_sqrthz, "m/s2/sqrt(Hz)")
      .def_ro("gyro_walk", &api::Imu::gyro_walk_radps2_sqrthz, "rad/s2/sqrt(Hz)")
      .def_ro("accel_walk", &api::Imu::accel_walk_mps3_sqrthz, "m/s3/sqrt(Hz)")
      .def_ro("time_offset_s", &api::Imu::time_offset_s, "None: it is found")
      .def("__repr__", &text_of);
}

}  // namespace ygslam::python
