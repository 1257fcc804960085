#include "core/worker_thread.hpp"

#include <gtest/gtest.h>

#include <mutex>
#include <string>
#include <vector>

#include "core/bounded_queue.hpp"
#include "core/check.hpp"

namespace ygslam {
namespace {

/// What was logged, in order.
class Lines {
 public:
  [[nodiscard]] log::SinkPtr sink() {
    return std::make_shared<const log::Sink>([this](log::Level level, const std::string& line) {
      const std::lock_guard lock(mutex_);
      lines_.push_back((level == log::Level::kWarning ? "W " : "- ") + line);
    });
  }
  [[nodiscard]] std::vector<std::string> all() const {
    const std::lock_guard lock(mutex_);
    return lines_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> lines_;
};

TEST(WorkerThread, AnExceptionWaitsForTheMaker) {
  WorkerThread fine([](const std::stop_token&) {});
  fine.join();
  EXPECT_NO_THROW(fine.rethrow());
  BoundedQueue<int> queue(1, Overflow::kBlock);
  WorkerThread bad([](const std::stop_token&) { CHECK(1 + 1 == 3, "as it must"); },
                   [&] { queue.close(); });
  EXPECT_EQ(queue.pop(), std::nullopt);  // woken by the end
  try {
    bad.rethrow();
    FAIL() << "no exception";
  } catch (const InternalError& e) {
    EXPECT_NE(std::string(e.what()).find("worker_thread_test.cpp"), std::string::npos);
    EXPECT_NE(std::string(e.what()).find("CHECK(1 + 1 == 3) failed as it must"), std::string::npos);
  }
  EXPECT_THROW(bad.rethrow(), InternalError) << "every time it is asked";
}

TEST(WorkerThread, LogsWhereItsMakerDoes) {
  Lines one, two;
  {
    const log::ScopedSink outer(one.sink());
    log::info("{} frames", 3);
    {
      const log::ScopedSink inner(two.sink());
      const WorkerThread thread([](const std::stop_token&) { log::warn("from the thread"); });
    }
    log::warn("again");
  }
  EXPECT_EQ(one.all(), (std::vector<std::string>{"- 3 frames", "W again"}));
  EXPECT_EQ(two.all(), (std::vector<std::string>{"W from the thread"}));
}

TEST(Log, WithoutASinkOnlyWarningsAndErrorsGoToStandardError) {
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  log::info("nothing");
  log::warn("something");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "warning: something\n");
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
}

TEST(Log, ASinkThatThrowsHarmsNobody) {
  const log::ScopedSink scope(std::make_shared<const log::Sink>(
      [](log::Level, const std::string&) { throw std::runtime_error("full"); }));
  EXPECT_NO_THROW(log::error("line"));
}

}  // namespace
}  // namespace ygslam
