// The public facade (include/ygslam/slam.hpp) over a session.
#include <algorithm>
#include <limits>
#include <optional>
#include <span>

#include "core/frame_clock.hpp"
#include "core/log.hpp"
#include "facade/settings.hpp"
#include "image/depth.hpp"
#include "io/image_file.hpp"
#include "live/run_view.hpp"
#include "map_file/map_file.hpp"
#include "system/run_writer.hpp"

namespace ygslam::api {
namespace {

Pose to_api(const SE3& T) {
  const Eigen::Quaterniond q = T.quaternion();
  return {{T.t().x(), T.t().y(), T.t().z()}, {q.x(), q.y(), q.z(), q.w()}};
}

std::array<double, 3> to_api(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

api::StampedPose to_api(const ygslam::StampedPose& pose) {
  return {pose.stamp.ns, to_api(pose.T_world_camera)};
}

std::vector<MapPoint> to_api(std::span<const ColouredPoint> points) {
  std::vector<MapPoint> result;
  for (const ColouredPoint& p : points)
    result.push_back(
        {p.p_world.x(), p.p_world.y(), p.p_world.z(), p.colour.r, p.colour.g, p.colour.b});
  return result;
}

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

bool is_too_far(std::int64_t t_ns) {
  return t_ns > FrameClock::kLatest_ns || t_ns < -FrameClock::kLatest_ns;
}

}  // namespace

struct Slam::Impl {
  HomeProcess home;
  SlamConfig config;
  log::SinkPtr sink;
  Session session;
  std::unique_ptr<RunView> view;
  FrameClock clock;
  std::uint32_t next_frame = 0;
  bool finished = false;
  std::optional<Error> failure;  // of code 1: for every later call

  ~Impl() {  // what ends may have something to say
    const log::ScopedSink scope(sink);
    view.reset();
    session.runner.reset();
  }
  void open_view(const std::string& address);
  Result process(const Frame& frame);
  MapSnapshot map();
  void reset();
  Outcome finish();

