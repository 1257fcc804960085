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

#include "arrays.hpp"
#include "calls.hpp"
#include "ros_images.hpp"
#include "sequence.hpp"

namespace nb = nanobind;

namespace ygslam::python {
namespace {

using Rgb = nb::ndarray<const std::uint8_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using DepthM = nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using RawDepth = nb::ndarray<const std::uint16_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

/// A 4x4 matrix.
Array<double> to_matrix(const api::Pose& pose) {
  const auto& [x, y, z, w] = pose.rotation_xyzw;
  const auto& t = pose.translation_m;
  return make_array<double>(
      {1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), t[0], 2 * (x * y + z * w),
       1 - 2 * (x * x + z * z), 2 * (y * z - x * w), t[1], 2 * (x * z - y * w), 2 * (y * z + x * w),
       1 - 2 * (x * x + y * y), t[2], 0, 0, 0, 1},
      {4, 4});
}

/// Rows of seconds, x, y, z, qx, qy, qz, qw, as in a TUM trajectory.
Array<double> to_rows(const std::vector<api::StampedPose>& poses) {
  std::vector<double> rows;
  for (const api::StampedPose& pose : poses) {
    rows.push_back(static_cast<double>(pose.t_ns) * 1e-9);
    rows.insert(rows.end(), pose.T_world_camera.translation_m.begin(),
                pose.T_world_camera.translation_m.end());
    rows.insert(rows.end(), pose.T_world_camera.rotation_xyzw.begin(),
                pose.T_world_camera.rotation_xyzw.end());
  }
  return make_array(std::move(rows), {poses.size(), 8});
}

Array<float> points_of(const std::vector<api::MapPoint>& cloud) {
  std::vector<float> points;
  for (const api::MapPoint& p : cloud) points.insert(points.end(), {p.x_m, p.y_m, p.z_m});
  return make_array(std::move(points), {cloud.size(), 3});
}

Array<std::uint8_t> colours_of(const std::vector<api::MapPoint>& cloud) {
  std::vector<std::uint8_t> colours;
  for (const api::MapPoint& p : cloud) colours.insert(colours.end(), {p.r, p.g, p.b});
  return make_array(std::move(colours), {cloud.size(), 3});
}

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

  nb::enum_<api::State>(m, "State", "How sure the pose is.")
      .value("WAITING", api::State::kWaiting, "no frame with enough depth yet")
      .value("TRACKING", api::State::kTracking)
      .value("WEAK", api::State::kWeak, "a pose, but few points agree on it")
      .value("LOST", api::State::kLost);

  nb::class_<api::CameraModel>(m, "CameraModel",
                               "Pinhole camera with Brown-Conrady distortion, as in OpenCV [px]; "
                               "read-out times of a rolling shutter [ms].")
      .def(
          "__init__",
          [](api::CameraModel* self, double fx, double fy, double cx, double cy, int width,
             int height, double k1, double k2, double p1, double p2, double k3,
             double colour_readout_ms, double depth_readout_ms, double depth_delay_ms,
             bool shutter_known, const std::string& device,
             const std::vector<std::array<int, 4>>& ignore, const std::string& ignore_image) {
            new (self) api::CameraModel{fx,
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
                                        ignore_image};
          },
          nb::arg("fx"), nb::arg("fy"), nb::arg("cx"), nb::arg("cy"), nb::arg("width") = 640,
          nb::arg("height") = 480, nb::kw_only(), nb::arg("k1") = 0.0, nb::arg("k2") = 0.0,
          nb::arg("p1") = 0.0, nb::arg("p2") = 0.0, nb::arg("k3") = 0.0,
          nb::arg("colour_readout_ms") = 0.0, nb::arg("depth_readout_ms") = 0.0,
          nb::arg("depth_delay_ms") = 0.0, nb::arg("shutter_known") = false, nb::arg("device") = "",
          nb::arg("ignore") = std::vector<std::array<int, 4>>(), nb::arg("ignore_image") = "")
      .def_rw("fx", &api::CameraModel::fx)
      .def_rw("fy", &api::CameraModel::fy)
      .def_rw("cx", &api::CameraModel::cx)
      .def_rw("cy", &api::CameraModel::cy)
      .def_rw("k1", &api::CameraModel::k1)
      .def_rw("k2", &api::CameraModel::k2)
      .def_rw("p1", &api::CameraModel::p1)
      .def_rw("p2", &api::CameraModel::p2)
      .def_rw("k3", &api::CameraModel::k3)
      .def_rw("width", &api::CameraModel::width)
      .def_rw("height", &api::CameraModel::height)
      .def_rw("colour_readout_ms", &api::CameraModel::colour_readout_ms)
      .def_rw("depth_readout_ms", &api::CameraModel::depth_readout_ms)
      .def_rw("depth_delay_ms", &api::CameraModel::depth_delay_ms)
      .def_rw("shutter_known", &api::CameraModel::shutter_known)
      .def_rw("device", &api::CameraModel::device, "name of a known camera, see docs/camera.md")
      .def_rw("ignore", &api::CameraModel::ignore,
              "pixels that are not of the world: [x, y, width, height] each")
      .def_rw("ignore_image", &api::CameraModel::ignore_image,
              "the same as an 8-bit grey PNG of the camera's size, not 0 = ignored")
      .def("__repr__", [](const api::CameraModel& c) {
        return "CameraModel(" + std::to_string(c.width) + "x" + std::to_string(c.height) +
               ", fx=" + std::to_string(c.fx) + ", fy=" + std::to_string(c.fy) +
               ", cx=" + std::to_string(c.cx) + ", cy=" + std::to_string(c.cy) + ")";
      });

