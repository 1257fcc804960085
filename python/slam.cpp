// ygslam.Slam.
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <filesystem>
#include <optional>
#include <utility>

#include "arrays.hpp"
#include "bindings.hpp"
#include "calls.hpp"
#include "frame_input.hpp"
#include "text.hpp"

namespace nb = nanobind;

namespace ygslam::python {

/// Keys of `ygslam config`; their values as text or numbers.
struct Options {
  std::map<std::string, std::string> values;
};

}  // namespace ygslam::python

template <>
struct nb::detail::type_caster<ygslam::python::Options> {
  NB_TYPE_CASTER(ygslam::python::Options, const_name("collections.abc.Mapping[str, str | float]"))

  bool from_python(handle source, std::uint8_t, cleanup_list*) noexcept {
    try {
      if (!PyMapping_Check(source.ptr())) return false;
      const nb::object items = nb::steal(PyMapping_Items(source.ptr()));
      if (!items.is_valid()) throw nb::python_error();
      for (const nb::handle item : items) {
        const nb::object key = item[0], given = item[1];
        if (!PyUnicode_Check(given.ptr()) && !PyNumber_Check(given.ptr())) return false;
        value.values[nb::cast<std::string>(key)] = nb::str(given).c_str();
      }
      return true;
    } catch (const std::exception&) {  // of another type
      PyErr_Clear();
      return false;
    }
  }
};

namespace ygslam::python {
namespace {

class PySlam {
 public:
  explicit PySlam(const api::Settings& settings)
      : size_(size_of(settings.camera)),
        depth_size_(settings.depth_camera ? size_of(settings.depth_camera->camera) : size_),
        slam_(settings) {}

