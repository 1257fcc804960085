#include "system/map_thread.hpp"

#include "core/trace.hpp"

namespace ygslam {
namespace {

constexpr std::chrono::milliseconds kOwedAgain{200};  // the dense map is asked whether it has room

}  // namespace

MapThread::MapThread(MappingStage stage, const Camera& camera, const BundleConfig& bundle,
                     const DenseMapConfig& dense, MapSink sink, DenseSink dense_sink)
    : stage_(std::move(stage)),
      view_(stage_.view()),
      sink_(std::move(sink)),
      adjustment_(camera, bundle),
      dense_(dense, camera, std::move(dense_sink)),
      thread_([this](const std::stop_token& stop) { loop(stop); },
              [this] {
                queue_.close();
                while (queue_.try_pop()) {  // whoever waits for an inspection gives up
                }
              }) {}

MapThread::~MapThread() {
  thread_.request_stop();
  queue_.close();
}

void MapThread::put(KeyframeMessage message) {
  ++waiting_keyframes_;
  urgent_.store(true);
  queue_.push(std::move(message));
}

void MapThread::put(PlaceRequest request) {
  if (!place_request_waits_.exchange(true)) queue_.push(std::move(request));
}

void MapThread::inspect(const std::function<void(const MappingStage&)>& look) {
  if (!thread_.joinable()) return look(stage_);
  Inspection inspection{&look, {}};
  std::future<void> done = inspection.done.get_future();
  const trace::Span span("the mapping thread", trace::Kind::kWait);
  try {
    queue_.push(std::move(inspection));
    done.get();
  } catch (const std::future_error&) {
    thread_.rethrow();
    throw;
  }
}

void MapThread::join(const std::atomic<bool>* abort) {
  queue_.close();
  thread_.join();
  thread_.rethrow();
  adjustment_.finish(abort);
  take_adjustment();
}

void MapThread::loop(const std::stop_token& stop) {
  trace::name_thread("mapping");
  while (true) {
    auto message = owes_dense_
                       ? queue_.pop_until(std::chrono::steady_clock::now() + kOwedAgain, stop)
                       : queue_.pop(stop);
    if (message) {
      std::visit([this](auto& m) { take(m); }, *message);
      take_adjustment();
    } else if (!owes_dense_ || stop.stop_requested() || queue_.is_drained()) {
      return;
    }
    if (owes_dense_) tell_dense();
  }
}

bool MapThread::close_loops() {
  if (!stage_.close_loops()) return false;
  adjustment_.start(stage_.full_adjustment());
  return true;
}

void MapThread::publish() {
  const trace::Span span("publish");
  closed_loops_.store(stage_.closed_loops());
  view_.store(stage_.view());
  tell_dense();
  if (sink_) sink_(stage_.map());
}

// What it cannot take now is kept: the map waits for nobody.
void MapThread::tell_dense() {
  owes_dense_ = dense_.is_full();
  if (!owes_dense_) dense_.apply(stage_.take_dense_update());
}

void MapThread::finish_dense() {
  dense_.apply(stage_.take_dense_update());
  dense_.finish();
}

void MapThread::take_adjustment() {
  const auto patch = adjustment_.take_result();
  if (!patch) return;
  stage_.correct(*patch);
  publish();
}

void MapThread::take(const KeyframeMessage& message) {
  const trace::Span span("map keyframe", message.candidate.frame->id);
  const ScopedTimer timer;
  stage_.insert(message);
  view_.store(stage_.view());
  if (--waiting_keyframes_ == 0) {
    urgent_.store(false);
    if (waiting_keyframes_.load() > 0) urgent_.store(true);  // one came in between
    stage_.refine(&urgent_);
    close_loops();
    publish();
  }
  times_.add(timer);
}

void MapThread::take(const SegmentationPtr& masks) {
  const trace::Span span("masks", masks->frame);
  bool changed = stage_.apply(*masks);
  if (waiting_keyframes_.load() == 0) changed |= close_loops();
  if (changed) {
    publish();
  } else if (stage_.has_dense_frames()) {
    tell_dense();
  }
}

void MapThread::take(const MapPatch& patch) {
  const trace::Span span("correct map");
  stage_.correct(patch);
  publish();
}

void MapThread::take(const ShutterReport& report) {
  const trace::Span span("correct shutter");
  adjustment_.give_up();  // it goes by the pixels of before
  stage_.correct_shutter(report);
  publish();
}

void MapThread::take(const ImuRetraction& retraction) {
  // An adjustment that is on its way goes by what is forgotten.
  if (stage_.forget_imu(retraction) && adjustment_.is_pending())
    adjustment_.start(stage_.full_adjustment());
}

void MapThread::take(const PixelMaskPtr& ego_mask) {
  if (stage_.forget_pixels(*ego_mask)) publish();
}

void MapThread::take(KeyframeId focus) {
  stage_.look_around(focus);
  view_.store(stage_.view());
}

void MapThread::take(const PlaceRequest& request) {
  const trace::Span span("place search");
  place_request_waits_.store(false);
  const auto& [features, static_weight, pose] = request;
  if (!pose) {
    if (stage_.look_for(*features, static_weight)) view_.store(stage_.view());
  } else if (stage_.look_for(*features, static_weight, *pose)) {
    adjustment_.start(stage_.full_adjustment());
    publish();
  }
}

void MapThread::take(Inspection& inspection) {
  (*inspection.look)(stage_);
  inspection.done.set_value();
}

}  // namespace ygslam
