#include "segment/model_probe.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include "core/testing/memory_limit.hpp"

namespace ygslam {
namespace {

using ::testing::HasSubstr;
using namespace std::chrono_literals;

void expect_error(const Status& status, ErrorKind kind, const std::string& what) {
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, kind);
  EXPECT_THAT(status.error().message, HasSubstr(what));
}

TEST(TryInChild, PassesOnTheChildsAnswer) {
  EXPECT_TRUE(try_in_child([]() -> Status { return Ok{}; }, "f").ok());
  expect_error(try_in_child(
                   []() -> Status {
                     return Error{ErrorKind::kConfig, "no such x"};
                   },
                   "f"),
               ErrorKind::kConfig, "no such x");
  const std::string long_text(100000, 'x');
  expect_error(try_in_child(
                   [&]() -> Status {
                     return Error{ErrorKind::kModel, long_text};
                   },
                   "f"),
               ErrorKind::kModel, long_text);
}

TEST(TryInChild, CrashIsConfinedAndNamesTheFile) {
  for (const int signal_number : {SIGSEGV, SIGABRT, SIGKILL}) {
    const auto crash = [&]() -> Status {
      std::signal(signal_number, SIG_DFL);
      raise(signal_number);
      return Ok{};
    };
    expect_error(try_in_child(crash, "evil.onnx"), ErrorKind::kModel,
                 "evil.onnx: reading it crashed (signal " + std::to_string(signal_number));
  }
  expect_error(try_in_child([]() -> Status { _exit(3); }, "evil.onnx"), ErrorKind::kModel,
               "exit code 3");
  expect_error(try_in_child([]() -> Status { throw std::runtime_error("boom"); }, "evil.onnx"),
               ErrorKind::kModel, "boom");
}

TEST(TryInChild, ChildThatNeverAnswersIsStopped) {
  const auto hang = []() -> Status {
    while (true) pause();
  };
  ChildLimits short_wait;
  short_wait.wall = 50ms;
  expect_error(try_in_child(hang, "slow.onnx", short_wait), ErrorKind::kModel,
               "slow.onnx: reading it took too long");
  const auto spin = []() -> Status {
    volatile unsigned steps = 0;  // the loop must not be optimised away
    while (true) {
      const unsigned before = steps;
      steps = before + 1;
    }
  };
  ChildLimits little_work;
  little_work.cpu = 1s;
  expect_error(try_in_child(spin, "slow.onnx", little_work), ErrorKind::kModel,
               "slow.onnx: reading it took too long");
}

TEST(TryInChild, MemoryBeyondTheLimitIsRefused) {
  if (testing::is_emulated()) GTEST_SKIP() << "QEMU knows no limit of memory";
  const auto greedy = []() -> Status {
    std::vector<char> much(std::size_t{1} << 30, 'x');
    return much.back() == 'x' ? Status(Ok{}) : Status(Error{ErrorKind::kInternal, "lost"});
  };
  ChildLimits little_memory;
  little_memory.extra_bytes = std::uint64_t{64} << 20;
  expect_error(try_in_child(greedy, "big.onnx", little_memory), ErrorKind::kModel, "big.onnx");
}

TEST(TryInChild, WhatTheChildDoesStaysInTheChild) {
  int touched = 0;
  EXPECT_TRUE(try_in_child(
                  [&]() -> Status {
                    touched = 1;
                    return Ok{};
                  },
                  "f")
                  .ok());
  EXPECT_EQ(touched, 0);
}

TEST(TryInChild, LeavesNoZombieBehind) {
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(try_in_child([]() -> Status { return Ok{}; }, "f").ok());
  }
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
}

}  // namespace
}  // namespace ygslam
