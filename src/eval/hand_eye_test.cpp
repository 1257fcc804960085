#include "eval/hand_eye.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/rng.hpp"
#include "eval/report.hpp"
#include "geometry/properties_testing.hpp"

namespace ygslam {
namespace {

using namespace properties;

enum class Turning { kFreely, kAboutUp, kNot };

// A camera's smooth path over ten seconds.
std::vector<StampedPose> camera_path(Rng& rng, Turning turning = Turning::kFreely,
                                     std::size_t count = 300) {
  std::vector<StampedPose> poses;
  SE3 T;
  Vec6 speed = Vec6::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    poses.push_back({{static_cast<std::int64_t>(i) * 33'333'333}, T});
    for (int k = 0; k < 6; ++k) speed[k] = 0.9 * speed[k] + rng.uniform(-0.01, 0.01);
    if (turning == Turning::kAboutUp) speed[2] = speed[3] = speed[4] = 0;
    if (turning == Turning::kNot) speed.tail<3>().setZero();
    T = T * SE3::exp(speed);
  }
  return poses;
}

// The truth of a body on which the camera stands at X, in another world.
std::vector<StampedPose> body_path(const std::vector<StampedPose>& camera, const SE3& X,
                                   const SE3& T_truth_world) {
  std::vector<StampedPose> body = camera;
  for (StampedPose& pose : body)
    pose.T_world_camera = T_truth_world * pose.T_world_camera * X.inverse();
  return body;
}

std::vector<StampedPose> noisy(std::vector<StampedPose> poses, double size, Rng& rng) {
  SE3 drift;
  for (StampedPose& pose : poses) {
    Vec6 noise, step;
    for (int k = 0; k < 6; ++k) noise[k] = rng.uniform(-size, size);
    for (int k = 0; k < 6; ++k) step[k] = rng.uniform(-size, size) / 10;
    drift = drift * SE3::exp(step);
    pose.T_world_camera = drift * pose.T_world_camera * SE3::exp(noise);
  }
  return poses;
}

double distance(const SE3& a, const SE3& b) {
  return (a.R() - b.R()).norm() + (a.t() - b.t()).norm();
}

RC_GTEST_PROP(HandEye, FindsTheTransformOfMotionsThatFitExactly, ()) {
  Rng rng(*rc::gen::inRange(0, 1000));
  const SE3 X = pose();
  const auto camera = camera_path(rng);
  const auto found = solve_hand_eye(motions_of({body_path(camera, X, pose()), camera}));
  RC_ASSERT(found.has_value());
  RC_ASSERT(distance(*found, X) < 1e-6 * (1 + X.t().norm()));
}

RC_GTEST_PROP(HandEye, ForgetsTheWorldsOfBoth, ()) {
  Rng rng(*rc::gen::inRange(0, 1000));
  const auto camera = noisy(camera_path(rng), 2e-3, rng);
  const auto body = body_path(camera_path(rng), motion(3, 0.5), SE3());
  const auto before = solve_hand_eye(motions_of({body, camera}));
  const auto after = solve_hand_eye(
      motions_of({body_path(body, SE3(), pose()), body_path(camera, SE3(), pose())}));
  RC_ASSERT(before.has_value() == after.has_value());
  if (before) RC_ASSERT(distance(*before, *after) < 1e-6 * (1 + before->t().norm()));
}

RC_GTEST_PROP(HandEye, OutliersHardlyMatter, ()) {
  Rng rng(*rc::gen::inRange(0, 1000));
  const SE3 X = motion(3, 0.5);
  const auto camera = camera_path(rng);
  auto body = body_path(camera, X, pose());
  const std::size_t lost = 100;  // a jump of the estimate: 30 of the motions span it
  for (std::size_t i = lost; i < body.size(); ++i)
    body[i].T_world_camera = SE3(so3_exp({0.5, 0.2, 0}), {1, 0, 0}) * body[i].T_world_camera;
  const auto found = find_body_offset({body, camera});
  RC_ASSERT(found.has_value() || X.angle() < 0.05);
  if (found) RC_ASSERT(distance(*found, X) < 0.02);
}

RC_GTEST_PROP(HandEye, ATurnAboutOneAxisIsEnoughWhereThePathBends, ()) {
  Rng rng(*rc::gen::inRange(0, 1000));
  const SE3 X = motion(3, 0.5);
  const auto camera = camera_path(rng, Turning::kAboutUp);
  const auto body = body_path(camera, X, pose());
  const auto found = solve_hand_eye(motions_of({body, camera}));
  RC_ASSERT(found.has_value());
  for (const BodyMotion& m : motions_of({body, camera}))
    RC_ASSERT(distance(found->inverse() * m.body * *found, m.camera) < 1e-4);
}

RC_GTEST_PROP(BodyOffset, IsTakenOutOfNoisyEstimates, ()) {
  Rng rng(*rc::gen::inRange(0, 1000));
  const SE3 X(so3_exp(real(0.5, 3.1) * direction()), vector(0.2));
  const auto camera = camera_path(rng, Turning::kFreely, 600);
  const auto report =
      evaluate(body_path(camera, X, pose()), noisy(camera, 1e-3, rng), {.rpe_seconds = 0.5});
  RC_ASSERT(report.ok() && report->body.has_value());
  RC_ASSERT((report->body->T_body_camera.inverse() * X).angle() < 0.02);
  RC_ASSERT((report->body->T_body_camera.t() - X.t()).norm() < 0.02);
  RC_ASSERT(report->rpe_frames->rot_deg.rmse < 0.5);
  RC_ASSERT(report->rpe_frames->trans_m.rmse < 0.01);
  RC_ASSERT(report->ate_rot_deg.rmse < 0.1 * report->body->ate_rot_deg_as_given.rmse);
}

RC_GTEST_PROP(BodyOffset, IsNotFoundWhereTheBodiesAreOne, ()) {
  Rng rng(*rc::gen::inRange(0, 1000));
  const auto turning = *rc::gen::element(Turning::kFreely, Turning::kAboutUp, Turning::kNot);
  const auto camera = camera_path(rng, turning);
  const double noise = *rc::gen::element(0.0, 1e-7, 1e-3, 3e-2);
  RC_ASSERT(!find_body_offset({body_path(camera, SE3(), pose()), noisy(camera, noise, rng)}));
}

// What a tracking system's calibration leaves belongs to the recording: its published figures stay.
TEST(BodyOffset, AFewDegreesWithinTheErrorsStay) {
  Rng rng(3);
  const auto camera = camera_path(rng);
  const SE3 X(so3_exp({0.01, 0.01, 0}), {0.005, 0, 0});
  EXPECT_FALSE(find_body_offset({body_path(camera, X, SE3()), noisy(camera, 1e-2, rng)}));
}

TEST(BodyOffset, NothingIsToldOfOneThatIsNotThere) {
  Rng rng(4);
  const auto camera = camera_path(rng);
  const auto json = to_json(*evaluate(camera, noisy(camera, 1e-3, rng)));
  EXPECT_FALSE(json.contains("body"));
  EXPECT_TRUE(json["warnings"].empty()) << json["warnings"];
}

TEST(BodyOffset, IsToldAndCanBeDeclined) {
  Rng rng(5);
  const auto camera = camera_path(rng);
  const SE3 X(so3_exp({0, 3, 0.3}), {0, 0.1, 0});
  const auto truth = body_path(camera, X, SE3());
  const auto report = evaluate(truth, camera);
  ASSERT_TRUE(report->body.has_value());
  EXPECT_NE(report->warnings.front().find("a body turned by 172.7 deg"), std::string::npos)
      << report->warnings.front();
  EXPECT_NE(report->warnings.front().find("offset by 0.100 m"), std::string::npos);
  const auto as_given = evaluate(truth, camera, {.same_body = true});
  EXPECT_FALSE(as_given->body.has_value());
  EXPECT_EQ(as_given->ate_m.rmse, report->ate_m.rmse) << "positions are compared as given";
  EXPECT_EQ(as_given->rpe_frames->rot_deg.rmse, report->body->rpe_frames_as_given->rot_deg.rmse);
  EXPECT_EQ(as_given->ate_rot_deg.rmse, report->body->ate_rot_deg_as_given.rmse);
}

RC_GTEST_PROP(Mirror, IsToldWithBothFiguresAndUndone, ()) {
  Rng rng(*rc::gen::inRange(0, 1000));
  const auto camera = camera_path(rng);
  const auto estimate = noisy(camera, 1e-3, rng);
  const auto truth = mirrored(body_path(camera, SE3(), pose()));
  const auto report = evaluate(truth, estimate);
  RC_ASSERT(report->warnings.size() == 1U);
  RC_ASSERT(report->warnings.front().find("the truth is mirrored") != std::string::npos);
  const auto undone = evaluate(truth, estimate, {.mirrored_truth = true});
  RC_ASSERT(undone->warnings.empty());
  const auto direct = evaluate(mirrored(truth), estimate);
  RC_ASSERT(undone->ate_m.rmse == direct->ate_m.rmse && undone->ate_m.rmse < 0.05);
  RC_ASSERT(undone->rpe_frames->rot_deg.rmse < 1);
}

/// What a reader makes of a file that was written otherwise than it takes it.
std::vector<StampedPose> misread(std::vector<StampedPose> poses, PoseReading written) {
  for (StampedPose& pose : poses) {
    SE3& T = pose.T_world_camera;
    const bool is_inverse =
        written == PoseReading::kInverse || written == PoseReading::kInverseWFirst;
    if (is_inverse) T = T.inverse();
    const Eigen::Quaterniond q = T.quaternion();
    if (written == PoseReading::kWLast)
      T = SE3(Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()), T.t());
    else if (written != PoseReading::kInverse)
      T = SE3(Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), T.t());
  }
  return poses;
}

