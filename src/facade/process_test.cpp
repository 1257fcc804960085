// The library as a program sees it: nothing but its header and its shared object. One test for each
// promise of the header; here those of Slam::process.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <string>

#include "facade/testing/film.hpp"

namespace ygslam::api {
namespace {

using testing::code_of;
using testing::expect_same;
using testing::Film;
using testing::film;
using testing::kHeight;
using testing::kWidth;
using testing::Record;
using testing::run;
using testing::same;
using testing::settings_for;

TEST(Process, FollowsTheCamera) {
  const Film& seen = film("static_xyz");
  const Record record = run(settings_for(seen), seen);
  const SE3 T_start = seen.frames[0]->T_world_camera;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Result& r = record.results[i];
    EXPECT_EQ(r.state, State::kTracking);
    EXPECT_GT(r.inliers, 30);
    EXPECT_GT(r.static_points + (i == 0 ? r.unknown_points : 0), 100) << "nothing moved yet";
    EXPECT_EQ(r.mask_age_frames, -1) << "there are no masks";
    const Vec3 truth = (T_start.inverse() * seen.frames[i]->T_world_camera).t();
    const auto& t = r.T_world_camera.translation_m;
    EXPECT_LT((truth - Vec3(t[0], t[1], t[2])).norm(), 0.03);
    double norm = 0;
    for (const double q : r.T_world_camera.rotation_xyzw) norm += q * q;
    EXPECT_NEAR(norm, 1, 1e-9);
  }
  ASSERT_EQ(record.outcome.trajectory.size(), seen.size());
  EXPECT_EQ(record.outcome.trajectory.back().t_ns, seen[seen.size() - 1].t_ns);
  EXPECT_GT(record.outcome.static_map.size(), 500U);
}

TEST(Process, ARollingShutterThatIsToldIsUndone) {
  const Film& seen = film("walking_rpy");
  const SE3 T_start = seen.frames[0]->T_world_camera;
  const auto error_m = [&](double readout_ms) {
    Settings settings = settings_for(seen);
    settings.deterministic = true;
    settings.camera.colour_readout_ms = settings.camera.depth_readout_ms = readout_ms;
    settings.camera.shutter_known = true;
    const Record record = run(settings, seen);
    double sum = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const auto& t = record.results[i].T_world_camera.translation_m;
      const Vec3 truth = (T_start.inverse() * seen.frames[i]->T_world_camera).t();
      sum += (truth - Vec3(t[0], t[1], t[2])).norm();
    }
    return sum / static_cast<double>(seen.size());
  };
  const double global_m = error_m(0);
  const double told_m = error_m(40);
  std::printf("mean error %.1f mm as global, %.1f mm told\n", 1e3 * global_m, 1e3 * told_m);
  EXPECT_LT(told_m, 0.6 * global_m);
}

TEST(Process, AClockThatWasSetBackCostsFourFramesAndNoneAfterAReset) {
  const Film& seen = film("static_xyz");
  ASSERT_GE(seen.size(), 12U);
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  Slam slam = Slam::open(settings);
  const auto set_back = [&](std::size_t i, std::int64_t by_ns) {
    Frame frame = seen[i];
    frame.t_ns -= by_ns;
    return frame;
  };
  constexpr std::int64_t kBack_ns = 500'000'000'000;
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(slam.process(seen[i]).clock_shift_ns, 0);
  for (std::size_t i = 4; i < 8; ++i)
    EXPECT_EQ(code_of([&] { slam.process(set_back(i, kBack_ns)); }), 4) << i;
  const Result believed = slam.process(set_back(8, kBack_ns));
  EXPECT_EQ(believed.state, State::kTracking);
  EXPECT_GT(believed.clock_shift_ns, 0);
  slam.reset();
  EXPECT_NE(slam.process(set_back(9, 3 * kBack_ns)).state, State::kLost);
  const auto trajectory = slam.finish().trajectory;
  for (std::size_t i = 1; i < trajectory.size(); ++i)
    EXPECT_GT(trajectory[i].t_ns, trajectory[i - 1].t_ns);
}

TEST(Process, BadFramesAreCode4AndLeaveTheRunAsItWas) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  const Record undisturbed = run(settings, seen);
  Slam slam = Slam::open(settings);
  Record record;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    Frame bad = seen[i];
    bad.rgb = nullptr;
    EXPECT_EQ(code_of([&] { slam.process(bad); }), 4);
    bad = seen[i];
    bad.depth_m = nullptr;
    EXPECT_EQ(code_of([&] { slam.process(bad); }), 4);
    bad = seen[i];
    bad.t_ns = std::numeric_limits<std::int64_t>::max();
    EXPECT_EQ(code_of([&] { slam.process(bad); }), 4);
    bad = seen[i];
    for (const std::int64_t none : {std::numeric_limits<std::int64_t>::min(), std::int64_t{5},
                                    seen[i].t_ns + 2'000'000'000}) {
      bad.depth_t_ns = none;
      EXPECT_EQ(code_of([&] { slam.process(bad); }), 4);
    }
    record.results.push_back(slam.process(seen[i]));
    EXPECT_EQ(code_of([&] { slam.process(seen[i]); }), 4) << "the same stamp again";
    bad.t_ns = std::numeric_limits<std::int64_t>::min();
    EXPECT_EQ(code_of([&] { slam.process(bad); }), 4);
  }
  expect_same(slam.finish(), undisturbed.outcome);
}

