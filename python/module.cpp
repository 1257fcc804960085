// ygslam._core: the library's facade for Python. Arrays are read where they lie; the interpreter's
// lock is released while a call works.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <ygslam/slam.hpp>

#include "bindings.hpp"
#include "calls.hpp"

namespace nb = nanobind;

namespace ygslam::python {
namespace {

using Rgb = nb::ndarray<const std::uint8_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using DepthM = nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using RawDepth = nb::ndarray<const std::uint16_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

class PySlam {
 public:
  explicit PySlam(const api::Settings& settings)
      : width_(static_cast<std::size_t>(settings.camera.width)),
        height_(static_cast<std::size_t>(settings.camera.height)),
        slam_(settings) {}

  api::Result process(const nb::object& rgb_array, const nb::object& depth, std::int64_t t_ns,
                      double depth_scale, std::int64_t depth_t_ns) {
    Rgb rgb;
    if (!nb::try_cast(rgb_array, rgb, false))
      throw nb::type_error("rgb: a C-contiguous array of uint8, (H, W, 3), is expected");
    if (rgb.shape(0) != height_ || rgb.shape(1) != width_ || rgb.shape(2) != 3)
      throw nb::value_error(("rgb: shape (" + std::to_string(height_) + ", " +
                             std::to_string(width_) + ", 3) is expected")
                                .c_str());
    DepthM metres;
    RawDepth raw;
    const bool is_raw = nb::try_cast(depth, raw, false);
    if (!is_raw && !nb::try_cast(depth, metres, false))
      throw nb::type_error("depth: a C-contiguous array of float32 [m] or uint16 is expected");
    if ((is_raw ? raw.shape(0) : metres.shape(0)) != height_ ||
        (is_raw ? raw.shape(1) : metres.shape(1)) != width_)
      throw nb::value_error("depth: the same height and width as rgb are expected");
    if (is_raw && !(depth_scale > 0 && std::isfinite(depth_scale)))
      throw nb::value_error("depth_scale: units per metre, above 0, is expected with uint16");
    const std::uint8_t* rgb_data = rgb.data();
    const std::uint16_t* raw_data = is_raw ? raw.data() : nullptr;
    const float* depth_data = is_raw ? nullptr : metres.data();
    const SlamUse use(slam_);
    if (is_raw) {
      depth_m_.resize(width_ * height_);
      const double metre = 1 / depth_scale;
      for (std::size_t i = 0; i < depth_m_.size(); ++i)
        depth_m_[i] = static_cast<float>(raw_data[i] * metre);
      depth_data = depth_m_.data();
    }
    api::Frame frame;
    frame.t_ns = t_ns;
    frame.rgb = rgb_data;
    frame.depth_m = depth_data;
    frame.depth_t_ns = depth_t_ns;
    return slam_->process(frame);
  }
  [[nodiscard]] std::string view_url() const { return slam_->view_url(); }
  api::MapSnapshot map() {
    const SlamUse use(slam_);
    return slam_->map();
  }
  api::Room room() {
    const SlamUse use(slam_);
    return slam_->room();
  }
  void save_map(const std::filesystem::path& path) {
    const SlamUse use(slam_);
    slam_->save_map(path.string());
  }
  void reset() {
    const SlamUse use(slam_);
    slam_->reset();
  }
  api::Outcome finish() {
    const SlamUse use(slam_);
    return slam_->finish();
  }
  [[nodiscard]] std::string text() const {
    return "Slam(" + std::to_string(width_) + " x " + std::to_string(height_) + " pixels)";
  }
  /// At the end of a `with`; a forked child that leaves it has nothing to end.
  void leave() {
    if (slam_.is_at_home()) static_cast<void>(finish());
  }

 private:
  std::size_t width_, height_;
  KeptSlam slam_;
  std::vector<float> depth_m_;  // of the present frame
};

/// ygslam.Error and its kinds, each with the exit code of the command line as `code`.
void bind_errors(nb::module_& m) {
  struct Kind {
    int code;
    const char* name;
    const char* what;
  };
  static constexpr std::array kKinds = {
      Kind{2, "UsageError", "Wrong use; `code` is 2."},
      Kind{3, "ConfigError", "Settings or camera; `code` is 3."},
      Kind{4, "InputError", "A recording, or a frame of it; `code` is 4."},
      Kind{5, "ModelError", "The network; `code` is 5."},
      Kind{6, "MapError", "A saved map; `code` is 6."},
      Kind{9, "OutputError", "What could not be written; `code` is 9."}};
  static PyObject* const error =  // for as long as the interpreter lives
      PyErr_NewExceptionWithDoc("ygslam.Error",
                                "What went wrong in one line; `code` as the exit codes of the "
                                "command line: 1 a bug or out of memory, 2 wrong use, 3 settings "
                                "or camera, 4 input, 5 model, 6 map file, 9 not written.",
                                PyExc_RuntimeError, nullptr);
  m.attr("Error") = nb::handle(error);
  static std::array<PyObject*, kKinds.size()> kinds{};
  for (std::size_t i = 0; i < kKinds.size(); ++i) {
    const std::string name = std::string("ygslam.") + kKinds[i].name;
    kinds[i] = PyErr_NewExceptionWithDoc(name.c_str(), kKinds[i].what, error, nullptr);
    m.attr(kKinds[i].name) = nb::handle(kinds[i]);
  }
  nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
    try {
      std::rethrow_exception(thrown);
    } catch (const api::Error& e) {
      PyObject* kind = error;
      for (std::size_t i = 0; i < kKinds.size(); ++i)
        if (kKinds[i].code == static_cast<int>(e.code)) kind = kinds[i];
      nb::object instance = nb::handle(kind)(e.what());
      instance.attr("code") = e.code;
      PyErr_SetObject(kind, instance.ptr());
    }
  });
}

}  // namespace

