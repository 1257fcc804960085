#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/rng.hpp"
#include "eval/report.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

using Trajectory = std::vector<StampedPose>;

Vec6 random_twist(double size, Rng& rng) {
  Vec6 twist;
  for (int i = 0; i < 6; ++i) twist[i] = rng.uniform(-size, size);
  return twist;
}

// A wandering camera with jittered stamps.
Trajectory random_walk(std::size_t count, Rng& rng, double interval_s = 1.0 / 30) {
  Trajectory poses;
  SE3 pose = SE3::exp(random_twist(2, rng));
  for (std::size_t i = 0; i < count; ++i) {
    const double t =
        100.0 + static_cast<double>(i) * interval_s + rng.uniform(-0.2, 0.2) * interval_s;
    poses.push_back({{to_ns(t)}, pose});
    pose = pose * SE3::exp(random_twist(0.05, rng));
  }
  return poses;
}

// The truth seen by a tracker: noise on pose and stamp, some poses lost.
Trajectory disturbed(const Trajectory& truth, double size, Rng& rng) {
  Trajectory estimate;
  for (const StampedPose& pose : truth) {
    if (rng.below(10) == 0) continue;
    estimate.push_back({{pose.stamp.ns + static_cast<std::int64_t>(rng.uniform(-4e6, 4e6))},
                        pose.T_world_camera * SE3::exp(random_twist(size, rng))});
  }
  return estimate;
}

Trajectory moved(const SE3& T, const Trajectory& poses, double scale = 1.0) {
  Trajectory result = poses;
  for (StampedPose& pose : result) {
    pose.T_world_camera = T * SE3(pose.T_world_camera.R(), Vec3(scale * pose.T_world_camera.t()));
  }
  return result;
}

double rmse_of(const Trajectory& truth, const Trajectory& estimate, AlignMode mode) {
  return evaluate(truth, estimate, {.align = mode})->ate_m.rmse;
}

TEST(Associate, EachStampOfTheShorterTakesItsNearest) {
  Rng rng(1);
  for (int round = 0; round < 100; ++round) {
    const Trajectory a = random_walk(5 + rng.below(40), rng, 0.03);
    const Trajectory b = random_walk(5 + rng.below(40), rng, 0.02);
    const double max_diff_s = rng.uniform(0.001, 0.02);
    const Trajectory& shorter = a.size() < b.size() ? a : b;
    const Trajectory& longer = a.size() < b.size() ? b : a;
    std::vector<std::pair<std::int64_t, std::int64_t>> expected;
    for (const StampedPose& pose : shorter) {
      const auto nearest = std::min_element(longer.begin(), longer.end(), [&](auto& x, auto& y) {
        return std::llabs(x.stamp.ns - pose.stamp.ns) < std::llabs(y.stamp.ns - pose.stamp.ns);
      });
      if (std::llabs(nearest->stamp.ns - pose.stamp.ns) > to_ns(max_diff_s)) continue;
      expected.emplace_back(pose.stamp.ns, nearest->stamp.ns);
    }
    const PosePairs pairs = associate(a, b, max_diff_s);
    ASSERT_EQ(pairs.size(), expected.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const bool a_is_shorter = a.size() < b.size();
      EXPECT_EQ((a_is_shorter ? pairs.truth : pairs.estimate)[i].stamp.ns, expected[i].first);
      EXPECT_EQ((a_is_shorter ? pairs.estimate : pairs.truth)[i].stamp.ns, expected[i].second);
    }
  }
}

TEST(Coverage, CountsFramesThatHaveTheirOwnPose) {
  std::vector<Timestamp> frames;
  Trajectory estimate;
  for (int i = 0; i < 100; ++i) {
    frames.push_back({i * std::int64_t{10'000'000}});  // 100 Hz: neighbours lie within max_diff
    if (i % 4 != 0) estimate.push_back({{frames.back().ns + 1000}, SE3()});
  }
  EXPECT_DOUBLE_EQ(coverage(frames, estimate, 0.02), 0.75);
  EXPECT_DOUBLE_EQ(coverage(frames, {}, 0.02), 0.0);
  EXPECT_DOUBLE_EQ(coverage({}, estimate, 0.02), 0.0);
}

TEST(Align, FindsTheMotionAndScaleThatWereApplied) {
  Rng rng(2);
  for (int round = 0; round < 50; ++round) {
    const Trajectory truth = random_walk(50, rng);
    const SE3 T = SE3::exp(random_twist(3, rng));
    const double scale = rng.uniform(0.2, 5);
    const Trajectory estimate = moved(T, truth, scale);
    const Alignment sim3 = align({truth, estimate}, AlignMode::kSim3);
    EXPECT_NEAR(sim3.scale, 1 / scale, 1e-9);
    EXPECT_LT((sim3.T_truth_estimate.R() * T.R() - Mat3::Identity()).norm(), 1e-9);
    EXPECT_LT(rmse_of(truth, estimate, AlignMode::kSim3), 1e-9);
    EXPECT_LT(rmse_of(truth, moved(T, truth), AlignMode::kSe3), 1e-9);
    EXPECT_LT(rmse_of(truth, moved(T, truth), AlignMode::kFirst), 1e-9);
  }
}

