// The public facade (include/ygslam/slam.hpp) over a session.
#include <algorithm>
#include <limits>
#include <mutex>
#include <optional>

#include "core/frame_clock.hpp"
#include "core/log.hpp"
#include "facade/convert.hpp"
#include "facade/event_watch.hpp"
#include "facade/input.hpp"
#include "facade/motion_inbox.hpp"
#include "facade/placing.hpp"
#include "facade/published_map.hpp"
#include "facade/push_thread.hpp"
#include "facade/settings.hpp"
#include "live/run_view.hpp"
#include "map_file/map_file.hpp"
#include "system/run_writer.hpp"

namespace ygslam::api {
namespace {

bool is_too_far(std::int64_t t_ns) {
  return t_ns > FrameClock::kLatest_ns || t_ns < -FrameClock::kLatest_ns;
}

/// Whether two images are no pair.
bool is_far_from(std::int64_t a_ns, std::int64_t b_ns) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  return a_ns < b_ns - kSecond_ns || a_ns > b_ns + kSecond_ns;
}

}  // namespace

struct Slam::Impl {
  HomeProcess home;
  SlamConfig config;
  log::SinkPtr sink;
  InputFormat format;
  std::function<void(const Result&)> on_result;
  std::optional<Gravity> floor;  // that is given
  FrameClock clock;
  std::optional<Timestamp> last_stamp;
  int fast_steps = 0;     // of stamps, one after the other
  int without_depth = 0;  // frames, until one has some
  bool saw_depth = false;
  bool publishes = true;  // false if deterministic: room() makes it
  bool finished = false;
  std::optional<Error> failure;  // of code 1: for every later call
  bool has_imu = false, has_wheels = false;
  MotionInbox<ImuSample> imu;
  MotionInbox<OdometrySample> wheels;
  PublishedMap published;  // before the session, whose threads write to it

  std::mutex mutex;  // of what follows, which push()'s thread uses as well
  Session session;
  std::shared_ptr<GivenMasks> given;
  std::unique_ptr<RunView> view;
  EventWatch events;
  StageTimes times_ms;  // of the last frame
  std::uint32_t next_frame = 0;
  bool room_is_stale = false;  // where it is not published, and after finish()
  bool plan_is_stale = false;

  std::unique_ptr<PushThread> pushed;  // last: its thread uses everything above

  ~Impl() {  // what ends may have something to say
    const log::ScopedSink scope(sink);
    pushed.reset();
    view.reset();
    session.runner.reset();
  }
  void open(const Settings& settings);
  void open_view(const std::string& address);
  void publish_from(SessionOptions& options, const Settings& settings);
  void warn_of_unit(Timestamp stamp);
  void warn_of_no_depth(const DepthImage& depth_m);
  [[nodiscard]] Input take(const Frame& frame, const char* call);
  [[nodiscard]] Result process(const Input& input);
  void push(const Frame& frame);
  void bring_room_up_to_date();
  void bring_plan_up_to_date();
  void reset();
  Outcome finish();

  // A call of the user's, unless there can be none any more.
  template <typename Work>
  auto call(const Work& work) {
    if (failure) throw *failure;
    try {
      return guarded(sink, [&] {
        if (pushed) pushed->rethrow();
        return work();
      });
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
    impl->sink = sink;
    impl->open(settings);
    return Slam(std::move(impl));
  });
}

Result Slam::process(const Frame& frame) {
  Impl& impl = alive(impl_, "process()");
  return impl.call([&] {
    if (impl.pushed) fail({ErrorKind::kUsage, "process() after push(): use one of both"});
    return impl.process(impl.take(frame, "process()"));
  });
}

void Slam::push(const Frame& frame) {
  Impl& impl = alive(impl_, "push()");
  impl.call([&] { impl.push(frame); });
}

void Slam::push_imu(const ImuReading& reading) {
  Impl& impl = alive(impl_, "push_imu()");
  if (!impl.has_imu) fail({ErrorKind::kUsage, "push_imu() without the imu of the settings"});
  if (is_too_far(reading.t_ns)) fail({ErrorKind::kInput, "IMU stamp too far from 0"});
  if (!is_finite(reading.angular_velocity_radps) || !is_finite(reading.specific_force_mps2))
    fail({ErrorKind::kInput, "IMU reading: not a number, or not finite"});
  const auto vector = [](const std::array<double, 3>& v) { return Vec3(v[0], v[1], v[2]); };
  impl.imu.put({{reading.t_ns},
                vector(reading.angular_velocity_radps),
                vector(reading.specific_force_mps2)});
}

