// What a traced thread tells of itself, and that others tell nothing.
#include "core/trace.hpp"

#include <gtest/gtest.h>

#include <mutex>
#include <string>
#include <vector>

#include "core/bounded_queue.hpp"
#include "core/worker_thread.hpp"

namespace ygslam::trace {
namespace {

struct Told {
  std::string thread;
  Event event;
};

/// Keeps all that it is told.
class Memory : public Tracer {
 public:
  std::unique_ptr<Track> track(const char* thread) override {
    return std::make_unique<OneTrack>(*this, thread);
  }
  [[nodiscard]] std::vector<Told> told(Kind kind) const {
    const std::lock_guard lock(mutex_);
    std::vector<Told> found;
    for (const Told& told : told_)
      if (told.event.kind == kind) found.push_back(told);
    return found;
  }

 private:
  class OneTrack final : public Track {
   public:
    OneTrack(Memory& all, const char* thread) : all_(all), thread_(thread) {}
    void add(const Event& event) noexcept override {
      const std::lock_guard lock(all_.mutex_);
      all_.told_.push_back({thread_, event});
    }

   private:
    Memory& all_;
    const std::string thread_;
  };
  mutable std::mutex mutex_;
  std::vector<Told> told_;
};

TEST(Trace, AStageWithinAFrameIsOfThatFrame) {
  const auto memory = std::make_shared<Memory>();
  const ScopedTracer traced(memory);
  name_thread("tracking");
  {
    const Span frame("frame", FrameId{5});
    const Span stage("stage");
    { const Span other("other frame", FrameId{6}); }
    const Span after("after");
  }
  { const Span without("without"); }
  const auto told = memory->told(Kind::kStage);
  ASSERT_EQ(told.size(), 5U);  // by their ends
  const std::vector<FrameId> frames = {FrameId{6}, FrameId{5}, FrameId{5}, FrameId{5}, kNoFrame};
  for (std::size_t i = 0; i < told.size(); ++i) EXPECT_EQ(told[i].event.frame, frames[i]) << i;
  EXPECT_LE(told[3].event.begin_ns, told[2].event.begin_ns);
  EXPECT_GE(told[3].event.wall_ns, told[2].event.wall_ns);
}

TEST(Trace, AThreadWithoutANameOrATracerTellsNothing) {
  EXPECT_EQ(thread_tracer(), nullptr);
  name_thread("nobody");
  { const Span span("stage"); }
  const auto memory = std::make_shared<Memory>();
  {
    const ScopedTracer traced(memory);
    { const Span span("stage"); }
    length("queue", 1);
    name_thread("somebody");
    length(nullptr, 1);
    dropped(nullptr);
    const ScopedTracer not_traced(nullptr);
    const Span span("stage");
  }
  EXPECT_EQ(thread_tracer(), nullptr);
  for (const Kind kind : {Kind::kStage, Kind::kLength, Kind::kDropped})
    EXPECT_TRUE(memory->told(kind).empty());
}

TEST(Trace, AWorkerIsTracedWhereItsMakerIs) {
  const auto memory = std::make_shared<Memory>();
  {
    const ScopedTracer traced(memory);
    WorkerThread worker([](const std::stop_token&) {
      name_thread("worker");
      const Span span("stage");
    });
    worker.join();
  }
  ASSERT_EQ(memory->told(Kind::kStage).size(), 1U);
  EXPECT_EQ(memory->told(Kind::kStage)[0].thread, "worker");
}

TEST(Trace, OfAWaitOnlyWhatLastsIsTold) {
  const auto memory = std::make_shared<Memory>();
  const ScopedTracer traced(memory);
  name_thread("tracking");
  BoundedQueue<int> queue(2, Overflow::kBlock, "work");
  queue.push(1);
  EXPECT_EQ(queue.pop(), 1);
  EXPECT_TRUE(memory->told(Kind::kEmpty).empty());
  EXPECT_EQ(queue.pop_until(std::chrono::steady_clock::now()), std::nullopt);
  EXPECT_EQ(memory->told(Kind::kEmpty).size(), 1U);
}

TEST(Trace, WhoWaitsForRoomInAQueueIsTold) {
  const auto memory = std::make_shared<Memory>();
  const ScopedTracer traced(memory);
  // The other thread may come late to the full queue: the more time it gets, the less likely.
  for (int pause_ms = 1; pause_ms < 10'000 && memory->told(Kind::kFull).empty(); pause_ms *= 2) {
    BoundedQueue<int> queue(1, Overflow::kBlock, "work");
    queue.push(1);
    WorkerThread worker([&](const std::stop_token&) {
      name_thread("worker");
      queue.push(2);
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(pause_ms));
    EXPECT_EQ(queue.pop(), 1);
    worker.join();
    EXPECT_EQ(queue.pop(), 2);
  }
  ASSERT_EQ(memory->told(Kind::kFull).size(), 1U);
  EXPECT_EQ(memory->told(Kind::kFull)[0].thread, "worker");
  EXPECT_STREQ(memory->told(Kind::kFull)[0].event.name, "work");
}

}  // namespace
}  // namespace ygslam::trace