  nb::class_<api::Object>(m, "Object", "A person or another thing that moves or could.")
      .def_ro("id", &api::Object::id, "never given twice")
      .def_ro("class_name", &api::Object::class_name, "COCO's, or \"unknown\"")
      .def_ro("age_frames", &api::Object::age_frames)
      .def_ro("missing_frames", &api::Object::missing_frames, "since it was last confirmed")
      .def_ro("resting", &api::Object::resting, "demonstrably stands still")
      .def_ro("centre_world_m", &api::Object::centre_world_m)
      .def_ro("velocity_world_mps", &api::Object::velocity_world_mps)
      .def_ro("min_world_m", &api::Object::min_world_m, "box about what is visible of it")
      .def_ro("max_world_m", &api::Object::max_world_m);

  nb::class_<api::Result>(m, "Result", "What is known of a frame.")
      .def_ro("state", &api::Result::state)
      .def_prop_ro(
          "pose", [](const api::Result& r) { return to_matrix(r.T_world_camera); },
          nb::rv_policy::automatic,
          "T_world_camera, (4, 4) float64 [m]; meaningful while tracking or weak")
      .def_prop_ro(
          "T_odom_camera", [](const api::Result& r) { return to_matrix(r.T_odom_camera); },
          nb::rv_policy::automatic, "(4, 4); drifts, but never jumps")
      .def_prop_ro(
          "T_world_odom", [](const api::Result& r) { return to_matrix(r.T_world_odom); },
          nb::rv_policy::automatic, "(4, 4)")
      .def_ro("provisional", &api::Result::provisional,
              "found by what the camera sees alone: another room may look the same")
      .def_ro("static_points", &api::Result::static_points)
      .def_ro("dynamic_points", &api::Result::dynamic_points)
      .def_ro("unknown_points", &api::Result::unknown_points)
      .def_ro("inliers", &api::Result::inliers, "points that agree with the pose")
      .def_ro("mask_age_frames", &api::Result::mask_age_frames, "of the newest mask; -1 = none")
      .def_ro("objects", &api::Result::objects)
      .def_ro("clock_shift_ns", &api::Result::clock_shift_ns,
              "added to stamps since the clock was set back");

