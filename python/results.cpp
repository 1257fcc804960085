// What the library says of a frame, of a run and of its end.
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <tuple>

#include "arrays.hpp"
#include "bindings.hpp"
#include "text.hpp"

namespace nb = nanobind;

namespace ygslam::python {
namespace {

using Matrix6 = nb::ndarray<nb::numpy, double, nb::shape<6, 6>>;
using Matrix3 = nb::ndarray<nb::numpy, double, nb::shape<3, 3>>;
using PoseFields = std::tuple<std::array<double, 3>, std::array<double, 4>>;

PoseFields fields_of(const api::Pose& pose) { return {pose.translation_m, pose.rotation_xyzw}; }
api::Pose pose_of(const PoseFields& fields) { return {std::get<0>(fields), std::get<1>(fields)}; }

auto fields_of(const api::Object& o) {
  return std::tuple(o.id, o.class_name, o.age_frames, o.missing_frames, o.resting, o.faded,
                    o.centre_world_m, o.velocity_world_mps, o.min_world_m, o.max_world_m,
                    o.body_world_m, o.body_velocity_world_mps, o.body_covariance);
}
using ObjectFields = decltype(fields_of(api::Object()));

auto fields_of(const api::StageTimes& t) {
  return std::tuple(t.masks, t.features, t.motion, t.pose, t.all);
}
using TimesFields = decltype(fields_of(api::StageTimes()));

Matrix6 to_matrix6(const std::array<double, 36>& rows) {
  return make_array<Matrix6>(std::vector<double>(rows.begin(), rows.end()), {6, 6});
}

// A Result in pickles: itself in the order of its members.
auto fields_of(const api::Result& r) {
  std::vector<int> events;
  for (const api::Event event : r.events) events.push_back(static_cast<int>(event));
  return std::tuple(static_cast<int>(r.state), fields_of(r.T_world_camera),
                    fields_of(r.T_odom_camera), fields_of(r.T_world_odom), r.provisional,
                    r.covariance, r.map_covariance, r.seen_covariance, events, r.static_points,
                    r.dynamic_points, r.unknown_points, r.inliers, r.mask_age_frames, r.objects,
                    r.clock_shift_ns, r.t_ns, r.dropped_frames, fields_of(r.times_ms));
}
using ResultFields = decltype(fields_of(api::Result()));

api::Result result_of(const ResultFields& fields) {
  api::Result r;
  int state = 0;
  PoseFields world_camera, odom_camera, world_odom;
  std::vector<int> events;
  TimesFields times_ms;
  std::tie(state, world_camera, odom_camera, world_odom, r.provisional, r.covariance,
           r.map_covariance, r.seen_covariance, events, r.static_points, r.dynamic_points,
           r.unknown_points, r.inliers, r.mask_age_frames, r.objects, r.clock_shift_ns, r.t_ns,
           r.dropped_frames, times_ms) = fields;
  r.times_ms = std::make_from_tuple<api::StageTimes>(times_ms);
  r.state = static_cast<api::State>(state);
  r.T_world_camera = pose_of(world_camera);
  r.T_odom_camera = pose_of(odom_camera);
  r.T_world_odom = pose_of(world_odom);
  for (const int event : events) r.events.push_back(static_cast<api::Event>(event));
  return r;
}

std::string text_of(const api::Result& r) {
  const auto& t = r.T_world_camera.translation_m;
  return text("Result({}, at [{:.3f}, {:.3f}, {:.3f}] m, {} inliers, {} objects)",
              nb::cast(r.state).attr("name"), t[0], t[1], t[2], r.inliers, r.objects.size());
}

std::string text_of(const api::Object& o) {
  const auto& c = o.centre_world_m;
  return text("Object({} {}, at [{:.2f}, {:.2f}, {:.2f}] m, {} frames old)", o.class_name, o.id,
              c[0], c[1], c[2], o.age_frames);
}

void bind_enums(nb::module_& m) {
  nb::enum_<api::State>(m, "State", "How sure the pose is.")
      .value("WAITING", api::State::kWaiting, "no frame with enough depth yet")
      .value("TRACKING", api::State::kTracking)
      .value("WEAK", api::State::kWeak, "a pose, but few points agree on it")
      .value("LOST", api::State::kLost)
      .value("COASTING", api::State::kCoasting,
             "by IMU (8 s at most) or wheels (30 s): no pose is seen, or one that the IMU "
             "contradicts");
  nb::enum_<api::Event>(m, "Event", "What happened since the result before.")
      .value("LOST", api::Event::kLost)
      .value("RELOCALISED", api::Event::kRelocalised, "a place again after being lost")
      .value("KEYFRAME", api::Event::kKeyframe, "the frame becomes part of the map")
      .value("LOOP_CLOSED", api::Event::kLoopClosed,
             "a place was seen again: the map was corrected")
      .value("MAP_SAVED", api::Event::kMapSaved, "by save_map()")
      .value("CAMERA_LEARNED", api::Event::kCameraLearned, "the times of a rolling shutter");
}

void bind_object(nb::module_& m) {
  nb::class_<api::Object>(m, "Object", "A person or another thing that moves or could.")
      .def_ro("id", &api::Object::id, "never given twice")
      .def_ro("class_name", &api::Object::class_name, "COCO's, or \"unknown\"")
      .def_ro("age_frames", &api::Object::age_frames)
      .def_ro("missing_frames", &api::Object::missing_frames, "since it was last confirmed")
      .def_ro("resting", &api::Object::resting, "demonstrably stands still")
      .def_ro("faded", &api::Object::faded, "not confirmed for over a second")
      .def_ro("centre_world_m", &api::Object::centre_world_m)
      .def_ro("velocity_world_mps", &api::Object::velocity_world_mps)
      .def_ro("min_world_m", &api::Object::min_world_m, "box about what is visible of it")
      .def_ro("max_world_m", &api::Object::max_world_m)
      .def_ro("body_world_m", &api::Object::body_world_m,
              "filtered: the middle of a person, of other things that of what is seen")
      .def_ro("body_velocity_world_mps", &api::Object::body_velocity_world_mps, "filtered")
      .def_prop_ro(
          "body_covariance",
          [](const api::Object& o) {
            return make_array<Matrix6>(
                std::vector<double>(o.body_covariance.begin(), o.body_covariance.end()), {6, 6});
          },
          nb::rv_policy::automatic, "(6, 6) of body_world_m and body_velocity_world_mps [m, m/s]")
      .def(
          "after",
          [](const api::Object& o, double seconds) {
            const api::Forecast forecast = o.after(seconds);
            const auto& c = forecast.covariance_m2;
            return std::tuple(forecast.position_world_m,
                              make_array<Matrix3>(std::vector<double>(c.begin(), c.end()), {3, 3}));
          },
          nb::arg("seconds"),
          "Where it will be: position in the world [m] and its covariance (3, 3) [m2].")
      .def("__getstate__", [](const api::Object& o) { return fields_of(o); })
      .def("__setstate__",
           [](api::Object& o, const ObjectFields& fields) {
             new (&o) api::Object(std::make_from_tuple<api::Object>(fields));
           })
      .def("__repr__", [](const api::Object& o) { return text_of(o); });
}

void bind_times(nb::module_& m) {
  using Times = api::StageTimes;
  nb::class_<Times>(m, "StageTimes", "What a frame took [ms], of the wall clock.")
      .def_ro("masks", &Times::masks, "the network, or waiting for it")
      .def_ro("features", &Times::features, "finding corners")
      .def_ro("motion", &Times::motion, "what of them moves")
      .def_ro("pose", &Times::pose, "the camera's, and the objects'")
      .def_ro("all", &Times::all, "from the copied frame to the result")
      .def("__repr__", [](const Times& t) { return text("StageTimes({:.1f} ms)", t.all); });
}

void bind_result(nb::module_& m) {
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
      .def_prop_ro(
          "covariance", [](const api::Result& r) { return to_matrix6(r.covariance); },
          nb::rv_policy::automatic,
          "of T_odom_camera, (6, 6) float64: x, y, z [m2], then rotations about the axes of odom "
          "[rad2], with what odom has drifted; 0 of the first frame, wider while weak or coasting, "
          "1e6 on the diagonal while lost or unknown")
      .def_prop_ro(
          "map_covariance", [](const api::Result& r) { return to_matrix6(r.map_covariance); },
          nb::rv_policy::automatic,
          "of pose, in axes of the world: with what the map has drifted to where the camera is")
      .def_prop_ro(
          "seen_covariance", [](const api::Result& r) { return to_matrix6(r.seen_covariance); },
          nb::rv_policy::automatic,
          "as covariance, against the ground that the frame shows alone: of the motion between two "
          "frames soon after each other it is the sum of both")
      .def_ro("events", &api::Result::events, "what happened since the result before")
      .def_ro("provisional", &api::Result::provisional,
              "found by what the camera sees alone: another room may look the same")
      .def_ro("static_points", &api::Result::static_points)
      .def_ro("dynamic_points", &api::Result::dynamic_points)
      .def_ro("unknown_points", &api::Result::unknown_points)
      .def_ro("inliers", &api::Result::inliers, "points that agree with the pose")
      .def_ro("mask_age_frames", &api::Result::mask_age_frames, "of the newest mask; -1 = none")
      .def_ro("objects", &api::Result::objects)
      .def_ro("clock_shift_ns", &api::Result::clock_shift_ns,
              "added to stamps since the clock was set back")
      .def_ro("t_ns", &api::Result::t_ns, "of the frame, as it came")
      .def_ro("dropped_frames", &api::Result::dropped_frames, "by push(), so far")
      .def_ro("times_ms", &api::Result::times_ms)
      .def("__getstate__", [](const api::Result& r) { return fields_of(r); })
      .def("__setstate__",
           [](api::Result& r, const ResultFields& fields) {
             new (&r) api::Result(result_of(fields));
           })
      .def("__repr__", [](const api::Result& r) { return text_of(r); });
}

void bind_maps(nb::module_& m) {
  nb::class_<api::MapSnapshot>(
      m, "MapSnapshot", "The map in the middle of a run. Arrays are views of it, to be read.")
      .def_prop_ro(
          "keyframes", [](const api::MapSnapshot& s) { return to_rows(s.keyframes); },
          nb::rv_policy::automatic,
          "(N, 8) float64: seconds, x, y, z, qx, qy, qz, qw of T_world_camera")
      .def_prop_ro(
          "landmarks",
          [](const api::MapSnapshot& s) {
            const auto& list = s.landmarks_world_m;
            return columns_of<const float>(list, list.empty() ? nullptr : list.data()->data(),
                                           nb::find(s));
          },
          nb::rv_policy::automatic, "(N, 3) float32 [m]")
      .def_prop_ro(
          "points", [](const api::MapSnapshot& s) { return points_of(s.static_map, nb::find(s)); },
          nb::rv_policy::automatic, "the static world, (N, 3) float32 [m]")
      .def_prop_ro(
          "colors", [](const api::MapSnapshot& s) { return colours_of(s.static_map, nb::find(s)); },
          nb::rv_policy::automatic, "of points, (N, 3) uint8")
      .def("__repr__", [](const api::MapSnapshot& s) {
        return text("MapSnapshot({} keyframes, {} landmarks, {} points)", s.keyframes.size(),
                    s.landmarks_world_m.size(), s.static_map.size());
      });
  nb::class_<api::Outcome>(m, "Outcome",
                           "What a run ended with. points and colors are views of it, to be read.")
      .def_prop_ro(
          "trajectory", [](const api::Outcome& o) { return to_rows(o.trajectory); },
          nb::rv_policy::automatic,
          "(N, 8) float64: seconds, x, y, z, qx, qy, qz, qw of T_world_camera, corrected by what "
          "the map learned later")
      .def_prop_ro(
          "points", [](const api::Outcome& o) { return points_of(o.static_map, nb::find(o)); },
          nb::rv_policy::automatic, "the static world, (N, 3) float32 [m]")
      .def_prop_ro(
          "colors", [](const api::Outcome& o) { return colours_of(o.static_map, nb::find(o)); },
          nb::rv_policy::automatic, "of points, (N, 3) uint8")
      .def("__repr__", [](const api::Outcome& o) {
        return text("Outcome({} poses, {} points)", o.trajectory.size(), o.static_map.size());
      });
}

}  // namespace

void bind_results(nb::module_& m) {
  bind_enums(m);
  bind_object(m);
  bind_times(m);
  bind_result(m);
  bind_maps(m);
}

}  // namespace ygslam::python