void Slam::push_odometry(const OdometryReading& reading) {
  Impl& impl = alive(impl_, "push_odometry()");
  if (!impl.has_wheels)
    fail({ErrorKind::kUsage, "push_odometry() without the wheels of the settings"});
  if (is_too_far(reading.t_ns)) fail({ErrorKind::kInput, "odometry stamp too far from 0"});
  constexpr double kFarthest_m = 1e7;
  if (!is_pose(reading.T_odom_base) || !is_within(reading.T_odom_base, kFarthest_m))
    fail({ErrorKind::kInput, "odometry: at most 1e7 m and a unit quaternion are expected"});
  impl.wheels.put({{reading.t_ns}, to_se3(reading.T_odom_base, "T_odom_base")});
}

std::optional<Result> Slam::poll() {
  Impl& impl = alive(impl_, "poll()");
  return impl.call([&] { return impl.pushed ? impl.pushed->poll() : std::nullopt; });
}

std::optional<Pose> Slam::localise_now(const Frame& frame) {
  Impl& impl = alive(impl_, "localise_now()");
  return impl.call([&]() -> std::optional<Pose> {
    const Input input = read_input(frame, impl.format);
    std::unique_lock lock(impl.mutex);
    const Map map = impl.session.runner->map();
    lock.unlock();
    const auto place = place_in(map, *input.frame, *impl.session.camera, impl.config);
    return place ? std::optional(to_api(*place)) : std::nullopt;
  });
}

std::string Slam::view_url() const {
  const Impl& impl = alive(impl_, "view_url()");
  return impl.view ? impl.view->url() : std::string();
}

MapSnapshot Slam::map() {
  Impl& impl = alive(impl_, "map()");
  return impl.call([&] {
    impl.bring_room_up_to_date();
    return impl.published.map();
  });
}

Room Slam::room() {
  Impl& impl = alive(impl_, "room()");
  return impl.call([&] {
    impl.bring_room_up_to_date();
    return impl.published.room();
  });
}

std::shared_ptr<const OccupancyGrid> Slam::plan() {
  Impl& impl = alive(impl_, "plan()");
  return impl.call([&] {
    impl.bring_plan_up_to_date();
    return impl.published.plan();
  });
}

