// What a robot's sensor does on a bad day, and what the system must make of it. The numbers F4, F7,
// ... name the faults in docs/reliability.md.
#include <gtest/gtest.h>

#include "core/rng.hpp"
#include "system/testing/rendered_recording.hpp"

namespace ygslam::system_test {
namespace {

void paint(RgbdFrame& frame, std::uint8_t grey) {
  std::fill(frame.colour.begin(), frame.colour.end(), Rgb8{grey, grey, grey});
  std::fill(frame.grey.begin(), frame.grey.end(), grey);
}

/// Seconds from `from_s` until the run has a pose (wanted) or none; a large number if never.
double delay_until(const Recording& recording, const Trial& run, double from_s, bool wanted) {
  for (std::size_t i = 0; i < run.results.size(); ++i) {
    const double t_s = recording.time_s(i);
    if (t_s >= from_s && run.has_pose(i) == wanted) return t_s - from_s;
  }
  return 1e9;
}

double worst_drift_m(const Recording& recording, const Trial& run, double from_s, double until_s) {
  double worst = 0;
  for (std::size_t i = 0; i < run.results.size(); ++i) {
    const double t_s = recording.time_s(i);
    if (run.has_pose(i) && t_s >= from_s && t_s < until_s) {
      worst = std::max(worst, drift_m(recording, run, i));
    }
  }
  return worst;
}

TEST(Fault, F4DepthAllZeroForThreeSecondsTracksOnTheMap) {
  Recording recording = record_once("static_xyz", 5);
  recording.spoil(1, 4, [](RgbdFrame& f) { std::fill(f.depth_m.begin(), f.depth_m.end(), 0.0F); });
  const Trial run = run_offline(small_config(DynamicMode::kFull), recording);
  EXPECT_TRUE(all_poses_finite(run));
  EXPECT_LT(worst_drift_m(recording, run, 0, 5), 0.15);
  EXPECT_LT(delay_until(recording, run, 4, true), 1.0);
}

TEST(Fault, F5DepthOfNanInfinityAndNegativesIsNoDepth) {
  Recording recording = record_once("static_xyz", 1);
  Rng rng(5);
  recording.spoil(0, 2, [&](RgbdFrame& f) {
    const float bad[] = {NAN, INFINITY, -INFINITY, -1.0F};
    for (float& depth_m : f.depth_m)
      if (rng.below(4) == 0) depth_m = bad[rng.below(4)];
    f.depth_m = sanitized_depth(f.depth_m, DepthConfig{});
  });
  const Trial run = run_offline(small_config(DynamicMode::kFull), recording);
  EXPECT_TRUE(all_poses_finite(run));
  EXPECT_EQ(lost_frames(run), 0);
  EXPECT_LT(worst_drift_m(recording, run, 0, 2), 0.05);
}

TEST(Fault, F7BlackImagesForASecondAreALossThatEnds) {
  Recording recording = record_once("static_xyz", 4);
  recording.spoil(1.5, 2.5, [](RgbdFrame& f) { paint(f, 0); });
  for (const DynamicMode mode : {DynamicMode::kOff, DynamicMode::kFull}) {
    const Trial run = run_offline(small_config(mode), recording);
    EXPECT_LT(delay_until(recording, run, 1.5, false), 0.5) << mode_name(mode);
    EXPECT_LT(delay_until(recording, run, 2.5, true), 1.0) << mode_name(mode);
    EXPECT_EQ(keyframes_between(recording, run, 1.5, 2.5), 0) << mode_name(mode);
    EXPECT_LT(worst_drift_m(recording, run, 2.5, 4), 0.05) << mode_name(mode);
  }
}

TEST(Fault, F8AStuckImageIsAStandingCamera) {
  Recording recording = record_once("static_xyz", 2);
  // The image of 1 s again and again for 3 s, under new stamps.
  const std::size_t stuck = 20;
  const std::int64_t step_ns = recording.frames[1]->stamp.ns - recording.frames[0]->stamp.ns;
  std::vector<FramePtr> frames(recording.frames.begin(), recording.frames.begin() + stuck + 1);
  for (int i = 0; i < 60; ++i) {
    auto copy = std::make_shared<RgbdFrame>(*frames.back());
    copy->id = FrameId{index(copy->id) + 1};
    copy->stamp.ns += step_ns;
    frames.push_back(std::move(copy));
  }
  recording.frames = std::move(frames);
  const Trial run = run_offline(small_config(DynamicMode::kFull), recording);
  EXPECT_EQ(lost_frames(run), 0);
  const Vec3 start = run.results[stuck].T_world_camera.t();
  for (std::size_t i = stuck; i < run.results.size(); ++i) {
    EXPECT_LT((run.results[i].T_world_camera.t() - start).norm(), 0.01) << i;
  }
}

TEST(Fault, F10DroppedFramesAndAGapCostLittle) {
  const Recording& clean = record_once("static_xyz", 5);
  Recording gappy{clean.camera, {}, {}, {}};
  Rng rng(10);
  for (std::size_t i = 0; i < clean.frames.size(); ++i) {
    const double t_s = clean.time_s(i);
    if (t_s > 0.5 && (rng.uniform() < 0.3 || (t_s > 2.5 && t_s < 3.5))) continue;
    gappy.frames.push_back(clean.frames[i]);
    gappy.truth.push_back(clean.truth[i]);
    gappy.ids.push_back(clean.ids[i]);
  }
  const SlamConfig config = small_config(DynamicMode::kFull);
  const double clean_m = ate_rmse_m(clean, run_offline(config, clean).trajectory());
  const Trial run = run_offline(config, gappy);
  EXPECT_LE(lost_frames(run), 1);
  EXPECT_LT(ate_rmse_m(gappy, run.trajectory()), 1.5 * clean_m);
}

/// Takes the whole image for one person.
class EverythingMoves final : public Segmenter {
 public:
  [[nodiscard]] Result<Segmentation> segment(const RgbdFrame& frame) override {
    Segmentation masks;
    masks.frame = frame.id;
    masks.stamp = frame.stamp;
    masks.instances = {{0, 0.9F, 0, 0, 320, 240}};
    masks.ids = GreyImage(frame.grey.width(), frame.grey.height(), 1);
    return masks;
  }
  [[nodiscard]] std::string precision() const override { return "test"; }
};

TEST(Fault, F14WhenAllIsMaskedGeometryCarriesOn) {
  const Recording& recording = record_once("static_xyz", 3);
  const Trial run =
      run_offline(small_config(DynamicMode::kFull), recording, std::make_unique<EverythingMoves>());
  EXPECT_EQ(lost_frames(run), 0);
  EXPECT_LT(worst_drift_m(recording, run, 0, 3), 0.10);
}

TEST(Fault, F14WhenNoPointIsClearedTheFramesSayThatPointsHadToComeBack) {
  Recording recording = record_once("static_xyz", 1.5);
  // Without depth nothing tells what lies behind the mask's object.
  recording.spoil(0.5, 2,
                  [](RgbdFrame& f) { std::fill(f.depth_m.begin(), f.depth_m.end(), 0.0F); });
  const Trial run =
      run_offline(small_config(DynamicMode::kFull), recording, std::make_unique<EverythingMoves>());
  EXPECT_TRUE(all_poses_finite(run));
  int said = 0;
  for (const FrameRecord& f : run.frames) said += f.few_static ? 1 : 0;
  EXPECT_GE(said, 10);
}

TEST(Fault, F19ATexturelessWallIsALossThatEndsWithTheWall) {
  Recording recording = record_once("static_xyz", 3.5);
  recording.spoil(1.5, 2.5, [](RgbdFrame& f) {
    paint(f, 140);
    std::fill(f.depth_m.begin(), f.depth_m.end(), 0.8F);
  });
  const Trial run = run_offline(small_config(DynamicMode::kFull), recording);
  EXPECT_LT(delay_until(recording, run, 1.5, false), 0.5);
  EXPECT_EQ(keyframes_between(recording, run, 1.5, 2.5), 0);
  EXPECT_LT(delay_until(recording, run, 2.5, true), 1.0);
  EXPECT_TRUE(all_poses_finite(run));
}

}  // namespace
}  // namespace ygslam::system_test
