#include "live/run_view.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include "core/trace.hpp"

namespace ygslam {
namespace {

constexpr std::array kServices = {"pause",  "resume", "step",  "slower",
                                  "faster", "save",   "reset", "stop"};
constexpr auto kMapEvery = std::chrono::seconds(1);
constexpr auto kMeshEvery = std::chrono::seconds(2);
constexpr auto kPictureEvery = std::chrono::milliseconds(50);  // on average: most of what it costs
constexpr auto kHistoryEvery = std::chrono::seconds(5);
constexpr int kMapShare = 20;  // showing the map takes at most one part in so many of the time
constexpr int kMeshNice = 10;  // of the thread that draws the mesh: the run goes first
constexpr std::size_t kMostPoints = 100'000;
constexpr std::size_t kMostPointsAtEnd = 1'000'000;
constexpr double kFastest = 8;  // beyond: as fast as it goes
constexpr double kSlowest = 1.0 / 16;
constexpr auto kLookUp = std::chrono::milliseconds(100);  // for a signal, which wakes nobody

std::chrono::microseconds milliseconds(double ms) {
  return std::chrono::microseconds(static_cast<std::int64_t>(1000 * ms));
}

ros::DiagnosticArray paused_message() {
  ros::DiagnosticStatus status;
  status.name = "ygslam: tracking";
  status.hardware_id = "camera";
  status.message = "paused before the first frame";
  return {{}, {std::move(status)}};
}

}  // namespace

/// Messages that go out together, when it is done with.
class RunView::Batch : public MessageSink {
 public:
  explicit Batch(RunView& view, bool has_picture = true) : view_(view), has_picture_(has_picture) {}
  ~Batch() override {
    if (!messages_.empty()) view_.server_->publish(std::move(messages_));
  }
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;

  /// Somebody else puts this one.
  void withhold(std::string_view topic) { withheld_ = topic; }
  [[nodiscard]] bool wants(std::string_view topic) const override {
    if (topic == withheld_) return false;
    if (!has_picture_ && is_picture(topic)) return false;
    return view_.has_ended_ || view_.server_->wants(topic);
  }
  void put(std::string_view topic, const char* /*type*/, Timestamp stamp, Bytes cdr,
           std::uint32_t part) override {
    messages_.push_back({topic, stamp, std::move(cdr), part});
  }

 private:
  static bool is_picture(std::string_view topic) {
    return topic == "/camera/image/compressed" || topic == "/camera/annotations";
  }

