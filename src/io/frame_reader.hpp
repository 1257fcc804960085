// Decodes a sequence ahead of its consumer, in a thread of its own.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <vector>

#include "core/worker_thread.hpp"
#include "io/frame_loader.hpp"
#include "io/frame_queue.hpp"
#include "io/sequence.hpp"

namespace ygslam {

struct FrameReaderConfig {
  std::size_t from = 0;                ///< first pair of the sequence to offer
  std::optional<std::size_t> to = {};  ///< one past the last pair; nothing: to the end
  std::size_t stride = 1;              ///< offer every stride-th pair, >= 1
  std::size_t ahead = 2;               ///< decoded frames that may wait (file speed), >= 1
  bool realtime = false;               ///< frames become available at their stamps; of a stream
                                       ///< as they come
  std::size_t realtime_waiting = 2;    ///< frames that may wait; the oldest is dropped, >= 1
  double longest_gap_s = 10.0;         ///< realtime: a longer gap between stamps is cut to this
  DepthConfig depth = {};
};

/// A recording may be broken from end to end: no list of its images grows with its length.
inline constexpr std::size_t kMostSkippedTold = 1000;

struct FrameReaderCounts {
  std::size_t offered = 0;   ///< pairs selected by from, to and stride; of a stream: so far
  std::size_t readable = 0;  ///< frames that came out of next() or were dropped
  std::size_t dropped = 0;   ///< decoded, but dropped because the consumer was late (realtime)
  std::size_t bursts = 0;    ///< runs of consecutive unreadable pairs
  std::size_t skipped_images = 0;  ///< images that could not be used, listed ones that do not exist
                                   ///< included
  std::vector<SkippedImage> skipped;  ///< the first kMostSkippedTold of them
  std::size_t without_depth = 0;      ///< colour images of the sequence that have no depth image
  std::size_t left_out = 0;  ///< lines of lists, images of bags and streams, that cannot be used:
                             ///< mostly for their stamps
};

/// Yields the frames of a sequence in order. The thread starts with the object; in realtime mode
/// the clock starts at the first call of next(), so that a slow start of the consumer costs no
/// frame. A frame's id is its place among the pairs offered: 0, 1, ..., unreadable ones included.
class FrameReader {
 public:
  FrameReader(Sequence sequence, const FrameReaderConfig& config);
  FrameReader(const FrameReader&) = delete;
  FrameReader& operator=(const FrameReader&) = delete;
  /// Stops at once, within the decoding of one frame.
  ~FrameReader();

  /// Waits for the next frame. @return nullopt at the end, or once stopped. Throws what the thread
  /// ended with, if it was an exception.
  [[nodiscard]] std::optional<FramePtr> next(const std::stop_token& stop = {});
  /// How many pairs will be offered; 0 where nobody knows, of a stream.
  [[nodiscard]] std::size_t length() const { return offered_; }
  /// The same of all pairs offered: also of those whose frame nobody will see.
  [[nodiscard]] std::optional<OfferedFrame> next_offered(const std::stop_token& stop = {});
  /// Ends the stream from any thread; waiting calls of next() return.
  void stop();
  /// The clock of realtime stands from now until resume(), for a consumer that somebody paused: no
  /// frame is late because of that. Who asks for a frame meanwhile gets the next one, and the clock
  /// stands at its stamp then. A stream comes as it comes. Any thread; twice is once.
  void pause();
  void resume();

  [[nodiscard]] const Sequence& sequence() const { return sequence_; }
  [[nodiscard]] FrameReaderCounts counts() const;

 private:
  using Clock = std::chrono::steady_clock;
  void run(const std::stop_token& stop);
  std::optional<LoadedPair> load(std::size_t i);
  std::optional<LoadedPair> load_next(std::size_t i, const std::stop_token& stop);
  void note(LoadedPair& pair, bool& in_burst);
  void skip(SkippedImage image);
  bool is_paused() const;
  bool wait_for_consumer(const std::stop_token& stop);
  bool wait_for_stamp(Timestamp stamp, const std::stop_token& stop);

  const Sequence sequence_;
  const FrameReaderConfig config_;
  const std::size_t offered_;
  FrameQueue queue_;

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable_any wake_;
  FrameReaderCounts counts_;
  bool consumer_started_ = false;
  bool consumer_asks_ = false;  // is in next()
  std::optional<Clock::time_point> paused_since_;
  Clock::duration paused_{0};  // before that

  // Playback clock of the thread: when the previous frame was due, without pauses.
  std::optional<Timestamp> previous_stamp_;
  Clock::time_point previous_due_;

  WorkerThread thread_;  // last: it uses everything above
};

}  // namespace ygslam
