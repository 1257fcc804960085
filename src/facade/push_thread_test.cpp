#include "facade/push_thread.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <stdexcept>

namespace ygslam::api {
namespace {

Input moved(double x_m) {
  Input input;
  input.T_now_last = SE3(Mat3::Identity(), Vec3(x_m, 0, 0));
  return input;
}

/// What the second frame that is processed was told, of those put in while the first was busy.
std::optional<SE3> told_after_drops(const std::vector<Input>& while_busy) {
  std::promise<void> busy, release;
  std::vector<Input> seen;
  const auto process = [&](const Input& input) {
    seen.push_back(input);
    if (seen.size() == 1) {
      busy.set_value();
      release.get_future().wait();
    }
    return Result();
  };
  PushThread thread(process, {});
  thread.put({});
  busy.get_future().wait();
  for (const Input& input : while_busy) thread.put(input);
  release.set_value();
  thread.finish();
  EXPECT_EQ(seen.size(), 2U);
  return seen.back().T_now_last;
}

TEST(PushThread, TheMotionOfADroppedFrameGoesWithTheNext) {
  const auto told = told_after_drops({moved(1), moved(2), moved(3)});
  ASSERT_TRUE(told);
  EXPECT_NEAR(told->t().x(), 6, 1e-12);
  EXPECT_FALSE(told_after_drops({moved(1), {}, moved(3)})) << "nobody measured one of them";
}

/// What a frame's processing or delivery meets: it tells that it has begun, and goes on when it
/// may.
struct Gate {
  std::promise<void> begun, may_go_on;
  std::atomic<bool> is_done = false;

  void pass() {
    begun.set_value();
    may_go_on.get_future().wait();
    is_done = true;
  }
  /// Lets a thread that waits here go on while it is cleared. @return whether clear() waited for
  /// it.
  bool is_awaited_by_clear_of(PushThread& thread) {
    thread.put({});
    begun.get_future().wait();
    auto cleared = std::async(std::launch::async, [&] {
      thread.clear();
      return is_done.load();
    });
    may_go_on.set_value();
    return cleared.get();
  }
};

TEST(PushThread, ClearWaitsForTheFrameInProcessAndDropsItsResult) {
  Gate gate;
  PushThread thread(
      [&](const Input&) {
        gate.pass();
        return Result();
      },
      {});
  EXPECT_TRUE(gate.is_awaited_by_clear_of(thread));
  EXPECT_FALSE(thread.poll());
}

TEST(PushThread, ClearWaitsUntilAResultIsDelivered) {
  Gate gate;
  PushThread thread([](const Input&) { return Result(); }, [&](const Result&) { gate.pass(); });
  EXPECT_TRUE(gate.is_awaited_by_clear_of(thread));
}

TEST(PushThread, WhatFailsIsThrownToTheCaller) {
  PushThread thread([](const Input&) -> Result { throw std::runtime_error("broken"); }, {});
  EXPECT_NO_THROW(thread.rethrow());
  thread.put({});
  thread.finish();
  thread.clear();  // waits for nobody
  EXPECT_THROW(thread.rethrow(), std::runtime_error);
  EXPECT_FALSE(thread.poll());
}

}  // namespace
}  // namespace ygslam::api