void Slam::save_map(const std::string& path) {
  Impl& impl = alive(impl_, "save_map()");
  impl.call([&] {
    const std::lock_guard lock(impl.mutex);
    const Status written = ygslam::save_map(path, impl.session.runner->map(), *impl.session.camera);
    if (!written.ok()) fail(written.error());
    impl.events.add(Event::kMapSaved);
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

void Slam::Impl::open(const Settings& settings) {
  SessionOptions options = session_options(settings);
  options.camera = to_config(settings.camera);
  options.config.run.shutter_source = shutter_source_of(settings.camera);
  if (settings.imu) options.config.imu = to_calibration(*settings.imu);
  has_imu = settings.imu.has_value();
  if (settings.wheels) options.config.wheels = to_calibration(*settings.wheels);
  has_wheels = settings.wheels.has_value();
  format = {options.camera, registration_of(settings, options.camera), options.config.depth,
            options.segmenter == SegmenterKind::kGiven};
  given = options.given;
  config = options.config;
  on_result = settings.on_result;
  floor = floor_of(settings);
  publish_from(options, settings);
  auto opened = open_session(std::move(options));
  if (!opened.ok()) fail(opened.error());
  session = std::move(opened).value();
  session.runner->add_sink([this](const FrameRecord& frame, const TrackResult&) {
    times_ms = {frame.mask_ms, frame.orb_ms, frame.motion_ms, frame.pose_ms};
  });
  published.show(session.runner->map());
  if (!settings.view.empty()) open_view(settings.view);
}

void Slam::Impl::open_view(const std::string& address) {
  auto server = parse_view_address(address);
  if (!server.ok()) fail(server.error());
  auto started =
      RunView::start({.server = *server, .camera = session.camera->config(), .driven = false});
  if (!started.ok()) fail(started.error());
  view = std::move(started).value();
}

/// The runner's threads show what they made, or, without threads, the caller's.
void Slam::Impl::publish_from(SessionOptions& options, const Settings& settings) {
  publishes = !settings.deterministic;
  options.map_sink = [this](const Map& map) { published.show(map); };
  if (!publishes) return;
  options.dense_sink = {[this](DenseMap& map) { published.show(make_room(map)); },
                        settings.room_every_s,
                        [this](DenseMap& map) { published.show(make_plan(map, floor)); }};
}

/// Stamps of a few frames that follow each other faster than any camera's are of another unit.
void Slam::Impl::warn_of_unit(Timestamp stamp) {
  constexpr std::int64_t kFastest_ns = 100'000;
  constexpr int kSeveral = 5;
  const bool is_fast = last_stamp && stamp.ns - last_stamp->ns < kFastest_ns;
  last_stamp = stamp;
  fast_steps = is_fast ? fast_steps + 1 : 0;
  if (fast_steps == kSeveral)
    log::warn("frames are less than 0.1 ms apart: are stamps in nanoseconds, as they are taken?");
}

/// The first frames have none that counts: mostly it is in another unit.
void Slam::Impl::warn_of_no_depth(const DepthImage& depth_m) {
  constexpr int kSeveral = 5;
  if (saw_depth) return;
  saw_depth = std::any_of(depth_m.begin(), depth_m.end(), [](float d) { return d > 0; });
  without_depth += saw_depth ? 0 : 1;
  if (without_depth == kSeveral)
    log::warn("{} frames without depth in range: is it in metres (float), or depth_scale right?",
              kSeveral);
}

/// In the caller's thread: what is wrong with a frame, it is told at once.
Input Slam::Impl::take(const Frame& frame, const char* call) {
  if (finished) fail({ErrorKind::kUsage, std::string(call) + " after finish()"});
  if (is_too_far(frame.t_ns) || is_too_far(frame.depth_t_ns))
    fail({ErrorKind::kInput, "frame stamp too far from 0"});
  if (frame.depth_t_ns != 0 && is_far_from(frame.depth_t_ns, frame.t_ns))
    fail({ErrorKind::kInput, "depth_t_ns is more than a second from t_ns"});
  Input input = read_input(frame, format);
  const FrameClock::Reading time = clock.step({frame.t_ns});
  if (!time.stamp) fail({ErrorKind::kInput, "frame stamps must increase"});
  if (time.was_set_back)
    log::warn("frame stamps went back and stay there: {:.3f} s are added to them from here on",
              1e-9 * static_cast<double>(clock.shift_ns()));
  warn_of_unit(*time.stamp);
  warn_of_no_depth(input.frame->depth_m);
  input.frame->stamp = *time.stamp;
  input.clock_shift_ns = clock.shift_ns();
  return input;
}

Result Slam::Impl::process(const Input& input) {
  const std::lock_guard lock(mutex);
  const ScopedTimer timer;
  input.frame->id = FrameId{next_frame++};
  if (input.masks) {
    input.masks->frame = input.frame->id;
    input.masks->stamp = input.frame->stamp;
    given->put(input.masks);
  }
  if (input.T_now_last) session.runner->expect_motion(*input.T_now_last);
  const auto hand_over = [&](auto samples) {
    for (auto& sample : samples) {
      sample.stamp.ns += input.clock_shift_ns;
      session.runner->add(sample);
    }
  };
  hand_over(imu.take());
  hand_over(wheels.take());
  const TrackResult tracked = session.runner->process(input.frame);
  if (view) {
    view->show(input.frame, tracked);
    view->show_map(*session.runner);
  }
  room_is_stale = plan_is_stale = !publishes;
  Result result = to_api(tracked);
  result.events = events.step(tracked, session.runner->closed_loops());
  result.t_ns = input.frame->stamp.ns - input.clock_shift_ns;
  result.clock_shift_ns = input.clock_shift_ns;
  result.times_ms = times_ms;
  result.times_ms.all = timer.wall_ms();
  return result;
}

void Slam::Impl::push(const Frame& frame) {
  Input input = take(frame, "push()");
  if (!pushed)
    pushed = std::make_unique<PushThread>(
        [this](const Input& waited) { return guarded(sink, [&] { return process(waited); }); },
        on_result);
  pushed->put(std::move(input));
}

void Slam::Impl::bring_room_up_to_date() {
  if (publishes && !finished) return;  // waits for nobody
  const std::lock_guard lock(mutex);
  if (!std::exchange(room_is_stale, false)) return;
  session.runner->inspect_dense([this](DenseMap& map) { published.show(make_room(map)); });
}

void Slam::Impl::bring_plan_up_to_date() {
  if (publishes && !finished) return;  // waits for nobody
  const std::lock_guard lock(mutex);
  if (!std::exchange(plan_is_stale, false)) return;
  session.runner->inspect_dense([this](DenseMap& map) { published.show(make_plan(map, floor)); });
}

void Slam::Impl::reset() {
  if (finished) fail({ErrorKind::kUsage, "reset() after finish()"});
  if (pushed) pushed->clear();
  const std::lock_guard lock(mutex);
  session.runner->reset();
  published.forget_room();
  published.show(session.runner->map());
  room_is_stale = plan_is_stale = false;
  events.restart();
  clock.restart();
  if (view) view->restart();
}

Outcome Slam::Impl::finish() {
  if (pushed) {
    pushed->finish();
    pushed->rethrow();
  }
  const std::lock_guard lock(mutex);
  const bool was_finished = std::exchange(finished, true);
  const SlamOutcome& outcome = session.runner->finish();
  if (view && !was_finished) view->finish(session.runner.get());
  if (!was_finished) published.show(session.runner->map());
  room_is_stale = room_is_stale || !was_finished;
  plan_is_stale = plan_is_stale || !was_finished;
  Outcome result;
  for (const ygslam::StampedPose& pose :
       final_trajectory(outcome.trajectory, outcome.revised, session.runner->map()))
    result.trajectory.push_back({pose.stamp.ns, to_api(pose.T_world_camera)});
  result.static_map = to_api(session.runner->cloud());
  return result;
}

}  // namespace ygslam::api
