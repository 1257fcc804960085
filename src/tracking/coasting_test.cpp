#include "tracking/coasting.hpp"

#include <gtest/gtest.h>

#include "tracking/inertial_verdict.hpp"

namespace ygslam {
namespace {

Timestamp stamp_of(double s) { return {to_ns(s)}; }

SE3 moved_by(double x_m, double turn_rad = 0) {
  return SE3(so3_exp(Vec3(0, turn_rad, 0)), Vec3(x_m, 0, 0)).inverse();
}

TEST(Coasting, EachFrameGetsItsShareOfTheDrift) {
  Coasting coasting;
  for (int i = 1; i <= 3; ++i)
    coasting.add(FrameId(10 + i), stamp_of(i), moved_by(0.1 * i, 0.02 * i));
  const KeyframeRelativePose last{KeyframeId(5), moved_by(1)};
  // At 4 s it is not at 0.4 m, as predicted, but at 0.48, turned by 0.01 rad more.
  const auto placed = coasting.found_again(last, stamp_of(0), stamp_of(4), moved_by(0.48, 0.09),
                                           moved_by(0.4, 0.08));
  ASSERT_EQ(placed.size(), 3U);
  for (int i = 1; i <= 3; ++i) {
    const RetrackedFrame& frame = placed[static_cast<std::size_t>(i - 1)];
    EXPECT_EQ(frame.frame, FrameId(10 + i));
    EXPECT_EQ(frame.pose.reference, KeyframeId(5));
    const SE3 T_last_frame =
        (frame.pose.T_camera_reference * last.T_camera_reference.inverse()).inverse();
    const double share = i / 4.0;
    EXPECT_NEAR(T_last_frame.t().x(), 0.1 * i + share * share * 0.08, 1e-12);
    EXPECT_NEAR(so3_log(T_last_frame.R()).y(), 0.02 * i + share * 0.01, 1e-12);
  }
  EXPECT_TRUE(coasting.found_again(last, stamp_of(4), stamp_of(5), SE3(), SE3()).empty());
}

PosePrediction prediction(double std_m, double unseen_s = 1) {
  PosePrediction predicted;
  predicted.covariance = Mat6::Identity() * std_m * std_m;
  predicted.unseen_s = unseen_s;
  predicted.trusted = true;
  return predicted;
}

TEST(InertialVerdict, APredictionCountsWhileItIsCertain) {
  EXPECT_FALSE(while_certain(std::nullopt));
  EXPECT_TRUE(while_certain(prediction(0.2)));
  EXPECT_FALSE(while_certain(prediction(0.3))) << "on each of three axes";
  EXPECT_FALSE(while_certain(prediction(0.01, 9)));
}

TEST(InertialVerdict, AgreesWithWhatLiesWithinItsCovariance) {
  const auto verdict = [](double error_m, bool trusted = true) {
    PosePrediction predicted = prediction(0.02);
    predicted.trusted = trusted;
    return verdict_of(predicted, SeenCamera{moved_by(error_m)}, SE3());
  };
  EXPECT_TRUE(verdict(0.05).agrees);
  EXPECT_FALSE(verdict(0.3).agrees);
  EXPECT_TRUE(verdict(0).may_coast);
  EXPECT_FALSE(verdict(0, false).may_coast);
  EXPECT_FALSE(verdict_of(std::nullopt, SeenCamera{}, SE3()).may_coast);
  EXPECT_FALSE(verdict_of(prediction(1), std::nullopt, SE3()).agrees);
}

TEST(InertialVerdict, OnlyOneThatAgreedForSecondsContradicts) {
  PosePrediction predicted = prediction(0.002);
  const SeenCamera elsewhere{moved_by(0.2)};
  EXPECT_EQ(verdict_of(predicted, elsewhere, SE3()).nis, 0);
  predicted.agreed = true;
  const InertialVerdict verdict = verdict_of(predicted, elsewhere, SE3());
  EXPECT_GT(verdict.nis, 1000);
  EXPECT_EQ(verdict.earlier_nis, 0) << "there is none";
  EXPECT_LT(verdict_of(predicted, SeenCamera{}, SE3()).nis, 1e-9);
  // A few corners on a white wall lie where they happen to.
  const SeenCamera unsure{moved_by(0.2), 0.03 * 0.03 * Mat6::Identity()};
  EXPECT_LT(verdict_of(predicted, unsure, SE3()).nis, 10);
}

TEST(InertialVerdict, OfTwoPredictionsEachIsHeldAgainstThePoseInOdom) {
  PosePrediction predicted = prediction(0.002);
  predicted.agreed = true;
  predicted.T_odom_camera = moved_by(1.2);
  predicted.earlier = {{moved_by(1), predicted.covariance}};
  const InertialVerdict verdict = verdict_of(predicted, SeenCamera{}, SE3());
  EXPECT_LT(verdict.nis, 1e-9) << "it is where the newest has it";
  EXPECT_GT(verdict.earlier_nis, 1000);
  const SeenCamera back{moved_by(0.2)};
  EXPECT_LT(verdict_of(predicted, back, SE3()).earlier_nis, 1e-9);
}

}  // namespace
}  // namespace ygslam