  // A call of the user's, unless there can be none any more.
  template <typename Work>
  auto call(const Work& work) {
    if (failure) throw *failure;
    try {
      return guarded(sink, work);
    } catch (const Error& e) {
      if (e.code == static_cast<int>(ErrorKind::kInternal)) failure = e;
      throw;
    }
  }
};

Slam::Slam(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Slam::Slam(Slam&&) noexcept = default;
Slam& Slam::operator=(Slam&& other) noexcept {
  if (this == &other) return *this;
  end_at_home(impl_);
  impl_ = std::move(other.impl_);
  return *this;
}
Slam::~Slam() { end_at_home(impl_); }

Slam Slam::open(const Settings& settings) {
  const log::SinkPtr sink = sink_of(settings);
  return guarded(sink, [&] {
    auto impl = std::make_unique<Impl>();
    SessionOptions options = session_options(settings);
    options.camera = to_config(settings.camera);
    impl->config = options.config;
    impl->sink = sink;
    auto session = open_session(std::move(options));
    if (!session.ok()) fail(session.error());
    impl->session = std::move(session).value();
    if (!settings.view.empty()) impl->open_view(settings.view);
    return Slam(std::move(impl));
  });
}

Result Slam::process(const Frame& frame) {
  Impl& impl = alive(impl_, "process()");
  return impl.call([&] { return impl.process(frame); });
}

std::string Slam::view_url() const {
  const Impl& impl = alive(impl_, "view_url()");
  return impl.view ? impl.view->url() : std::string();
}

MapSnapshot Slam::map() {
  Impl& impl = alive(impl_, "map()");
  return impl.call([&] { return impl.map(); });
}

void Slam::save_map(const std::string& path) {
  Session& session = alive(impl_, "save_map()").session;
  impl_->call([&] {
    const Status written = ygslam::save_map(path, session.runner->map(), *session.camera);
    if (!written.ok()) fail(written.error());
  });
}

void Slam::reset() {
  Impl& impl = alive(impl_, "reset()");
  impl.call([&] { impl.reset(); });
}

Outcome Slam::finish() {
  Impl& impl = alive(impl_, "finish()");
  return impl.call([&] { return impl.finish(); });
}

void Slam::Impl::open_view(const std::string& address) {
  auto server = parse_view_address(address);
  if (!server.ok()) fail(server.error());
  auto started =
      RunView::start({.server = *server, .camera = session.camera->config(), .driven = false});
  if (!started.ok()) fail(started.error());
  view = std::move(started).value();
}

Result Slam::Impl::process(const Frame& frame) {
  if (finished) fail({ErrorKind::kUsage, "process() after finish()"});
  if (!frame.rgb || !frame.depth_m) fail({ErrorKind::kInput, "frame without colour or depth"});
  if (is_too_far(frame.t_ns) || is_too_far(frame.depth_t_ns))
    fail({ErrorKind::kInput, "frame stamp too far from 0"});
  const FrameClock::Reading time = clock.step({frame.t_ns});
  if (!time.stamp) fail({ErrorKind::kInput, "frame stamps must increase"});
  if (time.was_set_back)
    log::warn("frame stamps went back and stay there: {:.3f} s are added to them from here on",
              1e-9 * static_cast<double>(clock.shift_ns()));
  const Camera& camera = *session.camera;
  const std::size_t pixels = static_cast<std::size_t>(camera.width()) * camera.height();
  auto input = std::make_shared<RgbdFrame>();
  input->id = FrameId{next_frame++};
  input->stamp = *time.stamp;
  if (frame.depth_t_ns != 0)
    input->depth_delay_s = seconds_between({frame.depth_t_ns}, {frame.t_ns});
  input->colour = ColourImage(camera.width(), camera.height());
  std::copy_n(frame.rgb, 3 * pixels, reinterpret_cast<std::uint8_t*>(input->colour.data()));
  input->grey = grey_from_colour(input->colour);
  DepthImage depth_m(camera.width(), camera.height());
  std::copy_n(frame.depth_m, pixels, depth_m.data());
  input->depth_m = sanitized_depth(depth_m, config.depth);

  const TrackResult tracked = session.runner->process(input);
  if (view) {
    view->show(input, tracked);
    view->show_map(*session.runner);
  }
  Result result;
  result.clock_shift_ns = clock.shift_ns();
  result.state = to_api(tracked.state);
  result.T_world_camera = to_api(tracked.T_world_camera);
  result.T_odom_camera = to_api(tracked.T_odom_camera);
  result.T_world_odom = to_api(tracked.T_world_odom);
  result.provisional = tracked.provisional;
  result.static_points = tracked.labels.static_points;
  result.dynamic_points = tracked.labels.dynamic_points;
  result.unknown_points = tracked.labels.unknown_points;
  result.inliers = tracked.inliers;
  result.mask_age_frames = tracked.mask_age_frames;
  for (const TrackedObject& object : tracked.objects) result.objects.push_back(to_api(object));
  return result;
}

MapSnapshot Slam::Impl::map() {
  MapSnapshot snapshot;
  const Map map = session.runner->map();
  for (const ygslam::StampedPose& pose : keyframe_trajectory(map))
    snapshot.keyframes.push_back(to_api(pose));
  map.for_each_landmark([&](const Landmark& landmark) {
    const Eigen::Vector3f p = landmark.p_world.cast<float>();
    snapshot.landmarks_world_m.push_back({p.x(), p.y(), p.z()});
  });
  snapshot.static_map = to_api(session.runner->cloud());
  return snapshot;
}

void Slam::Impl::reset() {
  if (finished) fail({ErrorKind::kUsage, "reset() after finish()"});
  session.runner->reset();
  clock.restart();
  if (view) view->restart();
}

Outcome Slam::Impl::finish() {
  const bool was_finished = std::exchange(finished, true);
  const SlamOutcome& outcome = session.runner->finish();
  if (view && !was_finished) view->finish(session.runner.get());
  Outcome result;
  for (const ygslam::StampedPose& pose :
       final_trajectory(outcome.trajectory, outcome.revised, session.runner->map()))
    result.trajectory.push_back(to_api(pose));
  result.static_map = to_api(session.runner->cloud());
  return result;
}

}  // namespace ygslam::api
