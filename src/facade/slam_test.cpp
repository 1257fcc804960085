// The library as a program sees it: nothing but its header and its shared object. One test for each
// promise of the header; here those of the object as a whole: its end, its map, its log,
// its memory.
#include <gtest/gtest.h>

#include <cmath>
#include <mutex>
#include <thread>

#include "core/testing/memory_limit.hpp"
#include "core/testing/recorded_data.hpp"
#include "facade/testing/film.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam::api {
namespace {

using testing::code_of;
using testing::expect_same;
using testing::Film;
using testing::film;
using testing::Record;
using testing::run;
using testing::same;
using testing::settings_for;

TEST(Finish, MayBeCalledAgainAndAfterNothing) {
  const Film& seen = film("static_xyz");
  for (const bool deterministic : {false, true}) {
    Settings settings = settings_for(seen);
    settings.deterministic = deterministic;
    Slam slam = Slam::open(settings);
    for (std::size_t i = 0; i < 8; ++i) slam.process(seen[i]);
    const Outcome first = slam.finish();
    EXPECT_EQ(first.trajectory.size(), 8U);
    expect_same(slam.finish(), first);
    EXPECT_EQ(code_of([&] { slam.process(seen[8]); }), 2);
    expect_same(slam.finish(), first);
    Slam unused = Slam::open(settings);
    EXPECT_TRUE(unused.finish().trajectory.empty());
  }
}

TEST(Finish, GivesTheMapAloneWhereNoTrajectoryIsKept) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.keep_trajectory = false;
  const Outcome outcome = run(settings, seen).outcome;
  EXPECT_TRUE(outcome.trajectory.empty());
  EXPECT_GT(outcome.static_map.size(), 500U);
}

TEST(View, ShowsTheRunAndChangesNothing) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  EXPECT_EQ(Slam::open(settings).view_url(), "");
  const Record unseen = run(settings, seen);
  settings.view = "127.0.0.1:0";
  Slam slam = Slam::open(settings);
  EXPECT_EQ(slam.view_url().rfind("http://127.0.0.1:", 0), 0U) << slam.view_url();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Result result = slam.process(seen[i]);
    EXPECT_EQ(result.T_world_camera.translation_m, unseen.results[i].T_world_camera.translation_m);
  }
  expect_same(slam.finish(), unseen.outcome);
  for (const char* nowhere : {"somewhere", "127.0.0.1:99999", "203.0.113.7:0"}) {
    settings.view = nowhere;
    EXPECT_EQ(code_of([&] { Slam::open(settings); }), 2) << nowhere;
  }
}

TEST(Slam, AnObjectThatWasMovedFromSaysSo) {
  const Film& seen = film("static_xyz");
  Slam first = Slam::open(settings_for(seen));
  first.process(seen[0]);
  Slam second = std::move(first);
  EXPECT_EQ(code_of([&] { first.process(seen[1]); }), 2);  // NOLINT: that is the question
  EXPECT_EQ(code_of([&] { first.finish(); }), 2);
  second.process(seen[1]);
  first = Slam::open(settings_for(seen));  // a new one in its place
  first.process(seen[0]);
  second = std::move(first);  // ends the one that was there
  second.process(seen[1]);
  Slam& itself = second;
  second = std::move(itself);
  EXPECT_EQ(second.finish().trajectory.size(), 2U);
}

TEST(Slam, TheSameInputTwiceAndTwoAtOnceGiveTheSame) {
  const Film &still = film("static_xyz"), &moving = film("moving_box");
  Settings of_still = settings_for(still), of_moving = settings_for(moving);
  of_still.deterministic = of_moving.deterministic = true;
  const Record still_alone = run(of_still, still), moving_alone = run(of_moving, moving);
  Record still_beside, moving_beside;
  {
    const std::jthread other([&] { moving_beside = run(of_moving, moving); });
    still_beside = run(of_still, still);
  }
  expect_same(still_beside.outcome, still_alone.outcome);
  expect_same(moving_beside.outcome, moving_alone.outcome);
  for (std::size_t i = 0; i < moving.size(); ++i) {
    EXPECT_TRUE(
        same(moving_beside.results[i].T_world_camera, moving_alone.results[i].T_world_camera));
    EXPECT_EQ(moving_beside.results[i].objects.size(), moving_alone.results[i].objects.size());
  }
}

TEST(Slam, TwoInOneThreadTakeTurnsWithoutNoticing) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  const Record alone = run(settings, seen);
  Slam a = Slam::open(settings), b = Slam::open(settings);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    a.process(seen[i]);
    b.process(seen[i]);
  }
  expect_same(a.finish(), alone.outcome);
  expect_same(b.finish(), alone.outcome);
}