  nb::class_<api::MapSnapshot>(m, "MapSnapshot", "The map in the middle of a run.")
      .def_prop_ro(
          "keyframes", [](const api::MapSnapshot& s) { return to_rows(s.keyframes); },
          nb::rv_policy::automatic,
          "(N, 8) float64: seconds, x, y, z, qx, qy, qz, qw of T_world_camera")
      .def_prop_ro(
          "landmarks",
          [](const api::MapSnapshot& s) {
            std::vector<float> rows;
            for (const auto& p : s.landmarks_world_m) rows.insert(rows.end(), p.begin(), p.end());
            return make_array(std::move(rows), {s.landmarks_world_m.size(), 3});
          },
          nb::rv_policy::automatic, "(N, 3) float32 [m]")
      .def_prop_ro(
          "points", [](const api::MapSnapshot& s) { return points_of(s.static_map); },
          nb::rv_policy::automatic, "the static world, (N, 3) float32 [m]")
      .def_prop_ro(
          "colors", [](const api::MapSnapshot& s) { return colours_of(s.static_map); },
          nb::rv_policy::automatic, "of points, (N, 3) uint8");

  nb::class_<api::Outcome>(m, "Outcome", "What a run ended with.")
      .def_prop_ro(
          "trajectory", [](const api::Outcome& o) { return to_rows(o.trajectory); },
          nb::rv_policy::automatic,
          "(N, 8) float64: seconds, x, y, z, qx, qy, qz, qw of T_world_camera, corrected by what "
          "the map learned later")
      .def_prop_ro(
          "points", [](const api::Outcome& o) { return points_of(o.static_map); },
          nb::rv_policy::automatic, "the static world, (N, 3) float32 [m]")
      .def_prop_ro(
          "colors", [](const api::Outcome& o) { return colours_of(o.static_map); },
          nb::rv_policy::automatic, "of points, (N, 3) uint8");

  nb::class_<PySlam>(m, "Slam",
                     "One RGB-D frame in, one result out. One thread at a time may use it.")
      .def(
          "__init__",
          [](PySlam* self, const api::CameraModel& camera, const std::filesystem::path& model,
             const std::string& segmenter, const std::string& dynamic,
             const std::filesystem::path& load_map, bool localize_only, bool deterministic,
             bool keep_trajectory, const std::string& view,
             const std::map<std::string, std::string>& options) {
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
            const Unlocked unlocked;
            new (self) PySlam(settings);
          },
          nb::arg("camera"), nb::kw_only(), nb::arg("model") = "", nb::arg("segmenter") = "",
          nb::arg("dynamic") = "", nb::arg("load_map") = "", nb::arg("localize_only") = false,
          nb::arg("deterministic") = false, nb::arg("keep_trajectory") = true, nb::arg("view") = "",
          nb::arg("options") = std::map<std::string, std::string>{},
          "model: a YOLOv8-seg network (.onnx, .xml). segmenter: model, builtin, none, masks:DIR; "
          "without it the model, else the built-in network. dynamic: off, geometry, semantic, full; without "
          "it full where there are masks, else geometry. load_map: map of an earlier run to go on "
          "with; localize_only: it stays "
          "as it is. deterministic: same input, same result. view: where a page shows "
          "the run, e.g. \"127.0.0.1:8765\" (port 0: any). options: keys of `ygslam config`.")
      .def("process", &PySlam::process, nb::arg("rgb"), nb::arg("depth"), nb::arg("t_ns"),
           nb::kw_only(), nb::arg("depth_scale") = 0.0, nb::arg("depth_t_ns") = 0,
           "rgb: (H, W, 3) uint8. depth: (H, W) float32 [m], 0 or NaN = none, or uint16 with "
           "depth_scale (units per metre). Both C-contiguous, read during the call. t_ns: strictly "
           "increasing, but for a clock that was set back (five frames that agree, or reset()). "
           "depth_t_ns: of the depth image, for a rolling shutter; 0 = t_ns.")
      .def_prop_ro("view_url", &PySlam::view_url, "Address of the page; empty = none.")
      .def("map", &PySlam::map, "A copy of the map as it is now.")
      .def("save_map", &PySlam::save_map, nb::arg("path"),
           "Writes the map to a file, whole or not at all.")
      .def("reset", &PySlam::reset, "Forgets all but settings and network.")
      .def("finish", &PySlam::finish, "Ends the run. May be called again.")
      .def("__enter__", [](nb::object self) { return self; })
      .def("__exit__", [](PySlam& self, const nb::args&) { self.leave(); });

  bind_ros_images(m);
  bind_sequence(m);
}

}  // namespace ygslam::python
