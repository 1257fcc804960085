// Slam::push(), poll() and localise_now(); times and odometry.
#include <gtest/gtest.h>

#include <cstdio>
#include <future>

#include "facade/testing/film.hpp"

namespace ygslam::api {
namespace {

using testing::code_of;
using testing::Film;
using testing::film;
using testing::kHeight;
using testing::kWidth;
using testing::settings_for;

TEST(Push, NeverWaitsTheNewestWinsAndWhatIsDroppedIsCounted) {
  const Film& seen = film("static_xyz");
  std::promise<void> busy, release;
  std::vector<Result> results;
  Settings settings = settings_for(seen);
  settings.on_result = [&](const Result& result) {
    results.push_back(result);
    if (results.size() > 1) throw std::runtime_error("which harms nobody");
    busy.set_value();
    release.get_future().wait();
  };
  Slam slam = Slam::open(settings);
  slam.push(seen[0]);
  busy.get_future().wait();
  for (std::size_t i = 1; i < 6; ++i) slam.push(seen[i]);  // returns, although it is busy
  release.set_value();
  const Outcome outcome = slam.finish();
  ASSERT_EQ(results.size(), 2U);
  EXPECT_EQ(results[0].t_ns, seen[0].t_ns);
  EXPECT_EQ(results[1].t_ns, seen[5].t_ns);
  EXPECT_EQ(results[1].state, State::kTracking);
  EXPECT_EQ(results[1].dropped_frames, 4);
  EXPECT_EQ(outcome.trajectory.size(), 2U);
  EXPECT_FALSE(slam.poll()) << "the callback had them";
}

TEST(Push, ResultsWaitInOrder) {
  const Film& seen = film("static_xyz");
  Slam slam = Slam::open(settings_for(seen));
  EXPECT_FALSE(slam.poll());
  for (std::size_t i = 0; i < seen.size(); ++i) slam.push(seen[i]);
  slam.finish();
  std::int64_t last_ns = 0;
  std::size_t results = 0;
  int dropped = 0;
  for (auto result = slam.poll(); result; result = slam.poll(), ++results) {
    EXPECT_GT(result->t_ns, last_ns);
    EXPECT_GE(result->dropped_frames, dropped);
    last_ns = result->t_ns;
    dropped = result->dropped_frames;
  }
  EXPECT_EQ(last_ns, seen[seen.size() - 1].t_ns) << "the newest is always processed";
  EXPECT_EQ(results + static_cast<std::size_t>(dropped), seen.size());
}

TEST(Push, WrongUseIsSaidAtOnce) {
  const Film& seen = film("static_xyz");
  Slam slam = Slam::open(settings_for(seen));
  slam.push(seen[1]);
  EXPECT_EQ(code_of([&] { slam.push(seen[0]); }), 4) << "an earlier stamp";
  EXPECT_EQ(code_of([&] { slam.push(Frame{}); }), 4);
  EXPECT_EQ(code_of([&] { slam.process(seen[2]); }), 2);
  slam.reset();
  slam.push(seen[3]);
  slam.finish();
  EXPECT_EQ(code_of([&] { slam.push(seen[4]); }), 2);
  Slam unfinished = Slam::open(settings_for(seen));
  for (std::size_t i = 0; i < 4; ++i) unfinished.push(seen[i]);  // ends in the middle of it
}

TEST(Times, AreOfTheStages) {
  const Film& seen = film("static_xyz");
  Slam slam = Slam::open(settings_for(seen));
  slam.process(seen[0]);
  const StageTimes t = slam.process(seen[1]).times_ms;
  EXPECT_GT(t.features, 0);
  EXPECT_GT(t.pose, 0);
  EXPECT_GE(t.all, t.features + t.motion + t.pose);
}

/// What odometry would measure, off by so much.
Pose odometry(const Film& seen, std::size_t from, std::size_t to, double turned_rad) {
  const SE3 T = seen.frames[from]->T_world_camera.inverse() * seen.frames[to]->T_world_camera *
                SE3::exp((Vec6() << 0, 0, 0, 0, turned_rad, 0).finished());
  const Eigen::Quaterniond q = T.quaternion();
  return {{T.t().x(), T.t().y(), T.t().z()}, {q.x(), q.y(), q.z(), q.w()}};
}

TEST(Odometry, IsAStartForTheSearchAndNoMore) {
  const Film& seen = film("walking_rpy");
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  settings.options["dynamic.mode"] = "off";
  for (const double turned_rad : {0.0, 0.02, 0.3}) {
    Slam slam = Slam::open(settings);
    slam.process(seen[0]);
    for (std::size_t i = 1; i < 10; ++i) {
      Frame frame = seen[i];
      frame.T_last_camera = odometry(seen, i - 1, i, turned_rad);
      const Result result = slam.process(frame);
      EXPECT_EQ(result.state, State::kTracking) << turned_rad << " " << i;
      const Vec3 truth =
          (seen.frames[0]->T_world_camera.inverse() * seen.frames[i]->T_world_camera).t();
      const auto& t = result.T_world_camera.translation_m;
      EXPECT_LT((truth - Vec3(t[0], t[1], t[2])).norm(), 0.1) << turned_rad << " " << i;
    }
  }
}

TEST(Odometry, FindsMoreWhereTheCameraTurnedFar) {
  const Film& seen = film("walking_rpy");
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  settings.options["dynamic.mode"] = "off";
  const auto inliers = [&](bool told) {
    Slam slam = Slam::open(settings);
    int sum = 0;
    for (std::size_t i = 0; i < seen.size(); i += 7) {  // too far apart for a constant velocity
      Frame frame = seen[i];
      if (told && i > 0) frame.T_last_camera = odometry(seen, i - 7, i, 0);
      const Result result = slam.process(frame);
      if (i > 0) sum += result.inliers;
    }
    return sum;
  };
  const int with = inliers(true), without = inliers(false);
  std::printf("%d inliers with odometry, %d without\n", with, without);
  EXPECT_GT(with, without);
}

TEST(LocaliseNow, FindsAFrameInTheMapAndChangesNothing) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  Slam slam = Slam::open(settings);
  EXPECT_FALSE(slam.localise_now(seen[0])) << "there is no map";
  for (std::size_t i = 0; i < 20; ++i) slam.process(seen[i]);
  const std::size_t keyframes = slam.map().keyframes.size();
  const auto place = slam.localise_now(seen[8]);  // the past, whatever the stamp
  ASSERT_TRUE(place);
  const Vec3 truth =
      (seen.frames[0]->T_world_camera.inverse() * seen.frames[8]->T_world_camera).t();
  const auto& t = place->translation_m;
  EXPECT_LT((truth - Vec3(t[0], t[1], t[2])).norm(), 0.03);
  const std::vector<std::uint8_t> dark(3 * kWidth * kHeight);
  const std::vector<float> none(kWidth * kHeight);
  EXPECT_FALSE(slam.localise_now({0, dark.data(), none.data()}));
  EXPECT_EQ(code_of([&] { slam.localise_now({}); }), 4);
  EXPECT_EQ(slam.map().keyframes.size(), keyframes);
  EXPECT_EQ(slam.process(seen[20]).state, State::kTracking);
  slam.finish();
  EXPECT_TRUE(slam.localise_now(seen[8])) << "also at the end";
}

}  // namespace
}  // namespace ygslam::api