TEST(Process, StampsOfAnotherUnitAreTold) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  for (const std::int64_t unit_ns : {std::int64_t{1}, std::int64_t{1'000'000}}) {
    int told = 0;
    settings.log = [&](LogLevel, const std::string& line) {
      told += line.find("are stamps in nanoseconds") != std::string::npos ? 1 : 0;
    };
    Slam slam = Slam::open(settings);
    for (std::size_t i = 0; i < std::min<std::size_t>(seen.size(), 8); ++i) {
      Frame frame = seen[i];
      frame.t_ns /= unit_ns;
      if (frame.depth_t_ns != 0) frame.depth_t_ns /= unit_ns;
      slam.process(frame);
    }
    EXPECT_EQ(told, unit_ns == 1 ? 0 : 1);
  }
}

TEST(Process, DepthThatIsNoneInAnyWayIsNone) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  const float none[] = {0, NAN, -1, INFINITY, -INFINITY, 1e30F};
  std::vector<Outcome> outcomes;
  for (int trial = 0; trial < 2; ++trial) {  // all kinds, then zero alone
    Slam slam = Slam::open(settings);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const DepthImage& whole = seen.frames[i]->frame->depth_m;
      std::vector<float> depth_m(whole.begin(), whole.end());
      for (std::size_t k = i; k < depth_m.size(); k += 7)
        depth_m[k] = trial == 0 ? none[k % std::size(none)] : 0;
      Frame frame = seen[i];
      frame.depth_m = depth_m.data();
      const Result r = slam.process(frame);
      for (const double t : r.T_world_camera.translation_m) EXPECT_TRUE(std::isfinite(t));
    }
    outcomes.push_back(slam.finish());
  }
  expect_same(outcomes[0], outcomes[1]);
}

TEST(Process, WithNothingToSeeTheStateSaysSo) {
  Settings settings;
  settings.segmenter = "none";
  settings.camera = {
      .fx = 300, .fy = 300, .cx = 160, .cy = 120, .width = kWidth, .height = kHeight};
  Slam slam = Slam::open(settings);
  const std::vector<std::uint8_t> black(3 * kWidth * kHeight);
  const std::vector<float> nothing(kWidth * kHeight, NAN);
  for (int i = 0; i < 5; ++i) {
    const Result r = slam.process({i * 50'000'000LL, black.data(), nothing.data()});
    EXPECT_EQ(r.state, State::kWaiting);
    EXPECT_EQ(r.inliers, 0);
  }
  const Outcome outcome = slam.finish();
  EXPECT_TRUE(outcome.trajectory.empty());
  EXPECT_TRUE(outcome.static_map.empty());
}

TEST(Process, ImagesOfAnySizeAreTaken) {
  for (const auto& [width, height] : {std::pair{1, 1}, {2, 480}, {640, 3}, {33, 47}, {71, 65}}) {
    Settings settings;
    settings.segmenter = "none";
    const double f = std::max(width, height);
    settings.camera = {
        .fx = f, .fy = f, .cx = width / 2.0, .cy = height / 2.0, .width = width, .height = height};
    if (f > 20.0 * std::min(width, height))
      settings.camera.fx = 5.0 * width, settings.camera.fy = 5.0 * height;
    Slam slam = Slam::open(settings);
    std::vector<std::uint8_t> rgb(3 * static_cast<std::size_t>(width) * height);
    for (std::size_t i = 0; i < rgb.size(); ++i)
      rgb[i] = static_cast<std::uint8_t>(i * 2654435761U >> 13);
    const std::vector<float> depth_m(static_cast<std::size_t>(width) * height, 2.0F);
    for (int i = 0; i < 4; ++i) slam.process({i * 50'000'000LL, rgb.data(), depth_m.data()});
    slam.finish();
  }
}

TEST(Process, AMoverBecomesAnObjectWithItsPlaceAndVelocity) {
  const Film& seen = film("moving_box");
  const Record record = run(settings_for(seen), seen);
  bool found = false;
  for (const Result& r : record.results) {
    for (const Object& o : r.objects) {
      found = true;
      EXPECT_EQ(o.class_name, "unknown");
      EXPECT_GE(o.age_frames, 0);
      EXPECT_GE(o.missing_frames, 0);
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_LE(o.min_world_m[axis], o.max_world_m[axis]);
        EXPECT_TRUE(std::isfinite(o.velocity_world_mps[axis]));
        EXPECT_NEAR(o.after(0).position_world_m[axis], o.body_world_m[axis], 1e-9);
        EXPECT_GT(o.after(1).covariance_m2[4 * axis], o.after(0).covariance_m2[4 * axis]);
      }
      EXPECT_THROW((void)o.after(-1), Error);
      EXPECT_THROW((void)o.after(std::nan("")), Error);
    }
  }
  EXPECT_TRUE(found);
}

TEST(Process, AForkedChildCanNeitherUseNorEndItsParentsObject) {
  const Film& seen = film("static_xyz");
  std::optional<Slam> slam = Slam::open(settings_for(seen));
  slam->process(seen[0]);
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(60);  // it would wait for threads that it has not
    std::string message;
    const int code = code_of([&] { slam->process(seen[1]); }, &message);
    *slam = Slam::open(settings_for(seen));  // one of its own in that place
    const bool is_fine = slam->process(seen[0]).state == State::kTracking;
    slam.reset();
    ::_exit(code == 2 && message.find("forked child") != message.npos && is_fine ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(slam->process(seen[1]).state, State::kTracking) << "the parent's goes on";
}

}  // namespace
}  // namespace ygslam::api
