#include "live/run_view.hpp"

#include <fmt/format.h>

namespace ygslam {
namespace {

constexpr std::array kServices = {"pause",  "resume", "step",  "slower",
                                  "faster", "save",   "reset", "stop"};
constexpr auto kMapEvery = std::chrono::seconds(1);
constexpr int kMapShare = 20;  // showing the map takes at most one part in so many of the time
constexpr std::size_t kMostPoints = 100'000;
constexpr std::size_t kMostPointsAtEnd = 1'000'000;
constexpr double kFastest = 8;  // beyond: as fast as it goes
constexpr double kSlowest = 1.0 / 16;
constexpr auto kLookUp = std::chrono::milliseconds(100);  // for a signal, which wakes nobody

}  // namespace

/// Messages that go out together, when it is done with.
class RunView::Batch : public MessageSink {
 public:
  explicit Batch(RunView& view) : view_(view) {}
  ~Batch() override {
    if (!messages_.empty()) view_.server_->publish(std::move(messages_));
  }
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;

  [[nodiscard]] bool wants(std::string_view topic) const override {
    return view_.has_ended_ || view_.server_->wants(topic);
  }
  void put(std::string_view topic, const char* /*type*/, Timestamp stamp, Bytes cdr) override {
    messages_.push_back({topic, stamp, std::move(cdr)});
  }