NB_MODULE(_core, m) {
  m.doc() = "YG-SLAM: RGB-D SLAM for rooms with people in them.";
  end_calls_with_the_interpreter();
  nb::set_leak_warnings(false);  // what a daemon thread was using is left, and no fault
  bind_errors(m);

  bind_camera(m);
  bind_results(m);
  bind_room(m);

  nb::class_<PySlam>(m, "Slam",
                     "One RGB-D frame in, one result out. One thread at a time may use it.")
      .def(
          "__init__",
          [](PySlam* self, const api::CameraModel& camera, const std::filesystem::path& model,
             const std::string& segmenter, const std::string& dynamic,
             const std::filesystem::path& load_map, bool localize_only, bool deterministic,
             bool keep_trajectory, const std::string& view,
             const std::map<std::string, std::string>& options, double room_every_s) {
            api::Settings settings;
            settings.camera = camera;
            settings.model = model.string();
            settings.segmenter = segmenter;
            settings.dynamic = dynamic;
            settings.load_map = load_map.string();
            settings.localize_only = localize_only;
            settings.deterministic = deterministic;
            settings.keep_trajectory = keep_trajectory;
            settings.view = view;
            settings.options = options;
            settings.room_every_s = room_every_s;
            const Unlocked unlocked;
            new (self) PySlam(settings);
          },
          nb::arg("camera"), nb::kw_only(), nb::arg("model") = "", nb::arg("segmenter") = "",
          nb::arg("dynamic") = "", nb::arg("load_map") = "", nb::arg("localize_only") = false,
          nb::arg("deterministic") = false, nb::arg("keep_trajectory") = true, nb::arg("view") = "",
          nb::arg("options") = std::map<std::string, std::string>{}, nb::arg("room_every_s") = 1.0,
          "model: a YOLOv8-seg network (.onnx, .xml). segmenter: model, builtin, none, masks:DIR; "
          "without it the model, else the built-in network. dynamic: off, geometry, semantic, "
          "full; without "
          "it full where there are masks, else geometry. load_map: map of an earlier run to go on "
          "with; localize_only: it stays "
          "as it is. deterministic: same input, same result. view: where a page shows "
          "the run, e.g. \"127.0.0.1:8765\" (port 0: any). options: keys of `ygslam config`. "
          "room_every_s: how often map() and room() are renewed at most.")
      .def("process", &PySlam::process, nb::arg("rgb"), nb::arg("depth"), nb::arg("t_ns"),
           nb::kw_only(), nb::arg("depth_scale") = 0.0, nb::arg("depth_t_ns") = 0,
           "rgb: (H, W, 3) uint8. depth: (H, W) float32 [m], 0 or NaN = none, or uint16 with "
           "depth_scale (units per metre). Both C-contiguous, read during the call. t_ns: strictly "
           "increasing, but for a clock that was set back (five frames that agree, or reset()). "
           "depth_t_ns: of the depth image, for a rolling shutter; 0 = t_ns.")
      .def_prop_ro("view_url", &PySlam::view_url, "Address of the page; empty = none.")
      .def("map", &PySlam::map, "The map as it was published last, at once.")
      .def("room", &PySlam::room,
           "The static room as it was published last, at once: free space, mesh, things. If "
           "deterministic, and after finish(), that of now.")
      .def("save_map", &PySlam::save_map, nb::arg("path"),
           "Writes the map to a file, whole or not at all.")
      .def("reset", &PySlam::reset, "Forgets all but settings and network.")
      .def("finish", &PySlam::finish, "Ends the run. May be called again.")
      .def(
          "__enter__", [](nb::object self) { return self; }, nb::sig("def __enter__(self) -> Slam"))
      .def(
          "__exit__", [](PySlam& self, const nb::args&) { self.leave(); },
          nb::sig("def __exit__(self, *args: object) -> None"))
      .def("__repr__", &PySlam::text);

  bind_ros_images(m);
  bind_sequence(m);
}

}  // namespace ygslam::python