  RunView& view_;
  bool has_picture_;
  std::string_view withheld_;
  std::vector<ViewServer::Message> messages_;
};

Result<std::unique_ptr<RunView>> RunView::start(const RunViewConfig& config) {
  std::unique_ptr<RunView> view(new RunView(config));
  const std::span<const Topic> topics(kRunTopics);
  const bool has_mesh = config.map != RunViewConfig::Map::kNone;
  auto server = ViewServer::start(
      config.server, topics.first(topics.size() - (has_mesh ? 0 : kMeshTopics)), kServices,
      {[v = view.get()](std::string_view service) { return v->drive(service); },
       [v = view.get()] { v->subscribed(); }});
  if (!server.ok()) return server.error();
  view->server_ = std::move(server).value();
  view->thread_.emplace([v = view.get()](const std::stop_token& stop) {
    trace::name_thread("page");
    while (const auto update = v->updates_.pop(stop)) v->publish(*update);
  });
  view->mesh_thread_.emplace([v = view.get()](const std::stop_token& stop) {
    trace::name_thread("page mesh");
    static_cast<void>(::setpriority(PRIO_PROCESS, 0, kMeshNice));  // of this thread alone, on Linux
    while (auto update = v->meshes_.pop(stop)) v->publish_mesh(std::move(*update));
  });
  return view;
}

RunView::~RunView() {
  for (auto* thread : {&thread_, &mesh_thread_})
    if (*thread) (*thread)->request_stop();
  updates_.close();
  meshes_.close();
  thread_.reset();
  mesh_thread_.reset();
  server_.reset();  // its thread calls into this object
}

void RunView::show(const FramePtr& frame, const TrackResult& result) {
  now_ = frame->stamp;
  Update update{frame, std::make_shared<const TrackResult>(result)};
  const std::lock_guard lock(mutex_);
  history_.add(*frame, result);
  if (server_->clients() > 0) updates_.push(update);
  last_ = std::move(update);
}

/// Who comes while the run is paused sees the last frame, too.
void RunView::subscribed() {
  const std::lock_guard lock(mutex_);
  map_wanted_ = history_wanted_ = true;
  updates_.push(last_);
  changed_.notify_all();
}

void RunView::tell_state() {
  Update state = last_;
  state.is_state_alone = true;
  if (updates_.size() == 0) updates_.push(std::move(state));  // else what waits there tells it
}

bool RunView::is_paused() {
  const std::lock_guard lock(mutex_);
  return is_paused_;
}

void RunView::show_map(Runner& runner) {
  const auto before = Clock::now();
  Batch batch(*this);
  if (before < map_due_ || !wants_map(batch)) return;
  const trace::Span span("map for the page");
  publish_map(runner, now_, kMostPoints, batch);
  if (before >= mesh_due_ && MeshTopics::wanted(batch)) {
    meshes_.push({MeshTopics::take(runner), now_});
    mesh_due_ =
        before + std::max<Clock::duration>(kMeshEvery, kMapShare * milliseconds(mesh_took_ms_));
  }
  const auto after = Clock::now();
  map_due_ = after + std::max<Clock::duration>(kMapEvery, kMapShare * (after - before));
}

void RunView::publish_mesh(MeshUpdate update) {
  const trace::Span span("publish mesh");
  const ScopedTimer timer;
  Batch batch(*this);
  mesh_topics_.publish(std::move(update.mesh), update.stamp, MeshTopics::Extent::kTiles, batch);
  mesh_took_ms_ = timer.cpu_ms();
}

void RunView::show_cloud(const std::function<std::vector<ColouredPoint>()>& make) {
  const auto before = Clock::now();
  Batch batch(*this);
  const bool is_late = before >= map_due_ || is_paused();  // paused, no later one makes up for it
  if (!is_late || !batch.wants("/cloud")) return;
  batch.put("/cloud", ros::PointCloud2::kType, now_,
            to_cdr(cloud_message(make(), kMostPoints, now_)), 0);
  map_due_ = before + kMapEvery;
}

bool RunView::is_picture_due() {
  const auto now = Clock::now();
  if (now < picture_due_) return false;
  picture_due_ = std::max(picture_due_, now - kPictureEvery) + kPictureEvery;
  return true;
}

/// Who listens adds the frames since then: it need not come often.
void RunView::publish_history(Batch& batch, Timestamp stamp, bool is_told_now) {
  if (!batch.wants("/history")) return;
  RunHistory history;
  {
    const std::lock_guard lock(mutex_);
    if (!std::exchange(history_wanted_, false) && !is_told_now && Clock::now() < history_due_)
      return;
    history = history_;
  }
  history_due_ = Clock::now() + kHistoryEvery;
  batch.put("/history", ros::PointCloud2::kType, stamp, to_cdr(history.message(stamp)), 0);
}

void RunView::publish(const Update& update) {
  const trace::Span span("publish");
  const bool paused = is_paused();
  Batch batch(*this, paused || has_ended_ || is_picture_due());
  publish_history(batch, update.frame ? update.frame->stamp : Timestamp{},
                  paused || has_ended_ || !update.frame);
  if (!update.frame) {
    if (!paused || !batch.wants("/state")) return;
    ros::DiagnosticArray state = paused_message();
    state.status.push_back(drive_status());
    return batch.put("/state", ros::DiagnosticArray::kType, {}, to_cdr(state), 0);
  }
  batch.withhold("/state");  // more is said of it here
  if (!update.is_state_alone) publish_frame(*update.frame, *update.result, config_.camera, batch);
  batch.withhold({});
  if (!batch.wants("/state")) return;
  ros::DiagnosticArray state = state_message(*update.frame, *update.result);
  ros::DiagnosticStatus& status = state.status[0];
  if (has_ended_) {
    status.message = "the run has ended";
    status.level = ros::DiagnosticStatus::kOk;
  } else if (paused) {
    status.message = "paused; " + status.message;
  }
  status.values.push_back({"missed frames", std::to_string(missed_)});
  state.status.push_back(drive_status());
  batch.put("/state", ros::DiagnosticArray::kType, update.frame->stamp, to_cdr(state), 0);
}

void RunView::finish(Runner* runner) {
  has_ended_ = true;
  if (runner) {
    Batch batch(*this);
    NamedMesh mesh = MeshTopics::take(*runner);
    publish_map(*runner, now_, kMostPointsAtEnd, batch, &mesh);
    meshes_.push({std::move(mesh), now_});
  }
  const std::lock_guard lock(mutex_);
  if (last_.frame) updates_.push(last_);
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
  meshes_.push({{}, now_});
  const std::lock_guard lock(mutex_);
  map_wanted_ = history_wanted_ = true;
  history_.clear();
  last_ = {};
  last_stamp_.reset();
  missed_ = 0;
  updates_.push(last_);
}

RunView::Wishes RunView::wait_turn(Timestamp stamp, Runner* runner,
                                   const std::function<bool()>& interrupted) {
  const trace::Span span("the page's turn", trace::Kind::kWait);
  std::unique_lock lock(mutex_);
  const auto is_wished = [&] { return wishes_.stop || wishes_.save || wishes_.reset; };
  while (!is_due(stamp) && !is_wished() && !interrupted()) {
    if (std::exchange(map_wanted_, false)) {
      map_due_ = mesh_due_ = {};
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

std::string RunView::refusal(std::string_view service) const {
  using Maps = RunViewConfig::Map;
  if (!config_.driven) return "only the program itself drives this run";
  if (has_ended_ && service != "stop") return "the run has ended";
  if ((service == "slower" || service == "faster") && config_.paced)
    return "the input comes at its own pace";
  if (service == "save" && config_.map != Maps::kSaves) return "this run keeps no map (--save-map)";
  if (service == "reset" && config_.map == Maps::kNone) return "here is no map to begin anew";
  if (service == "reset" && config_.map == Maps::kSaves)
    return "this run keeps a map file: start another run";
  return {};
}

std::string RunView::speed_text() const {
  if (config_.paced) return "live";
  return speed_ == 0 ? "max" : fmt::format("{:g} x", speed_);
}

/// What those who drive may do now, so that a page offers nothing else.
ros::DiagnosticStatus RunView::drive_status() {
  const std::lock_guard lock(mutex_);
  ros::DiagnosticStatus status;
  status.name = "ygslam: drive";
  status.hardware_id = "run";
  status.message = is_paused_ ? "paused" : "runs";
  const bool goes_on = !is_paused_ || has_ended_;
  status.values = {{"goes on", goes_on ? "true" : "false"}, {"speed", speed_text()}};
  for (const char* service : kServices) status.values.push_back({service, refusal(service)});
  return status;
}

Result<std::string> RunView::drive(std::string_view service) {
  const std::lock_guard lock(mutex_);
  changed_.notify_all();
  if (std::string refused = refusal(service); !refused.empty())
    return Error{ErrorKind::kUsage, std::move(refused)};
  if (service == "pause" || service == "resume") {
    is_paused_ = service == "pause";
    map_wanted_ |= is_paused_;  // as of the frame that is looked at
    tell_state();
    return std::string(is_paused_ ? "paused" : "goes on");
  }
  if (service == "step") {
    is_paused_ = step_ = true;
    tell_state();
    return std::string("a frame, then paused");
  }
  if (service == "slower" || service == "faster") {
    if (service == "slower") {
      speed_ = speed_ == 0 ? 1 : std::max(kSlowest, speed_ / 2);
    } else if (speed_ > 0) {
      speed_ = speed_ >= kFastest ? 0 : speed_ * 2;
    }
    tell_state();
    return speed_ == 0 ? std::string("as fast as it goes")
                       : fmt::format("{:g} times real time", speed_);
  }
  if (service == "save") {
    wishes_.save = true;
    return std::string("the map will be saved");
  }
  if (service == "reset") {
    wishes_.reset = true;
    return std::string("map and trajectory begin anew");
  }
  wishes_.stop = true;
  stop_.request_stop();
  return std::string("the run ends and writes its files");
}

}  // namespace ygslam