 private:
  RunView& view_;
  std::vector<ViewServer::Message> messages_;
};

Result<std::unique_ptr<RunView>> RunView::start(const RunViewConfig& config) {
  std::unique_ptr<RunView> view(new RunView(config));
  auto server =
      ViewServer::start(config.server, kRunTopics, kServices,
                        {[v = view.get()](std::string_view service) { return v->drive(service); },
                         [v = view.get()] { v->subscribed(); }});
  if (!server.ok()) return server.error();
  view->server_ = std::move(server).value();
  view->thread_.emplace([v = view.get()](const std::stop_token& stop) {
    while (const auto sight = v->sights_.pop(stop)) v->publish(*sight);
  });
  return view;
}

RunView::~RunView() {
  if (thread_) thread_->request_stop();
  sights_.close();
  thread_.reset();
  server_.reset();  // its thread calls into this object
}

void RunView::show(const FramePtr& frame, const TrackResult& result) {
  now_ = frame->stamp;
  Sight sight{frame, std::make_shared<const TrackResult>(result)};
  if (server_->clients() > 0) sights_.push(sight);
  const std::lock_guard lock(mutex_);
  last_ = std::move(sight);
}

/// Who comes while the run is paused sees the last frame, too.
void RunView::subscribed() {
  Sight last;
  {
    const std::lock_guard lock(mutex_);
    map_wanted_ = true;
    last = last_;
  }
  changed_.notify_all();
  if (last.frame) sights_.push(std::move(last));
}

void RunView::show_map(Runner& runner) {
  const auto before = Clock::now();
  if (Batch batch(*this); before >= map_due_ && wants_map(batch)) {
    publish_map(runner, now_, kMostPoints, batch);
  } else {
    return;
  }
  const auto after = Clock::now();
  map_due_ = after + std::max<Clock::duration>(kMapEvery, kMapShare * (after - before));
}

void RunView::show_cloud(const std::function<std::vector<ColouredPoint>()>& make) {
  const auto before = Clock::now();
  Batch batch(*this);
  if (before < map_due_ || !batch.wants("/cloud")) return;
  batch.put("/cloud", ros::PointCloud2::kType, now_,
            to_cdr(cloud_message(make(), kMostPoints, now_)));
  map_due_ = before + kMapEvery;
}

void RunView::publish(const Sight& sight) {
  Batch batch(*this);
  publish_frame(*sight.frame, *sight.result, config_.camera, batch);
  if (!has_ended_) return;
  ros::DiagnosticArray state = state_message(*sight.frame, *sight.result);
  state.status[0].message = "the run has ended";
  state.status[0].level = ros::DiagnosticStatus::kOk;
  batch.put("/state", ros::DiagnosticArray::kType, sight.frame->stamp, to_cdr(state));
}

void RunView::finish(Runner* runner) {
  has_ended_ = true;
  if (runner) {
    Batch batch(*this);
    publish_map(*runner, now_, kMostPointsAtEnd, batch);
  }
  const std::lock_guard lock(mutex_);
  if (last_.frame) sights_.push(last_);
}

void RunView::stay(const std::function<bool()>& interrupted) {
  std::unique_lock lock(mutex_);
  while (!wishes_.stop && !interrupted()) changed_.wait_for(lock, kLookUp);
}

bool RunView::is_due(Timestamp stamp) const {
  if (is_paused_) return step_;
  if (speed_ == 0 || !last_stamp_) return true;
  const double wait_s = seconds_between(stamp, *last_stamp_) / speed_;
  return std::chrono::duration<double>(Clock::now() - last_turn_).count() >= wait_s;
}

void RunView::restart() {
  const std::lock_guard lock(mutex_);
  map_wanted_ = true;
  last_ = {};
  last_stamp_.reset();
}

RunView::Wishes RunView::wait_turn(Timestamp stamp, Runner* runner,
                                   const std::function<bool()>& interrupted) {
  std::unique_lock lock(mutex_);
  const auto is_wished = [&] { return wishes_.stop || wishes_.save || wishes_.reset; };
  while (!is_due(stamp) && !is_wished() && !interrupted()) {
    if (std::exchange(map_wanted_, false)) {
      map_due_ = {};
      if (!runner) continue;
      lock.unlock();
      show_map(*runner);
      lock.lock();
      continue;  // somebody may have driven meanwhile
    }
    auto wake = Clock::now() + kLookUp;
    if (!is_paused_ && last_stamp_)
      wake = std::min(wake, last_turn_ + std::chrono::duration_cast<Clock::duration>(
                                             std::chrono::duration<double>(
                                                 seconds_between(stamp, *last_stamp_) / speed_)));
    changed_.wait_until(lock, wake);
  }
  wishes_.go = is_due(stamp);
  if (wishes_.go) {
    step_ = false;
    last_stamp_ = stamp;
    last_turn_ = Clock::now();
  }
  return std::exchange(wishes_, {});
}

Result<std::string> RunView::drive(std::string_view service) {
  const std::lock_guard lock(mutex_);
  changed_.notify_all();
  if (!config_.driven) return Error{ErrorKind::kUsage, "only the program itself drives this run"};
  if (has_ended_ && service != "stop") return Error{ErrorKind::kUsage, "the run has ended"};
  if (service == "pause" || service == "resume") {
    is_paused_ = service == "pause";
    return std::string(is_paused_ ? "paused" : "goes on");
  }
  if (service == "step") {
    is_paused_ = step_ = true;
    return std::string("a frame, then paused");
  }
  if (service == "slower" || service == "faster") {
    if (config_.paced) return Error{ErrorKind::kUsage, "the input comes at its own pace"};
    if (service == "slower") {
      speed_ = speed_ == 0 ? kFastest : std::max(kSlowest, speed_ / 2);
    } else if (speed_ > 0) {
      speed_ = speed_ >= kFastest ? 0 : speed_ * 2;
    }
    return speed_ == 0 ? std::string("as fast as it goes")
                       : fmt::format("{:g} times real time", speed_);
  }
  if (service == "save") {
    if (config_.map != RunViewConfig::Map::kSaves)
      return Error{ErrorKind::kUsage, "this run keeps no map (--save-map)"};
    wishes_.save = true;
    return std::string("the map will be saved");
  }
  if (service == "reset") {
    if (config_.map == RunViewConfig::Map::kNone)
      return Error{ErrorKind::kUsage, "here is no map to begin anew"};
    if (config_.map == RunViewConfig::Map::kSaves)
      return Error{ErrorKind::kUsage, "this run keeps a map file: start another run"};
    wishes_.reset = true;
    return std::string("map and trajectory begin anew");
  }
  wishes_.stop = true;
  stop_.request_stop();
  return std::string("the run ends and writes its files");
}

}  // namespace ygslam
