#include "io/frame_reader.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/counted.hpp"
#include "core/log.hpp"
#include "core/trace.hpp"
#include "io/frame_stream.hpp"

namespace ygslam {
namespace {

std::size_t count_offered(const Sequence& sequence, const FrameReaderConfig& config) {
  CHECK(config.stride >= 1 && config.ahead >= 1 && config.realtime_waiting >= 1);
  const std::size_t end =
      std::min(config.to.value_or(sequence.pairs.size()), sequence.pairs.size());
  return config.from >= end ? 0 : (end - config.from - 1) / config.stride + 1;
}

}  // namespace

FrameReader::FrameReader(Sequence sequence, const FrameReaderConfig& config)
    : sequence_(std::move(sequence)),
      config_(config),
      offered_(count_offered(sequence_, config)),
      queue_(config.realtime ? config.realtime_waiting : config.ahead,
             config.realtime ? FrameQueue::When::kFullDrops : FrameQueue::When::kFullWaits),
      thread_([this](const std::stop_token& stop) { run(stop); }, [this] { queue_.close(); }) {}

FrameReader::~FrameReader() { stop(); }

void FrameReader::stop() {
  thread_.request_stop();
  queue_.close();
}

void FrameReader::pause() {
  const std::lock_guard lock(mutex_);
  if (!paused_since_) paused_since_ = Clock::now();
}

void FrameReader::resume() {
  {
    const std::lock_guard lock(mutex_);
    if (paused_since_) paused_ += Clock::now() - *std::exchange(paused_since_, std::nullopt);
  }
  wake_.notify_all();
}

bool FrameReader::is_paused() const {
  const std::lock_guard lock(mutex_);
  return paused_since_.has_value();
}

std::optional<FramePtr> FrameReader::next(const std::stop_token& stop) {
  while (auto offered = next_offered(stop))
    if (offered->frame) return std::move(offered->frame);
  return std::nullopt;
}

std::optional<OfferedFrame> FrameReader::next_offered(const std::stop_token& stop) {
  {
    const std::lock_guard lock(mutex_);
    consumer_started_ = consumer_asks_ = true;
  }
  wake_.notify_all();
  if (thread_.stop_requested()) return std::nullopt;
  auto offered = queue_.pop(stop);
  if (!offered) thread_.rethrow();
  const std::lock_guard lock(mutex_);
  consumer_asks_ = false;
  counts_.readable += offered && offered->frame ? 1 : 0;
  return offered;
}

FrameReaderCounts FrameReader::counts() const {
  const std::lock_guard lock(mutex_);
  FrameReaderCounts counts = counts_;
  if (!sequence_.stream) counts.offered = offered_;
  const StreamCounts of_stream = sequence_.stream ? sequence_.stream->counts() : StreamCounts{};
  counts.without_depth = sequence_.without_depth + of_stream.without_depth;
  counts.left_out = sequence_.counts.left_out() + of_stream.left_out;
  counts.dropped = queue_.dropped();
  counts.readable += counts.dropped;
  return counts;
}

void FrameReader::run(const std::stop_token& stop) {
  trace::name_thread("reading");
  bool in_burst = false;
  {
    const std::lock_guard lock(mutex_);
    for (const SkippedImage& image : sequence_.absent) skip(image);
  }
  for (std::size_t i = 0; !stop.stop_requested(); ++i) {
    auto pair = sequence_.stream ? load_next(i, stop) : load(i);
    if (!pair) break;
    note(*pair, in_burst);
    OfferedFrame offered{FrameId{static_cast<std::uint32_t>(i)}, pair->stamp};
    if (pair->frame) {
      offered.frame = std::make_shared<const RgbdFrame>(std::move(*pair->frame));
      const bool is_paced = config_.realtime && !sequence_.stream;
      if (is_paced && !wait_for_stamp(offered.stamp, stop)) break;
    }
    if (!queue_.push(std::move(offered), is_paused())) break;
  }
}

std::optional<LoadedPair> FrameReader::load(std::size_t i) {
  if (i >= offered_) return std::nullopt;
  const FrameId id{static_cast<std::uint32_t>(i)};
  const trace::Span span("read", id);
  return load_pair(sequence_, config_.from + i * config_.stride, id, config_.depth);
}

std::optional<LoadedPair> FrameReader::load_next(std::size_t i, const std::stop_token& stop) {
  if (config_.to && config_.from + i * config_.stride >= *config_.to) return std::nullopt;
  const std::size_t passed_over = i == 0 ? config_.from : config_.stride - 1;
  for (std::size_t k = 0; k < passed_over; ++k)
    if (!sequence_.stream->skip(stop)) return std::nullopt;
  const trace::Span span("read stream", FrameId{static_cast<std::uint32_t>(i)});
  auto pair = sequence_.stream->next(FrameId{static_cast<std::uint32_t>(i)}, config_.depth, stop);
  const std::lock_guard lock(mutex_);
  counts_.offered += pair ? 1 : 0;
  return pair;
}

// Counts what could not be used; one warning per run of bad pairs, of very many such runs of some.
void FrameReader::note(LoadedPair& pair, bool& in_burst) {
  const bool bad = !pair.frame.has_value();
  const bool begins_burst = bad && !in_burst;
  in_burst = bad;
  const SkippedImage first = begins_burst ? pair.bad.front() : SkippedImage{};
  std::uint64_t bursts = 0;
  {
    const std::lock_guard lock(mutex_);
    bursts = counts_.bursts += begins_burst ? 1 : 0;
    for (SkippedImage& image : pair.bad) skip(std::move(image));
  }
  // Outside of the lock: who hears of it may ask for the counts.
  if (begins_burst && is_worth_a_line(bursts))
    log::warn("{}: {}; skipping", sequence_.place_of(first.file), first.reason);
}

void FrameReader::skip(SkippedImage image) {
  ++counts_.skipped_images;
  if (counts_.skipped.size() < kMostSkippedTold) counts_.skipped.push_back(std::move(image));
}

bool FrameReader::wait_for_consumer(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  return wake_.wait(lock, stop, [&] { return consumer_started_; });
}

// @return false once stopped.
bool FrameReader::wait_for_stamp(Timestamp stamp, const std::stop_token& stop) {
  if (!wait_for_consumer(stop)) return false;
  std::unique_lock lock(mutex_);
  if (!previous_stamp_) {
    previous_due_ = Clock::now() - paused_;
  } else {
    const double gap_s = std::min(seconds_between(stamp, *previous_stamp_), config_.longest_gap_s);
    previous_due_ += std::chrono::nanoseconds(to_ns(gap_s));
  }
  previous_stamp_ = stamp;
  const auto is_asked_for = [&] { return consumer_asks_ && queue_.is_empty(); };
  const auto is_due = [&] {
    return paused_since_ ? is_asked_for() : Clock::now() >= previous_due_ + paused_;
  };
  const trace::Span span("the frame's time", trace::Kind::kWait);
  while (!stop.stop_requested() && !is_due()) {
    if (paused_since_)
      wake_.wait(lock, stop, [&] { return !paused_since_ || is_asked_for(); });
    else
      wake_.wait_until(lock, stop, previous_due_ + paused_,
                       [&] { return paused_since_.has_value(); });
  }
  if (paused_since_) paused_ = std::min(paused_, *paused_since_ - previous_due_);
  return !stop.stop_requested();
}

}  // namespace ygslam
