#include "system/pose_drift.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace ygslam {
namespace {

class PoseDriftTest : public ::testing::Test {
 protected:
  /// A tenth of a second on. @param reference keyframe; the camera is so far from it.
  PoseDoubt see(std::uint32_t reference, double from_it_m,
                TrackState state = TrackState::kTracking) {
    TrackResult result;
    result.state = state;
    result.matches = 100;
    result.covariance = seen_m2_ * Mat6::Identity();
    result.pose = {KeyframeId{reference}, SE3(Mat3::Identity(), Vec3(from_it_m, 0, 0))};
    result.provisional = state == TrackState::kCoasting || provisional_;
    if (state == TrackState::kCoasting) result.covariance = coasting_m2_ * Mat6::Identity();
    now_.ns += to_ns(0.1);
    return drift_.step(now_, result, view_);
  }
  /// Along a corridor, a keyframe for each metre. @return in the end.
  PoseDoubt walk(std::uint32_t metres) {
    PoseDoubt doubt;
    for (std::uint32_t i = 0; i < metres; ++i)
      for (const double m : {0.2, 0.6, 1.0}) doubt = see(i, m);
    return doubt;
  }
  /// In view beside the others. @param x_m its place. @param room all that is in it is seen.
  void show(std::uint32_t keyframe, double x_m, int room = 0) {
    auto data = std::make_shared<KeyframeData>();
    data->id = KeyframeId{keyframe};
    std::vector<std::int32_t> landmarks(20, -1);
    std::iota(landmarks.begin() + 2, landmarks.end(), 100 * room);
    view_.keyframes.push_back(
        {std::move(data), SE3(Mat3::Identity(), Vec3(-x_m, 0, 0)), std::move(landmarks), 0});
  }
  LocalView view_;
  PoseDrift drift_;
  Timestamp now_{0};
  double seen_m2_ = 1e-6, coasting_m2_ = 0.01;
  bool provisional_ = false;
};

TEST_F(PoseDriftTest, GrowsOnNewGround) {
  EXPECT_EQ(see(0, 0).map.position_m2, 0);
  const PoseDoubt ten = walk(10);
  EXPECT_GT(ten.map.position_m2, 0);
  EXPECT_GT(ten.odom.position_m2, ten.map.position_m2);
  const PoseDoubt twenty = walk(20);
  EXPECT_NEAR(twenty.map.position_m2, ten.map.position_m2 * 19 / 9, 1e-9);
}

/// In a bare corridor, with few points.
TEST_F(PoseDriftTest, GroundThatIsSeenWorseDriftsMore) {
  const PoseDoubt well = walk(10);
  drift_.reset();
  seen_m2_ = 4e-6;
  const PoseDoubt badly = walk(10);
  EXPECT_NEAR(badly.map.position_m2, 4 * well.map.position_m2, 1e-9);
  EXPECT_NEAR(badly.odom.rotation_rad2, 4 * well.odom.rotation_rad2, 1e-9);
}

TEST_F(PoseDriftTest, OneFrameSeenBadlyTellsLittleOfTheGround) {
  const PoseDoubt well = walk(30);
  drift_.reset();
  walk(20);
  seen_m2_ = 1e-4;
  see(19, 1.0);
  seen_m2_ = 1e-6;
  EXPECT_LT(walk(30).map.position_m2, 2 * well.map.position_m2);
}

/// The second frame of a run is tracked before there is a keyframe.
TEST_F(PoseDriftTest, AFrameWithoutAKeyframeTellsNothingOfTheGround) {
  const PoseDoubt expected = walk(10);
  drift_.reset();
  see(index(kNoKeyframe), 0);
  const PoseDoubt doubt = walk(10);
  EXPECT_GT(expected.map.position_m2, 0);
  EXPECT_NEAR(doubt.map.position_m2, expected.map.position_m2, 1e-9);
}

TEST_F(PoseDriftTest, KnownGroundIsAsWellKnownAsItWas) {
  walk(4);
  const PoseDoubt before = see(3, 0.5);
  const PoseDoubt far = walk(20);
  const PoseDoubt again = see(3, 0.5);
  EXPECT_EQ(again.map.position_m2, before.map.position_m2);
  EXPECT_LT(again.map.position_m2, far.map.position_m2 / 4);
  EXPECT_GE(again.odom.position_m2, far.odom.position_m2) << "odom does not go back";
}

TEST_F(PoseDriftTest, ANewKeyframeThatShowsOldGroundIsToldByIt) {
  const PoseDoubt far = walk(20);
  show(20, 0.5);
  show(0, 0.2);
  show(19, 19, 1);
  const PoseDoubt back = see(20, 0);
  EXPECT_LT(back.map.position_m2, far.map.position_m2 / 10);
  EXPECT_GT(back.map.position_m2, 0);
}

TEST_F(PoseDriftTest, OdomIsNeverMoreCertainThanAfterCoastingOrALoss) {
  const PoseDoubt before = walk(3);
  see(2, 1, TrackState::kCoasting);
  const PoseDoubt coasted = see(2, 1);
  EXPECT_NEAR(coasted.odom.position_m2, before.odom.position_m2 + coasting_m2_, 1e-9);
  EXPECT_EQ(coasted.map.position_m2, before.map.position_m2) << "it sees ground that it knows";
  for (int i = 0; i < 10; ++i) see(2, 1, TrackState::kLost);
  const PoseDoubt found = see(2, 1);
  EXPECT_GT(found.odom.position_m2, coasted.odom.position_m2 + 0.2) << "a second in a hand";
  EXPECT_GE(walk(5).odom.position_m2, found.odom.position_m2);
}

TEST_F(PoseDriftTest, GroundThatWasCoastedToIsAsUncertainAsThePrediction) {
  const PoseDoubt sure = walk(3);
  see(2, 1, TrackState::kCoasting);
  provisional_ = true;  // until it sees known ground
  const double there_m2 = see(3, 0).map.position_m2;
  EXPECT_GT(there_m2, sure.map.position_m2 + coasting_m2_);
  EXPECT_LT(there_m2, sure.map.position_m2 + 1.1 * coasting_m2_);
  EXPECT_GE(see(4, 0).map.position_m2, there_m2);
  EXPECT_NEAR(see(2, 1).map.position_m2, sure.map.position_m2, 1e-9) << "seen again";
}

/// Mapping runs beside: keyframes of the place before are in view, and frames are told by them
/// until there is one that shows what is seen.
TEST_F(PoseDriftTest, KeyframesThatShowAnotherPlaceDoNotMakeItCertain) {
  const double sure_m2 = walk(3).map.position_m2;
  see(2, 1, TrackState::kCoasting);
  provisional_ = true;
  for (std::uint32_t i = 0; i < 3; ++i) show(i, i);
  EXPECT_GE(see(2, 1).map.position_m2, sure_m2 + coasting_m2_);
  show(3, 3, 1);
  const double there_m2 = see(3, 0).map.position_m2;
  EXPECT_GE(there_m2, sure_m2 + coasting_m2_);
  EXPECT_LT(there_m2, sure_m2 + 1.1 * coasting_m2_) << "counted once";
  show(4, 3.2, 1);
  EXPECT_GE(see(4, 0).map.position_m2, there_m2);
}

TEST_F(PoseDriftTest, APlaceThatIsNotCertainIsNotCertainInTheMap) {
  const PoseDoubt sure = walk(3);
  see(2, 1, TrackState::kLost);
  provisional_ = true;
  EXPECT_GT(see(2, 1).map.position_m2, sure.map.position_m2 + 0.1);
  provisional_ = false;
  EXPECT_NEAR(see(2, 1).map.position_m2, sure.map.position_m2, 1e-9);
}

TEST_F(PoseDriftTest, AVeryLongRunKnowsItsGroundAboutAsWell) {
  walk(3000);
  const double middle_m2 = see(1500, 0).map.position_m2;
  see(2999, 1);
  walk(30000);
  EXPECT_LE(drift_.grounds(), 8192U);
  EXPECT_NEAR(see(1500, 0).map.position_m2, middle_m2, 0.05 * middle_m2);
}

}  // namespace
}  // namespace ygslam
