// Views that leave little to hold on to: a thing that covers most of the image, a detector that
// calls everything a person. Tracking goes on or says that it is lost; it never jumps.
#include <gtest/gtest.h>

#include "system/testing/rendered_recording.hpp"

namespace ygslam::system_test {
namespace {

constexpr double kFrom_s = 1, kUntil_s = 6, kEnd_s = 7;
constexpr double kJump_m = 0.10;

const Recording& seven_seconds() {
  static const Recording kRendered = [] {
    sim::SequenceOptions options = small(kEnd_s);
    options.fps = 12;
    return record("static_xyz", options);
  }();
  return kRendered;
}

/// A textured board 0.7 m in front of the camera that covers 80 % of the image and swings sideways
/// in front of it; its mover id is 1.
void hold_board_before(Recording& recording, double from_s, double until_s) {
  for (std::size_t i = 0; i < recording.frames.size(); ++i) {
    const double t_s = recording.time_s(i);
    if (t_s < from_s || t_s >= until_s) continue;
    auto frame = std::make_shared<RgbdFrame>(*recording.frames[i]);
    const int width = frame->grey.width();
    const int covered = width * 8 / 10;
    const int left = static_cast<int>(0.1 * width * (1 + std::sin(3 * t_s)));
    for (int v = 0; v < frame->grey.height(); ++v) {
      for (int k = 0; k < covered; ++k) {
        const int u = left + k;
        Rng square((static_cast<std::uint64_t>(v / 9) << 16U) + static_cast<std::uint64_t>(k / 9));
        const auto grey = static_cast<std::uint8_t>(40 + square.below(180));
        frame->grey.at(u, v) = grey;
        frame->colour.at(u, v) = {grey, grey, grey};
        frame->depth_m.at(u, v) = 0.7F;
        recording.ids[i].at(u, v) = 1;
      }
    }
    recording.frames[i] = std::move(frame);
  }
}

/// One person mask over the whole image in [from_s, until_s), else none.
class AllIsAPerson final : public Segmenter {
 public:
  AllIsAPerson(const Recording& recording, double from_s, double until_s) {
    for (std::size_t i = 0; i < recording.frames.size(); ++i) {
      const double t_s = recording.time_s(i);
      masked_[recording.frames[i]->id] = t_s >= from_s && t_s < until_s;
    }
  }
  [[nodiscard]] Result<Segmentation> segment(const RgbdFrame& frame) override {
    Segmentation masks;
    masks.frame = frame.id;
    masks.stamp = frame.stamp;
    const bool masked = masked_.at(frame.id);
    masks.ids = GreyImage(frame.grey.width(), frame.grey.height(), masked ? 1 : 0);
    if (masked) {
      masks.instances = {{0, 0.9F, 0, 0, static_cast<float>(frame.grey.width()),
                          static_cast<float>(frame.grey.height())}};
    }
    return masks;
  }
  [[nodiscard]] std::string precision() const override { return "test"; }

 private:
  std::map<FrameId, bool> masked_;
};

/// Largest part of the motion between delivered poses of consecutive tracked frames, a loss between
/// them or not, that is not the camera's true motion.
double largest_jump_m(const Recording& recording, const Trial& run) {
  double largest = 0;
  std::optional<std::size_t> last;
  for (std::size_t i = 0; i < run.results.size(); ++i) {
    if (!run.has_pose(i)) continue;
    if (last) {
      const SE3 truth =
          recording.truth[*last].T_world_camera.inverse() * recording.truth[i].T_world_camera;
      const SE3 measured =
          run.results[*last].T_world_camera.inverse() * run.results[i].T_world_camera;
      largest = std::max(largest, (measured.t() - truth.t()).norm());
    }
    last = i;
  }
  return largest;
}

void expect_steady_and_back(const Recording& recording, const Trial& run) {
  EXPECT_TRUE(all_poses_finite(run));
  EXPECT_LT(largest_jump_m(recording, run), kJump_m);
  ASSERT_FALSE(run.results.empty());
  EXPECT_TRUE(run.has_pose(run.results.size() - 1));
  EXPECT_LT(drift_m(recording, run, run.results.size() - 1), kJump_m);
}

TEST(HardView, EightyPercentCoveredForFiveSecondsDoesNotMakeItJump) {
  Recording recording = seven_seconds();
  hold_board_before(recording, kFrom_s, kUntil_s);
  const Trial run = run_offline(small_config(DynamicMode::kFull), recording,
                                std::make_unique<TruthSegmenter>(recording));
  expect_steady_and_back(recording, run);
}

TEST(HardView, EightyPercentCoveredWithoutMasksDoesNotMakeItJump) {
  Recording recording = seven_seconds();
  hold_board_before(recording, kFrom_s, kUntil_s);
  for (const DynamicMode mode : {DynamicMode::kFull, DynamicMode::kGeometry}) {
    SCOPED_TRACE(static_cast<int>(mode));
    const Trial run = run_offline(small_config(mode), recording);
    expect_steady_and_back(recording, run);
  }
}

TEST(HardView, EverythingCalledAPersonForFiveSecondsOrForEverDoesNotMakeItJump) {
  const Recording& recording = seven_seconds();
  for (const double until_s : {kUntil_s, 2 * kEnd_s}) {
    SCOPED_TRACE(until_s);
    const double from_s = until_s > kEnd_s ? 0 : kFrom_s;
    const Trial run = run_offline(small_config(DynamicMode::kFull), recording,
                                  std::make_unique<AllIsAPerson>(recording, from_s, until_s));
    EXPECT_LT(lost_frames(run), static_cast<int>(run.results.size() / 10));
    expect_steady_and_back(recording, run);
  }
}

TEST(HardView, EverythingCalledAPersonWhileABoardCoversMostOfItDoesNotMakeItJump) {
  Recording recording = seven_seconds();
  hold_board_before(recording, kFrom_s, kUntil_s);
  const Trial run = run_offline(small_config(DynamicMode::kFull), recording,
                                std::make_unique<AllIsAPerson>(recording, 0, 2 * kEnd_s));
  expect_steady_and_back(recording, run);
}

}  // namespace
}  // namespace ygslam::system_test