TEST(Align, NoOtherMotionGivesASmallerError) {
  Rng rng(3);
  for (int round = 0; round < 20; ++round) {
    const Trajectory truth = random_walk(40, rng);
    const PosePairs pairs{truth, moved(SE3::exp(random_twist(2, rng)), [&] {
                            Trajectory noisy = truth;
                            for (auto& p : noisy) {
                              p.T_world_camera =
                                  p.T_world_camera * SE3::exp(random_twist(0.1, rng));
                            }
                            return noisy;
                          }())};
    const Alignment best = align(pairs, AlignMode::kSe3);
    const auto cost = [&](const SE3& T) {
      double sum = 0;
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        sum += (pairs.truth[i].T_world_camera.t() - T * pairs.estimate[i].T_world_camera.t())
                   .squaredNorm();
      }
      return sum;
    };
    for (int i = 0; i < 50; ++i) {
      const SE3 other = SE3::exp(random_twist(0.01, rng)) * best.T_truth_estimate;
      EXPECT_GE(cost(other), cost(best.T_truth_estimate) - 1e-12);
    }
    EXPECT_NEAR(best.T_truth_estimate.R().determinant(), 1.0, 1e-9) << "a rotation, no mirror";
  }
}

TEST(Align, PlanarAndStraightTrajectoriesGetAProperRotation) {
  Rng rng(4);
  for (const int free_axes : {1, 2}) {
    Trajectory truth = random_walk(40, rng);
    for (auto& pose : truth) {
      Vec3 t = pose.T_world_camera.t();
      for (int axis = free_axes; axis < 3; ++axis) t[axis] = 0;
      pose.T_world_camera = {pose.T_world_camera.R(), t};
    }
    const Alignment found =
        align({truth, moved(SE3::exp(random_twist(2, rng)), truth)}, AlignMode::kSe3);
    EXPECT_NEAR(found.T_truth_estimate.R().determinant(), 1.0, 1e-9);
    EXPECT_LT(rmse_of(truth, moved(SE3::exp(random_twist(2, rng)), truth), AlignMode::kSe3), 1e-8);
  }
}

TEST(Ate, DoesNotChangeWhenEitherTrajectoryIsMovedRigidly) {
  Rng rng(5);
  for (int round = 0; round < 20; ++round) {
    const Trajectory truth = random_walk(80, rng);
    const Trajectory estimate = disturbed(truth, 0.05, rng);
    const SE3 T = SE3::exp(random_twist(3, rng));
    const double expected = rmse_of(truth, estimate, AlignMode::kSe3);
    EXPECT_GT(expected, 0.0);
    EXPECT_NEAR(rmse_of(truth, moved(T, estimate), AlignMode::kSe3), expected, 1e-9);
    EXPECT_NEAR(rmse_of(moved(T, truth), estimate, AlignMode::kSe3), expected, 1e-9);
    EXPECT_NEAR(rmse_of(truth, moved(T, estimate, 3.0), AlignMode::kSim3),
                rmse_of(truth, estimate, AlignMode::kSim3), 1e-9);
    EXPECT_LE(expected, rmse_of(truth, estimate, AlignMode::kFirst) + 1e-12);
    EXPECT_LE(expected, rmse_of(truth, estimate, AlignMode::kNone) + 1e-12);
    EXPECT_LE(rmse_of(truth, estimate, AlignMode::kSim3), expected + 1e-12);
  }
}

TEST(Rpe, DoesNotChangeWhenEitherTrajectoryIsMovedRigidly) {
  Rng rng(6);
  const Trajectory truth = random_walk(120, rng);
  const Trajectory estimate = disturbed(truth, 0.05, rng);
  const SE3 T = SE3::exp(random_twist(3, rng));
  const auto a = evaluate(truth, estimate, {.align = AlignMode::kNone});
  const auto b = evaluate(truth, moved(T, estimate), {.align = AlignMode::kNone});
  const auto c = evaluate(moved(T, truth), estimate, {.align = AlignMode::kSe3});
  for (const auto* other : {&b, &c}) {
    EXPECT_NEAR(a->rpe_frames->trans_m.rmse, (*other)->rpe_frames->trans_m.rmse, 1e-9);
    EXPECT_NEAR(a->rpe_frames->rot_deg.rmse, (*other)->rpe_frames->rot_deg.rmse, 1e-7);
    EXPECT_NEAR(a->rpe_seconds->trans_m.max, (*other)->rpe_seconds->trans_m.max, 1e-9);
  }
}