TEST(SaveMap, AnotherObjectGoesOnWithTheMapOrIsPlacedInIt) {
  const Film& room = film("static_xyz");
  const ygslam::testing::TempFolder folder;
  Settings settings = settings_for(room);
  settings.deterministic = true;
  settings.load_map = (folder.path() / "room.ygmap").string();
  EXPECT_EQ(code_of([&] { Slam::open(settings); }), 6) << "not there yet";
  {
    Settings first = settings;
    first.load_map.clear();
    Slam slam = Slam::open(first);
    for (std::size_t i = 0; i < room.size(); ++i) (void)slam.process(room[i]);
    slam.save_map(settings.load_map);
    EXPECT_EQ(code_of([&] { slam.save_map((folder.path() / "none" / "room").string()); }), 9);
    (void)slam.finish();
    slam.save_map(settings.load_map);
  }
  for (const bool localize_only : {false, true}) {
    settings.localize_only = localize_only;
    Slam slam = Slam::open(settings);
    const std::size_t keyframes = slam.map().keyframes.size();
    EXPECT_GT(keyframes, 0U);
    for (std::size_t i = 0; i < room.size(); ++i) {
      const Result result = slam.process(room[i]);
      EXPECT_EQ(result.state, State::kTracking) << i;
      if (i > 0) continue;
      for (const double t_m : result.T_world_camera.translation_m) EXPECT_NEAR(t_m, 0, 0.01);
    }
    if (localize_only) {
      EXPECT_EQ(slam.map().keyframes.size(), keyframes);
    }
  }
  settings.camera.fx += 40;
  EXPECT_EQ(code_of([&] { Slam::open(settings); }), 6) << "another camera";
  settings.load_map.clear();
  EXPECT_EQ(code_of([&] { Slam::open(settings); }), 2) << "nothing to localise in";
}

/// Collects lines from any thread.
struct Lines {
  std::mutex mutex;
  std::vector<std::string> warnings;
  [[nodiscard]] std::function<void(LogLevel, const std::string&)> sink() {
    return [this](LogLevel level, const std::string& line) {
      const std::lock_guard lock(mutex);
      if (level == LogLevel::kWarning) warnings.push_back(line);
      throw std::runtime_error("which harms nobody");
    };
  }
};

TEST(Slam, WithoutTroubleNothingIsWritten) {
  const Film& seen = film("moving_box");
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  run(settings_for(seen), seen);
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(Slam, DepthInAnotherUnitIsToldOnce) {
  const Film& seen = film("moving_box");
  Lines lines;
  Settings settings = settings_for(seen);
  settings.log = lines.sink();
  Slam slam = Slam::open(settings);
  const auto pixels = static_cast<std::size_t>(settings.camera.width) *
                      static_cast<std::size_t>(settings.camera.height);
  for (std::size_t i = 0; i < 8; ++i) {
    Frame frame = seen[i];
    std::vector<float> millimetres(frame.depth_m, frame.depth_m + pixels);
    for (float& depth : millimetres) depth *= 1000;
    frame.depth_m = millimetres.data();
    EXPECT_EQ(slam.process(frame).state, State::kWaiting);
  }
  ASSERT_EQ(lines.warnings.size(), 1U);
  EXPECT_NE(lines.warnings[0].find("is it in metres"), std::string::npos);
}

/// A model path leads to no line; a segmenter that fails does. Without a network at hand the only
/// way to a warning is a model: this is skipped without one.
#if !defined(__SANITIZE_ADDRESS__)  // a network's threads load a library in a way it refuses
TEST(Slam, LogLinesGoToTheCallbackOfTheirObjectAndNothingToStandardOutput) {
  const std::string model = ygslam::testing::shared_folder() / "models/yolov8n-seg_480x640.onnx";
  YGSLAM_NEEDS_RECORDED(model);
  const Film& seen = film("moving_box");
  Settings settings = settings_for(seen);
  settings.segmenter = "model";
  settings.model = model;
  // Input time without a mask: the next frame comes 30 s later and the first mask is not awaited.
  settings.options = {{"run.first_mask_timeout_s", "0"}};
  const auto provoke = [&](Slam& slam) {
    for (std::size_t i = 0; i < 4; ++i) {
      Frame frame = seen[i];
      frame.t_ns += static_cast<std::int64_t>(i) * 30'000'000'000;
      slam.process(frame);
    }
    slam.finish();
  };
  Lines of_one, of_two;
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  {
    settings.log = of_one.sink();
    Slam one = Slam::open(settings);
    settings.log = of_two.sink();
    Slam two = Slam::open(settings);
    provoke(one);
  }
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "") << "the callback has it";
  EXPECT_FALSE(of_one.warnings.empty());
  EXPECT_TRUE(of_two.warnings.empty());
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  settings.log = nullptr;
  Slam silent = Slam::open(settings);
  provoke(silent);
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_NE(::testing::internal::GetCapturedStderr().find("warning: "), std::string::npos);
}
#endif

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// In a child each: less and less memory beyond what is in use. Whatever does not fit is an Error. A
// suite, and so a process, of its own: what other tests left to the allocator may do for a run.
TEST(SlamWithoutMemory, IsCode1AndNeverTheEnd) {
  const Film& seen = film("static_xyz");
  int refused = 0;
  for (const std::size_t extra_mb : {400, 200, 100, 60, 40, 25, 15, 8, 4, 2}) {
    const auto child = [&] {
      ygslam::testing::limit_memory(extra_mb);
      // What earlier work left to the allocator counts as well: all is taken, then as much given
      // back as there is to be.
      std::vector<std::unique_ptr<char[]>> taken;
      taken.reserve(1 << 16);
      try {
        while (taken.size() < taken.capacity()) taken.emplace_back(new char[1 << 20]);
      } catch (const std::bad_alloc&) {
      }
      taken.resize(taken.size() - std::min(taken.size(), extra_mb));
      try {
        run(settings_for(seen), seen);
        std::_Exit(0);
      } catch (const Error& e) {
        std::_Exit(e.code == 1 && std::string(e.what()) == "out of memory" ? 1 : 2);
      }
    };
    refused += ygslam::testing::refusals_of(child, extra_mb);
  }
  EXPECT_GT(refused, 0) << "no limit was low enough: the test tests nothing";
}
#endif

}  // namespace
}  // namespace ygslam::api
