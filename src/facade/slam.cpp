// The public facade (include/ygslam/slam.hpp) over a session.
#include <algorithm>

#include "image/depth.hpp"
#include "io/image_file.hpp"
#include "system/metrics.hpp"
#include "system/run_writer.hpp"
#include "system/session.hpp"
#include "ygslam/slam.hpp"

namespace ygslam::api {
namespace {

[[noreturn]] void fail(const ygslam::Error& error) {
  throw Error(static_cast<int>(error.kind), error.message);
}

Pose to_api(const SE3& T) {
  const Eigen::Quaterniond q = T.quaternion();
  return {{T.t().x(), T.t().y(), T.t().z()}, {q.x(), q.y(), q.z(), q.w()}};
}

std::array<double, 3> to_api(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

Object to_api(const TrackedObject& o) {
  return {index(o.id),
          coco_class_name(o.class_id),
          o.age_frames,
          o.missing_frames,
          o.resting,
          to_api(o.centre_world),
          to_api(o.velocity_world_mps),
          to_api(o.min_world),
          to_api(o.max_world)};
}

CameraConfig to_config(const CameraModel& m) {
  CameraConfig c;
  c.fx = m.fx, c.fy = m.fy, c.cx = m.cx, c.cy = m.cy;
  c.k1 = m.k1, c.k2 = m.k2, c.p1 = m.p1, c.p2 = m.p2, c.k3 = m.k3;
  c.width = m.width, c.height = m.height;
  return c;
}

State to_api(TrackState state) {
  switch (state) {
    case TrackState::kWaiting:
      return State::kWaiting;
    case TrackState::kTracking:
      return State::kTracking;
    case TrackState::kWeak:
      return State::kWeak;
    case TrackState::kLost:
      return State::kLost;
  }
  return State::kLost;
}

DynamicMode mode_of(const Settings& settings) {
  const std::string& name = settings.dynamic;
  if (name.empty()) return settings.model.empty() ? DynamicMode::kGeometry : DynamicMode::kFull;
  for (const auto mode :
       {DynamicMode::kOff, DynamicMode::kGeometry, DynamicMode::kSemantic, DynamicMode::kFull}) {
    if (name == mode_name(mode)) return mode;
  }
  fail({ErrorKind::kConfig, "dynamic = '" + name + "' is not off, geometry, semantic or full"});
}

}  // namespace

struct Slam::Impl {
  Session session;
  SlamConfig config;
  Timestamp last{INT64_MIN};
  std::uint32_t next_frame = 0;
};

Slam::Slam(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Slam::Slam(Slam&&) noexcept = default;
Slam& Slam::operator=(Slam&&) noexcept = default;
Slam::~Slam() = default;

Slam Slam::open(const Settings& settings) {
  auto impl = std::make_unique<Impl>();
  ConfigSchema schema = schema_of(impl->config);
  for (const auto& [key, value] : settings.options) {
    const Status set = schema.set(key, value, "options");
    if (!set.ok()) fail(set.error());
  }
  impl->config.dynamic.mode = mode_of(settings);
  SessionOptions options;
  options.config = impl->config;
  options.camera = to_config(settings.camera);
  options.model = settings.model;
  options.deterministic = settings.deterministic;
  auto session = open_session(std::move(options));
  if (!session.ok()) fail(session.error());
  impl->session = std::move(session).value();
  return Slam(std::move(impl));
}

Result Slam::process(const Frame& frame) {
  if (!frame.rgb || !frame.depth_m) fail({ErrorKind::kInput, "frame without colour or depth"});
  if (frame.t_ns <= impl_->last.ns) fail({ErrorKind::kInput, "frame stamps must increase"});
  impl_->last.ns = frame.t_ns;
  const Camera& camera = *impl_->session.camera;
  const std::size_t pixels = static_cast<std::size_t>(camera.width()) * camera.height();
  auto input = std::make_shared<RgbdFrame>();
  input->id = FrameId{impl_->next_frame++};
  input->stamp = {frame.t_ns};
  input->colour = ColourImage(camera.width(), camera.height());
  std::copy_n(frame.rgb, 3 * pixels, reinterpret_cast<std::uint8_t*>(input->colour.data()));
  input->grey = grey_from_colour(input->colour);
  DepthImage depth_m(camera.width(), camera.height());
  std::copy_n(frame.depth_m, pixels, depth_m.data());
  input->depth_m = sanitized_depth(depth_m, impl_->config.depth);

  const TrackResult tracked = impl_->session.runner->process(input);
  Result result;
  result.state = to_api(tracked.state);
  result.T_world_camera = to_api(tracked.T_world_camera);
  const FrameRecord record = make_record(*input, tracked);
  result.static_points = record.static_points;
  result.dynamic_points = record.dynamic_points;
  result.unknown_points = record.unknown_points;
  result.inliers = tracked.inliers;
  result.mask_age_frames = tracked.mask_age_frames;
  for (const TrackedObject& object : tracked.objects) result.objects.push_back(to_api(object));
  return result;
}

Outcome Slam::finish() {
  const SlamOutcome outcome = impl_->session.runner->finish();
  const MappingStage& mapping = impl_->session.runner->mapping();
  Outcome result;
  for (const auto& pose : final_trajectory(outcome, mapping.map())) {
    result.trajectory.push_back({pose.stamp.ns, to_api(pose.T_world_camera)});
  }
  for (const ColouredPoint& p : mapping.cloud()) {
    result.static_map.push_back(
        {p.p_world.x(), p.p_world.y(), p.p_world.z(), p.colour.r, p.colour.g, p.colour.b});
  }
  return result;
}

}  // namespace ygslam::api
