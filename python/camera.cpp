#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <tuple>
#include <ygslam/slam.hpp>

#include "bindings.hpp"
#include "text.hpp"

namespace nb = nanobind;

namespace ygslam::python {
namespace {

using Camera = api::CameraModel;

/// All that pickles once had; what was added comes behind them.
auto first_fields_of(const Camera& c) {
  return std::tuple(c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3, c.width, c.height,
                    c.colour_readout_ms, c.depth_readout_ms, c.depth_delay_ms, c.shutter_known,
                    c.device, c.ignore, c.ignore_image);
}
/// All that there is of it, for pickle and comparison.
auto fields_of(const Camera& c) {
  return std::tuple_cat(first_fields_of(c),
                        std::tuple(c.shutter_guessed, c.likely_device, c.shutter_source));
}
using FirstFields = decltype(first_fields_of(Camera()));
using Fields = decltype(fields_of(Camera()));

template <typename SomeFields>
Camera camera_of(const SomeFields& fields) {
  return std::apply([](const auto&... field) { return Camera{field...}; }, fields);
}

void construct(Camera* self, double fx, double fy, double cx, double cy, int width, int height,
               double k1, double k2, double p1, double p2, double k3, double colour_readout_ms,
               double depth_readout_ms, double depth_delay_ms, bool shutter_known,
               bool shutter_guessed, const std::string& device,
               const std::vector<std::array<int, 4>>& ignore, const std::string& ignore_image,
               const std::string& likely_device, const std::string& shutter_source) {
  new (self) Camera{fx,
                    fy,
                    cx,
                    cy,
                    k1,
                    k2,
                    p1,
                    p2,
                    k3,
                    width,
                    height,
                    colour_readout_ms,
                    depth_readout_ms,
                    depth_delay_ms,
                    shutter_known,
                    device,
                    ignore,
                    ignore_image,
                    shutter_guessed,
                    likely_device,
                    shutter_source};
}

std::string text_of(const Camera& c) {
  const bool is_distorted = c.k1 != 0 || c.k2 != 0 || c.p1 != 0 || c.p2 != 0 || c.k3 != 0;
  const char* more = is_distorted ? ", distorted" : "";
  return text("CameraModel(fx={:g}, fy={:g}, cx={:g}, cy={:g}, width={}, height={}{})", c.fx, c.fy,
              c.cx, c.cy, c.width, c.height, more);
}

}  // namespace

void bind_camera(nb::module_& m) {
  nb::class_<Camera>(m, "CameraModel",
                     "Pinhole camera with Brown-Conrady distortion, as in OpenCV [px]; read-out "
                     "times of a rolling shutter [ms].")
      .def("__init__", &construct, nb::arg("fx"), nb::arg("fy"), nb::arg("cx"), nb::arg("cy"),
           nb::arg("width") = 640, nb::arg("height") = 480, nb::kw_only(), nb::arg("k1") = 0.0,
           nb::arg("k2") = 0.0, nb::arg("p1") = 0.0, nb::arg("p2") = 0.0, nb::arg("k3") = 0.0,
           nb::arg("colour_readout_ms") = 0.0, nb::arg("depth_readout_ms") = 0.0,
           nb::arg("depth_delay_ms") = 0.0, nb::arg("shutter_known") = false,
           nb::arg("shutter_guessed") = false, nb::arg("device") = "",
           nb::arg("ignore") = std::vector<std::array<int, 4>>(), nb::arg("ignore_image") = "",
           nb::arg("likely_device") = "", nb::arg("shutter_source") = "")
      .def_rw("fx", &Camera::fx)
      .def_rw("fy", &Camera::fy)
      .def_rw("cx", &Camera::cx)
      .def_rw("cy", &Camera::cy)
      .def_rw("k1", &Camera::k1)
      .def_rw("k2", &Camera::k2)
      .def_rw("p1", &Camera::p1)
      .def_rw("p2", &Camera::p2)
      .def_rw("k3", &Camera::k3)
      .def_rw("width", &Camera::width)
      .def_rw("height", &Camera::height)
      .def_rw("colour_readout_ms", &Camera::colour_readout_ms)
      .def_rw("depth_readout_ms", &Camera::depth_readout_ms)
      .def_rw("depth_delay_ms", &Camera::depth_delay_ms)
      .def_rw("shutter_known", &Camera::shutter_known, "the times are right, even where they are 0")
      .def_rw("shutter_guessed", &Camera::shutter_guessed,
              "the times are a guess, from which an estimate starts")
      .def_rw("device", &Camera::device, "name of a known camera, see docs/camera.md")
      .def_rw("ignore", &Camera::ignore,
              "pixels that are not of the world: [x, y, width, height] each")
      .def_rw("ignore_image", &Camera::ignore_image,
              "the same as an 8-bit grey PNG of the camera's size, not 0 = ignored")
      .def_rw("likely_device", &Camera::likely_device,
              "a device that it may be: its times are taken once the rows are seen to roll")
      .def_rw("shutter_source", &Camera::shutter_source, "who told of the times, for messages")
      .def("__getstate__", &fields_of)
      .def("__setstate__",
           [](Camera& c, const Fields& fields) { new (&c) Camera(camera_of(fields)); })
      .def("__setstate__",
           [](Camera& c, const FirstFields& fields) { new (&c) Camera(camera_of(fields)); })
      .def("__repr__", &text_of);
}

}  // namespace ygslam::python