  // The arrays lie where they are until the call ends.
  api::Result process(const FrameArguments& arguments) {
    const api::Frame frame = frame_of(arguments, size_, depth_size_);
    const SlamUse use(slam_);
    return slam_->process(frame);
  }
  void push(const FrameArguments& arguments) {
    const api::Frame frame = frame_of(arguments, size_, depth_size_);
    const SlamUse use(slam_);
    slam_->push(frame);
  }
  std::optional<Matrix4> localise_now(const FrameArguments& arguments) {
    const api::Frame frame = frame_of(arguments, size_, depth_size_);
    const auto place = [&] {
      const SlamUse use(slam_);
      return slam_->localise_now(frame);
    }();
    return place ? std::optional(to_matrix(*place)) : std::nullopt;
  }
  /// From any thread: what reads the sensor does not wait for a frame.
  void push_imu(std::int64_t t_ns, const std::array<double, 3>& angular_velocity,
                const std::array<double, 3>& specific_force) {
    slam_->push_imu({t_ns, angular_velocity, specific_force});
  }
  /// The same.
  void push_odometry(std::int64_t t_ns, const nb::object& T_odom_base) {
    slam_->push_odometry({t_ns, pose_of(T_odom_base, "T_odom_base")});
  }
  std::optional<api::Result> poll() {
    const SlamUse use(slam_);
    return slam_->poll();
  }
  [[nodiscard]] std::string view_url() const { return slam_->view_url(); }
  api::MapSnapshot map() {
    const SlamUse use(slam_);
    return slam_->map();
  }
  /// As long as nothing changed the same object, as the library shares it; Python cannot change it.
  std::shared_ptr<api::OccupancyGrid> plan() {
    const SlamUse use(slam_);
    const auto plan = slam_->plan();
    return plan->cells.empty() ? nullptr : std::const_pointer_cast<api::OccupancyGrid>(plan);
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
  /// At the end of a `with`; a forked child that leaves it has nothing to end.
  void leave() {
    if (slam_.is_at_home()) static_cast<void>(finish());
  }
  [[nodiscard]] std::string text() const {
    return python::text("Slam({} x {} pixels)", size_.width, size_.height);
  }

 private:
  static ImageSize size_of(const api::CameraModel& camera) {
    return {static_cast<std::size_t>(camera.height), static_cast<std::size_t>(camera.width)};
  }
  ImageSize size_, depth_size_;
  KeptSlam slam_;
};

void construct(PySlam* self, const api::CameraModel& camera, const std::filesystem::path& model,
               const std::string& segmenter, const std::string& dynamic,
               const std::filesystem::path& load_map, bool localize_only, bool deterministic,
               bool keep_trajectory, const std::string& view, const Options& options,
               double room_every_s, const std::optional<api::CameraModel>& depth_camera,
               const nb::object& T_colour_depth,
               const std::optional<std::pair<std::array<double, 3>, double>>& floor,
               const std::optional<api::Imu>& imu, const std::optional<api::Wheels>& wheels) {
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
  settings.options = options.values;
  settings.room_every_s = room_every_s;
  settings.imu = imu;
  settings.wheels = wheels;
  if (floor) settings.floor = api::Floor{floor->first, floor->second};
  if (!depth_camera && !T_colour_depth.is_none())
    throw nb::value_error("T_colour_depth: a depth_camera is expected with it");
  if (depth_camera) settings.depth_camera = api::DepthCamera{*depth_camera, {}};
  if (depth_camera && !T_colour_depth.is_none())
    settings.depth_camera->T_colour_depth = pose_of(T_colour_depth, "T_colour_depth");
  const Unlocked unlocked;
  new (self) PySlam(settings);
}

/// The calls that take a frame, all of them the same way.
template <auto Member>
auto with_frame(PySlam& self, nb::object rgb, nb::object depth, std::int64_t t_ns,
                double depth_scale, std::int64_t depth_t_ns, const std::string& order,
                nb::object instances, const std::vector<std::string>& classes,
                const std::vector<float>& scores, nb::object T_last_camera) {
  return (self.*Member)({std::move(rgb), std::move(depth), t_ns, depth_scale, depth_t_ns, order,
                         std::move(instances), classes, scores, std::move(T_last_camera)});
}

template <auto Member>
void bind_frame_call(nb::class_<PySlam>& slam, const char* name, const char* returned,
                     const char* what) {
  const std::string signature =
      std::string("def ") + name +
      "(self, rgb: numpy.typing.NDArray[numpy.uint8], "
      "depth: numpy.typing.NDArray[numpy.float32] | numpy.typing.NDArray[numpy.uint16], "
      "t_ns: int, *, depth_scale: float = 0.0, depth_t_ns: int = 0, order: str = 'rgb', "
      "instances: numpy.typing.NDArray[numpy.uint8] | None = None, "
      "classes: collections.abc.Sequence[str] = (), "
      "scores: collections.abc.Sequence[float] = (), "
      "T_last_camera: numpy.typing.NDArray[numpy.float64] | None = None) -> " +
      returned;
  slam.def(name, &with_frame<Member>, nb::arg("rgb").none(), nb::arg("depth").none(),
           nb::arg("t_ns"), nb::kw_only(), nb::arg("depth_scale") = 0.0, nb::arg("depth_t_ns") = 0,
           nb::arg("order") = "rgb", nb::arg("instances") = nb::none(),
           nb::arg("classes") = std::vector<std::string>(),
           nb::arg("scores") = std::vector<float>(), nb::arg("T_last_camera") = nb::none(),
           nb::sig(signature.c_str()), what);
}

void bind_frame_calls(nb::class_<PySlam>& slam) {
  bind_frame_call<&PySlam::process>(
      slam, "process", "Result",
      "rgb: (H, W, 3) uint8, or as order says: rgb, bgr, mono (H, W). depth: (H, W) float32 [m], 0 "
      "or NaN = none, or uint16 with depth_scale (units per metre). Read during the call; rows may "
      "be apart, pixels not. t_ns: strictly increasing, but for a clock that was set back (five "
      "frames that agree, or reset()). depth_t_ns: of the depth image, for a rolling shutter; 0 = "
      "t_ns. instances: masks of one's own with segmenter=\"frames\", (H, W) uint8, 0 = none, i = "
      "classes[i - 1] (COCO's names); scores 0 to 1. T_last_camera: odometry, (4, 4): where this "
      "camera is in that of the frame before; a start for the search, no more.");
  bind_frame_call<&PySlam::push>(
      slam, "push", "None",
      "As process() without waiting: the frame is copied, and processed by a thread of its own. "
      "While that is busy one frame waits, and a newer one takes its place "
      "(Result.dropped_frames). No more process() then.");
  bind_frame_call<&PySlam::localise_now>(
      slam, "localise_now", "numpy.typing.NDArray[numpy.float64] | None",
      "Where in the map the frame was taken, by what it shows alone: T_world_camera, (4, 4), or "
      "None. Nothing else changes. Takes its time: the map is copied.");
}

}  // namespace

void bind_slam(nb::module_& m) {
  nb::class_<PySlam> slam(m, "Slam",
                          "One RGB-D frame in, one result out. One thread at a time may use it.");
  slam.def("__init__", &construct, nb::arg("camera"), nb::kw_only(), nb::arg("model") = "",
           nb::arg("segmenter") = "", nb::arg("dynamic") = "", nb::arg("load_map") = "",
           nb::arg("localize_only") = false, nb::arg("deterministic") = false,
           nb::arg("keep_trajectory") = true, nb::arg("view") = "", nb::arg("options") = nb::dict(),
           nb::arg("room_every_s") = 1.0, nb::arg("depth_camera") = nb::none(),
           nb::arg("T_colour_depth") = nb::none(), nb::arg("floor") = nb::none(),
           nb::arg("imu") = nb::none(), nb::arg("wheels") = nb::none(),
           "model: a segmentation network (.onnx, .xml; docs/models.md). segmenter: model, "
           "builtin, none, masks:DIR, "
           "frames; without it the model, else the built-in network. dynamic: off, geometry, "
           "semantic, full; without it full where there are masks, else geometry. load_map: map of "
           "an earlier run to go on with; localize_only: it stays as it is. deterministic: same "
           "input, same result. view: where a page shows the run, e.g. \"127.0.0.1:8765\" (port 0: "
           "any). options: keys of `ygslam config`. room_every_s: how often map() and room() are "
           "renewed at most. depth_camera: the camera that takes the depth images, where they are "
           "not registered; T_colour_depth: (4, 4), from its optical frame to the colour camera's. "
           "floor: (up, metres): where the floor of plan() is in the world, its height along up; "
           "else it is found. imu: the Imu that push_imu() takes the readings of; wheels: the "
           "Wheels of push_odometry().");
  bind_frame_calls(slam);
  slam.def("push_imu", &PySlam::push_imu, nb::arg("t_ns"), nb::arg("angular_velocity"),
           nb::arg("specific_force"),
           "A reading of the Imu, in its own frame: rad/s, and m/s2 with gravity (at rest 9.81 "
           "upwards). t_ns: of the frames' clock. In order of time, best before the frame that is "
           "as old. Any thread may call it.");
  slam.def("push_odometry", &PySlam::push_odometry, nb::arg("t_ns"), nb::arg("T_odom_base"),
           "Where the odometry of the robot has its base, (4, 4); as push_imu().");
  slam.def("poll", &PySlam::poll,
           "The next Result of what was pushed, oldest first, or None. The last 64 are kept.")
      .def_prop_ro("view_url", &PySlam::view_url, "Address of the page; empty = none.")
      .def("map", &PySlam::map, "The map as it was published last, at once.")
      .def("room", &PySlam::room,
           "The static room as it was published last, at once: free space, mesh, objects. If "
           "deterministic, and after finish(), that of now.")
      .def("plan", &PySlam::plan, nb::sig("def plan(self) -> OccupancyGrid | None"),
           "The ground plan for a robot that drives now, as it was published last, at once: made "
           "anew with each keyframe, with masks also twice a second where the camera stands. Free: "
           "the floor or "
           "the air just above it was seen, and of the heights from dense.plan_low_m to "
           "dense.plan_high_m no 5 cm are unseen. None as long as no floor is known. If "
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
}

}  // namespace ygslam::python