TEST(Rpe, AConstantDriftPerFrameShowsAsThirtyTimesThat) {
  Trajectory truth, estimate;
  const double drift_deg = 0.1;
  for (int i = 0; i < 100; ++i) {
    const Timestamp stamp{i * std::int64_t{33'333'333}};
    truth.push_back({stamp, SE3()});
    const double angle = i * drift_deg * std::numbers::pi / 180;
    estimate.push_back({stamp, SE3(so3_exp({0, 0, angle}), {0, 0, 0.001 * i})});
  }
  const auto report = evaluate(truth, estimate, {.align = AlignMode::kNone});
  EXPECT_NEAR(report->rpe_frames->trans_m.rmse, 0.03, 1e-12);
  EXPECT_NEAR(report->rpe_frames->trans_m.std, 0.0, 1e-12);
  EXPECT_NEAR(report->rpe_frames->rot_deg.mean, 3.0, 1e-9);
  EXPECT_EQ(report->rpe_frames->trans_m.count, 70U);
  EXPECT_NEAR(report->rpe_seconds->trans_m.rmse, 0.03, 1e-12);
}

TEST(Rpe, SecondsPairsAgreeWithBruteForceAndLeaveGapsOut) {
  Rng rng(7);
  for (int round = 0; round < 30; ++round) {
    Trajectory poses = random_walk(100, rng, rng.uniform(0.02, 0.2));
    poses.erase(poses.begin() + 40, poses.begin() + 40 + rng.below(20));
    const double tolerance_s = rng.uniform(0.01, 0.1);
    IndexPairs expected;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      std::size_t best = 0;
      const auto off = [&](std::size_t j) {
        return std::llabs(poses[j].stamp.ns - poses[i].stamp.ns - 1'000'000'000);
      };
      for (std::size_t j = 1; j < poses.size(); ++j) best = off(j) < off(best) ? j : best;
      if (best > i && off(best) <= to_ns(tolerance_s)) expected.emplace_back(i, best);
    }
    EXPECT_EQ(time_intervals(poses, 1.0, tolerance_s), expected);
  }
}

TEST(Statistics, AgreeWithTheirDefinitions) {
  const std::vector<double> odd = {3, 1, 2};
  const Statistics s = summarize(odd);
  EXPECT_DOUBLE_EQ(s.median, 2);
  EXPECT_DOUBLE_EQ(s.mean, 2);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(14.0 / 3));
  EXPECT_DOUBLE_EQ(s.std, std::sqrt(2.0 / 3));
  EXPECT_DOUBLE_EQ(summarize(std::vector<double>{4, 1}).median, 2.5);
  Rng rng(8);
  std::vector<double> values(101);
  for (double& v : values) v = rng.uniform(0, 5);
  const Statistics t = summarize(values);
  EXPECT_NEAR(t.rmse * t.rmse, t.mean * t.mean + t.std * t.std, 1e-12);
  EXPECT_LE(t.min, t.median);
  EXPECT_LE(t.median, t.max);
}

TEST(Evaluate, ATruthWithoutExtentIsAlignedByCentroidsWithAWarning) {
  Rng rng(9);
  Trajectory truth, estimate;
  for (int i = 0; i < 60; ++i) {
    const Timestamp stamp{i * std::int64_t{200'000'000}};
    truth.push_back({stamp, SE3(Mat3::Identity(), {1, 2, 3})});
    estimate.push_back({stamp, SE3(Mat3::Identity(), {rng.normal(5, 0.01), 0, 0})});
  }
  const auto report = evaluate(truth, estimate);
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->warnings.size(), 1U);
  EXPECT_LT(report->ate_m.rmse, 0.02);
  EXPECT_GT(report->ate_m.rmse, 0.005) << "the noise is not aligned away";
  EXPECT_NEAR(report->ate_rot_deg.max, 0.0, 1e-9);
  EXPECT_EQ(evaluate(truth, estimate, {.align = AlignMode::kSim3})->scale, 1.0);
}

TEST(Evaluate, WithoutCommonTimeItIsAnInputError) {
  Rng rng(10);
  const Trajectory truth = random_walk(20, rng);
  Trajectory later = truth;
  for (auto& pose : later) pose.stamp.ns += 3'600'000'000'000;
  const auto report = evaluate(truth, later);
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().kind, ErrorKind::kInput);
}

