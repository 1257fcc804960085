#include "loop/map_straightening.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "geometry/random_vector.hpp"
#include "loop/loop_test_world.hpp"

namespace ygslam {
namespace {

constexpr int kKeyframes = 40;
constexpr int kMinShared = 15;
const Vec3 kBias(1e-3, -2e-3, 5e-4);  // as left_gyro_bias() says it

KeyframeId nth_keyframe(int i) { return KeyframeId{static_cast<std::uint32_t>(i)}; }

/// A ring walked around once, one keyframe a second, its heading wrong as it is told.
struct Walked {
  explicit Walked(const std::function<double(int)>& heading_rad, int coasted_at = -1) : ring(51) {
    map = ring.walk(
        {.keyframes = kKeyframes, .coasted_at = coasted_at, .drift_m = 0, .drift_rad = 0});
    for (int i = 0; i < kKeyframes; ++i)
      truth.push_back(map.keyframe(nth_keyframe(i)).T_camera_world);
    std::vector<SE3> bent = {truth[0]};
    for (int i = 1; i < kKeyframes; ++i) {
      const SE3 turn(so3_exp({0, heading_rad(i) - heading_rad(i - 1), 0}), Vec3::Zero());
      bent.push_back(turn * truth[i] * truth[i - 1].inverse() * bent.back());
      map.set_pose(nth_keyframe(i), bent.back());
    }
  }
  /// By a gyroscope of that bias. @param begins_anew at this keyframe.
  void measure(const Vec3& bias, int begins_anew = kKeyframes) {
    Rng rng(3);
    Mat3 R_camera_start = Mat3::Identity();
    for (int i = 0; i < kKeyframes; ++i) {
      auto data = std::make_shared<KeyframeData>(*map.keyframe(nth_keyframe(i)).data);
      data->stamp = {to_ns(i)};
      if (i == begins_anew) {
        R_camera_start.setIdentity();
      } else if (i > 0) {
        R_camera_start = so3_exp(bias + random_normals<3>(rng, 1e-4)) * truth[i].R() *
                         truth[i - 1].R().transpose() * R_camera_start;
      }
      const bool is_second = i >= begins_anew;
      data->turn = {is_second ? 2U : 1U, R_camera_start, 1e-8 * (is_second ? i - begins_anew : i)};
      map.set_data(nth_keyframe(i), data);
    }
  }
  [[nodiscard]] double worst_m() const {
    double worst = 0;
    for (int i = 0; i < kKeyframes; ++i)
      worst = std::max(
          worst, (map.keyframe(nth_keyframe(i)).position_world() - truth[i].inverse().t()).norm());
    return worst;
  }