bool is_as_read(const PosePairs& pairs) {
  return better_reading(pairs).reading == PoseReading::kAsRead;
}

SE3 any_pose(Rng& rng, double size) {
  Vec6 twist;
  for (int k = 0; k < 6; ++k) twist[k] = rng.uniform(-size, size);
  return SE3::exp(twist);
}

TEST(Reading, OtherOrdersAndInversePosesAreNamed) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    const auto camera = camera_path(rng);
    const auto estimate = noisy(camera, 1e-3, rng);
    const SE3 T_other_world = any_pose(rng, 2);
    const auto truth = body_path(camera, seed % 2 == 0 ? SE3() : any_pose(rng, 0.2), T_other_world);
    for (const auto& [written, words] :
         {std::pair{PoseReading::kWFirst, " seems to have quaternions with qw first"},
          {PoseReading::kWLast, " seems to have quaternions with qw last"},
          {PoseReading::kInverse, "(to be inverted)"},
          {PoseReading::kInverseWFirst, "T_camera_world, with qw first"}}) {
      const auto wrong = misread(truth, written);
      ASSERT_LT(distance(read_otherwise(wrong, written)[7].T_world_camera, truth[7].T_world_camera),
                1e-9);
      const bool w_first = written == PoseReading::kWLast;
      const auto report = evaluate(wrong, estimate, {.w_first = {.truth = w_first}});
      ASSERT_TRUE(report.ok() && report->warnings.size() == 1U) << seed;
      EXPECT_NE(report->warnings.front().find(words), std::string::npos)
          << seed << ": " << report->warnings.front();
      EXPECT_EQ(report->warnings.front().find("the truth"), 0U) << report->warnings.front();
      EXPECT_FALSE(report->body.has_value());
      const auto other =
          evaluate(truth, misread(estimate, written), {.w_first = {.estimate = w_first}});
      ASSERT_EQ(other->warnings.size(), 1U) << seed;
      EXPECT_NE(other->warnings.front().find("the estimate"), std::string::npos)
          << seed << ": " << other->warnings.front();
    }
    EXPECT_TRUE(is_as_read({truth, estimate})) << seed;
    EXPECT_TRUE(is_as_read({mirrored(truth), estimate})) << seed;
  }
}