TEST(Evaluate, AShortTrajectoryHasNoRpeButStillAnAte) {
  Rng rng(11);
  const Trajectory truth = random_walk(10, rng);
  const auto report = evaluate(truth, truth);
  ASSERT_TRUE(report.ok());
  EXPECT_FALSE(report->rpe_frames.has_value());
  const nlohmann::json json = to_json(*report);
  EXPECT_TRUE(json["rpe"]["frames30"].is_null());
  EXPECT_TRUE(json["rpe"]["sec1"].is_null());
  EXPECT_TRUE(json["ate"]["rmse"].is_number());
  EXPECT_TRUE(evaluate({truth.data(), 1}, {truth.data(), 1}).ok());
}

TEST(Evaluate, JsonHasTheKeysOfTheContract) {
  Rng rng(12);
  const Trajectory truth = random_walk(100, rng);
  std::vector<Timestamp> frames;
  for (const auto& pose : truth) frames.push_back(pose.stamp);
  const auto json = to_json(*evaluate(truth, truth, {}, frames));
  for (const char* key : {"ate", "rpe", "alignment", "max_diff_s", "pairs", "span_s", "coverage"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  for (const char* statistic : {"rmse", "mean", "median", "std", "min", "max"}) {
    EXPECT_TRUE(json["ate"].contains(statistic));
    for (const char* interval : {"frames30", "sec1"}) {
      EXPECT_TRUE(json["rpe"][interval]["trans_m"].contains(statistic));
      EXPECT_TRUE(json["rpe"][interval]["rot_deg"].contains(statistic));
    }
  }
  EXPECT_EQ(json["coverage"], 1.0);
  EXPECT_EQ(json["alignment"], "se3");
}

TEST(Stamps, ThatCannotBeSecondsAreTold) {
  Rng rng(4);
  const auto told = [&](std::int64_t step_ns, const std::vector<Timestamp>& frames) {
    Trajectory truth = random_walk(100, rng);
    for (std::size_t i = 0; i < truth.size(); ++i)
      truth[i].stamp.ns = static_cast<std::int64_t>(i) * step_ns;
    std::string text;
    const auto report = evaluate(truth, truth, {}, frames);
    for (const std::string& warning : report->warnings) text += warning + "; ";
    return text;
  };
  EXPECT_EQ(told(33'333'333, {}), "");
  EXPECT_NE(told(33'333'333'333, {}).find("33.3333 s apart: are the stamps milliseconds"),
            std::string::npos);
  EXPECT_NE(told(1'000'000'000, {}).find("numbers of frames?"), std::string::npos);
  EXPECT_EQ(told(33'333'333, {{0}, {1'000'000'000}}), "");
  EXPECT_NE(told(33'333'333, {{1'700'000'000'000'000'000}}).find("no pose lies at"),
            std::string::npos);
}

TEST(Stamps, OfOtherTimesAreShownOfBoth) {
  Rng rng(4);
  const Trajectory truth = random_walk(10, rng);
  Trajectory later = truth;
  for (StampedPose& pose : later) pose.stamp.ns += 3'600'000'000'000;
  const auto refused = evaluate(truth, later);
  ASSERT_FALSE(refused.ok());
  const auto first = [](const Trajectory& poses) {
    return format_stamp(poses.front().stamp, 1) + " to ";
  };
  EXPECT_NE(refused.error().message.find("truth " + first(truth)), std::string::npos);
  EXPECT_NE(refused.error().message.find("estimate " + first(later)), std::string::npos);
  const auto none = evaluate(truth, {});  // a run that was lost throughout
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().message.find("estimate none)"), std::string::npos);
}

TEST(FrameStamps, AreReadFromListsAndFromFramesCsv) {
  const testing::TempFolder folder;
  const auto path = folder.path() / "f";
  const std::vector<Timestamp> expected = {{1'000'000'000}, {2'500'000'000}};
  testing::write(path, "# c\n2.5 rgb/b.png 2.5 depth/b.png\n1.0 rgb/a.png 1.0 depth/a.png\n");
  EXPECT_EQ(*read_frame_stamps(path), expected);
  testing::write(path, "frame,stamp,state\n0,1.0,tracking\n1,2.5,lost\n");
  EXPECT_EQ(*read_frame_stamps(path), expected);
  testing::write(path, "1.0,x\nabc,y\n");
  const auto bad = read_frame_stamps(path);
  ASSERT_FALSE(bad.ok());
  EXPECT_NE(bad.error().message.find(":2: "), std::string::npos);
  testing::write(path, "stamp,state\n");
  EXPECT_FALSE(read_frame_stamps(path).ok());
  for (const char* text : {"1,0 rgb/a.png 1,0 depth/a.png\n", "1.0 rgb/a.png\r2.0 rgb/b.png\r"}) {
    testing::write(path, text);
    EXPECT_FALSE(read_frame_stamps(path).ok()) << text;
  }
}

}  // namespace
}  // namespace ygslam