  loop_test::RingWorld ring;
  Map map{{map_test::kLevels, map_test::kScale}};
  std::vector<SE3> truth;
};

/// It is off by that much from one keyframe on.
std::function<double(int)> jump(double rad) {
  return [rad](int i) { return i >= 15 ? rad : 0; };
}

TEST(MapStraightening, AJumpOfTheHeadingIsTakenOut) {
  Walked walked(jump(0.08));
  walked.measure(kBias);
  const double before_m = walked.worst_m();
  const auto patch = straightened(walked.map, kMinShared, 0);
  ASSERT_TRUE(patch);
  walked.map.apply(*patch);
  EXPECT_GT(before_m, 0.1);
  EXPECT_LT(walked.worst_m(), 0.2 * before_m);
}

TEST(MapStraightening, TheBiasIsFoundThoughTheMapJumps) {
  Walked walked(jump(0.08));
  walked.measure(kBias);
  const auto found = left_gyro_bias(walked.map);
  ASSERT_TRUE(found);
  EXPECT_LT((*found - kBias).norm(), 1e-4);
}

TEST(MapStraightening, SeveralSeriesHoldTheMapEachByItself) {
  Walked walked(jump(0.08));
  walked.measure(kBias, 25);
  const auto found = left_gyro_bias(walked.map);
  ASSERT_TRUE(found);
  EXPECT_LT((*found - kBias).norm(), 1e-4);
  const double before_m = walked.worst_m();
  const auto patch = straightened(walked.map, kMinShared, 0);
  ASSERT_TRUE(patch);
  walked.map.apply(*patch);
  EXPECT_LT(walked.worst_m(), 0.2 * before_m);
}

TEST(MapStraightening, BetweenTwoSeriesNobodyKnowsTheTurn) {
  Walked walked(jump(0.08));
  walked.measure(kBias, 15);
  const double before_m = walked.worst_m();
  if (const auto patch = straightened(walked.map, kMinShared, 0)) walked.map.apply(*patch);
  EXPECT_NEAR(walked.worst_m(), before_m, 0.05 * before_m);
}

TEST(MapStraightening, GivenUpItChangesNothing) {
  Walked walked(jump(0.08));
  walked.measure(kBias);
  std::atomic<bool> abort{true};
  EXPECT_FALSE(straightened(walked.map, kMinShared, 0, &abort));
  abort.store(false);
  EXPECT_TRUE(straightened(walked.map, kMinShared, 0, &abort));
}

TEST(MapStraightening, AMapThatIsRightStaysSo) {
  Walked walked(jump(0));
  walked.measure(kBias);
  const auto patch = straightened(walked.map, kMinShared, 0);
  ASSERT_TRUE(patch);
  walked.map.apply(*patch);
  EXPECT_LT(walked.worst_m(), 0.005);
}

// What lies behind it is tilted as a whole, as gravity says; it does not bend at its seam.
TEST(MapStraightening, WhereNothingWasSeenTheMapGivesWay) {
  constexpr int kCoasted = 30;
  Walked walked(jump(0), kCoasted);
  walked.measure(kBias);
  const SE3 tilt(so3_exp({0.05, 0, 0}), Vec3::Zero());
  for (int i = 0; i < kKeyframes; ++i) {
    const KeyframeId id = nth_keyframe(i);
    auto data = std::make_shared<KeyframeData>(*walked.map.keyframe(id).data);
    data->gravity = {-walked.truth[i].R().col(2), 25e-6 * Mat3::Identity()};
    if (i >= kCoasted) {
      data->turn->series = 2;
      walked.map.set_pose(
          id, walked.truth[i] * walked.truth[kCoasted].inverse() * tilt * walked.truth[kCoasted]);
    }
    walked.map.set_data(id, data);
  }
  walked.map.set_motion(nth_keyframe(kCoasted),
                        {nth_keyframe(kCoasted - 1),
                         walked.map.keyframe(nth_keyframe(kCoasted)).T_camera_world *
                             walked.truth[kCoasted - 1].inverse(),
                         0.01 * Mat6::Identity()});
  const auto patch = straightened(walked.map, kMinShared, 0);
  ASSERT_TRUE(patch);
  walked.map.apply(*patch);
  for (int i = 0; i < kKeyframes; ++i) {
    const Vec3 up = walked.map.keyframe(nth_keyframe(i)).T_camera_world.R().col(2);
    EXPECT_LT((up - walked.truth[i].R().col(2)).norm(), 0.01) << i;
  }
}

TEST(MapStraightening, AMapOfOneRoomIsLeft) {
  Walked walked(jump(0.08));
  walked.measure(kBias);
  EXPECT_FALSE(straightened(walked.map, kMinShared));
}

TEST(MapStraightening, WithoutAGyroscopeNothingIsSaid) {
  const Walked walked(jump(0.08));
  EXPECT_FALSE(left_gyro_bias(walked.map));
  EXPECT_FALSE(straightened(walked.map, kMinShared, 0));
  EXPECT_FALSE(straightened(Map({map_test::kLevels, map_test::kScale}), kMinShared, 0));
}

}  // namespace
}  // namespace ygslam