TEST(Reading, AMirrorAndAnotherOrderAreToldApart) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    // Turns mostly about one axis, as of a camera held in the hand that looks about.
    auto camera = camera_path(rng, Turning::kAboutUp);
    for (StampedPose& pose : camera) {
      Vec6 nod = Vec6::Zero();
      nod[3] = 0.05 * std::sin(1e-9 * static_cast<double>(pose.stamp.ns));
      pose.T_world_camera = pose.T_world_camera * SE3::exp(nod);
    }
    const auto estimate = noisy(camera, 1e-3, rng);
    const auto told = [&](const std::vector<StampedPose>& truth) {
      const auto report = evaluate(truth, estimate);
      return report->warnings.empty() ? std::string() : report->warnings.front();
    };
    EXPECT_NE(told(misread(camera, PoseReading::kWFirst)).find("qw first"), std::string::npos)
        << seed << told(misread(camera, PoseReading::kWFirst));
    EXPECT_NE(told(mirrored(camera)).find("is mirrored"), std::string::npos)
        << seed << told(mirrored(camera));
  }
}

TEST(Reading, PositionsInOtherUnitsAreNamed) {
  Rng rng(3);
  const auto truth = camera_path(rng);
  const auto scaled = [&](double factor) {
    auto estimate = noisy(truth, 1e-3, rng);
    for (StampedPose& pose : estimate)
      pose.T_world_camera = SE3(pose.T_world_camera.R(), factor * pose.T_world_camera.t());
    const auto report = evaluate(truth, estimate);
    return report->warnings.empty() ? std::string() : report->warnings.front();
  };
  EXPECT_EQ(scaled(1000),
            "the positions of the estimate seem to be millimetres, which are read as metres");
  EXPECT_EQ(scaled(0.01),
            "the positions of the truth seem to be centimetres, which are read as metres");
  EXPECT_EQ(scaled(1), "");
}

TEST(Reading, APoorEstimateStaysWhatItIs) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Rng rng(seed);
    const auto turning = std::array{Turning::kFreely, Turning::kAboutUp, Turning::kNot}[seed % 3];
    const auto camera = camera_path(rng, turning);
    EXPECT_TRUE(is_as_read({camera, noisy(camera, 0.05, rng)})) << seed;
    EXPECT_TRUE(is_as_read({camera, camera_path(rng, turning)})) << seed << ", another recording's";
  }
}

TEST(Mirror, IsNotSeenWhereAllTurnsHaveOneAxis) {
  Rng rng(6);
  const auto camera = camera_path(rng, Turning::kAboutUp);
  EXPECT_FALSE(is_mirrored({camera, noisy(camera, 1e-3, rng)}));
}

}  // namespace
}  // namespace ygslam
