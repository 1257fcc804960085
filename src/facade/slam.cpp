// The public facade (include/ygslam/slam.hpp) over a session.
#include <algorithm>
#include <limits>
#include <optional>
#include <span>

#include "core/frame_clock.hpp"
#include "core/log.hpp"
#include "facade/convert.hpp"
#include "facade/event_watch.hpp"
#include "facade/published_map.hpp"
#include "facade/settings.hpp"
#include "image/depth.hpp"
#include "io/image_file.hpp"
#include "live/run_view.hpp"
#include "map_file/map_file.hpp"
#include "system/run_writer.hpp"

namespace ygslam::api {
namespace {

bool is_too_far(std::int64_t t_ns) {
  return t_ns > FrameClock::kLatest_ns || t_ns < -FrameClock::kLatest_ns;
}

}  // namespace

struct Slam::Impl {
  HomeProcess home;
  SlamConfig config;
  log::SinkPtr sink;
  PublishedMap published;  // before the session, whose threads write to it
  Session session;
  std::unique_ptr<RunView> view;
  FrameClock clock;
  EventWatch events;
  std::uint32_t next_frame = 0;
  bool publishes = true;       // false if deterministic: room() makes it
  bool room_is_stale = false;  // then, and after finish()
  bool finished = false;
  std::optional<Error> failure;  // of code 1: for every later call

  ~Impl() {  // what ends may have something to say
    const log::ScopedSink scope(sink);
    view.reset();
    session.runner.reset();
  }
  void open_view(const std::string& address);
  Result process(const Frame& frame);
  void publish_from(SessionOptions& options, const Settings& settings);
  void bring_room_up_to_date();
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
    impl->publish_from(options, settings);
    auto session = open_session(std::move(options));
    if (!session.ok()) fail(session.error());
    impl->session = std::move(session).value();
    impl->published.show(impl->session.runner->map());
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

void Slam::save_map(const std::string& path) {
  Session& session = alive(impl_, "save_map()").session;
  impl_->call([&] {
    const Status written = ygslam::save_map(path, session.runner->map(), *session.camera);
    if (!written.ok()) fail(written.error());
    impl_->events.add(Event::kMapSaved);
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
  room_is_stale = !publishes;
  Result result = to_api(tracked);
  result.events = events.step(tracked, session.runner->closed_loops());
  result.clock_shift_ns = clock.shift_ns();
  return result;
}

/// The runner's threads show what they made, or, without threads, the caller's.
void Slam::Impl::publish_from(SessionOptions& options, const Settings& settings) {
  publishes = !settings.deterministic;
  options.map_sink = [this](const Map& map) { published.show(map); };
  if (!publishes) return;
  options.dense_sink = {[this](DenseMap& map) { published.show(make_room(map)); },
                        settings.room_every_s};
}

void Slam::Impl::bring_room_up_to_date() {
  if (!std::exchange(room_is_stale, false)) return;
  session.runner->inspect_dense([this](DenseMap& map) { published.show(make_room(map)); });
}

void Slam::Impl::reset() {
  if (finished) fail({ErrorKind::kUsage, "reset() after finish()"});
  session.runner->reset();
  published.forget_room();
  published.show(session.runner->map());
  room_is_stale = false;
  events.restart();
  clock.restart();
  if (view) view->restart();
}

Outcome Slam::Impl::finish() {
  const bool was_finished = std::exchange(finished, true);
  const SlamOutcome& outcome = session.runner->finish();
  if (view && !was_finished) view->finish(session.runner.get());
  if (!was_finished) published.show(session.runner->map());
  room_is_stale = room_is_stale || !was_finished;
  Outcome result;
  for (const ygslam::StampedPose& pose :
       final_trajectory(outcome.trajectory, outcome.revised, session.runner->map()))
    result.trajectory.push_back({pose.stamp.ns, to_api(pose.T_world_camera)});
  result.static_map = to_api(session.runner->cloud());
  return result;
}

}  // namespace ygslam::api
