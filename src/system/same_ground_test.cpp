// A long run over the same ground: what is known there bounds the map.
#include <gtest/gtest.h>

#include "system/testing/rendered_recording.hpp"

namespace ygslam::system_test {
namespace {

/// A recording that is played forwards and backwards without end.
class ToAndFro {
 public:
  explicit ToAndFro(const Recording& recording) : recording_(recording) {}
  [[nodiscard]] std::size_t at(std::size_t step) const {
    const std::size_t back = 2 * (recording_.frames.size() - 1);
    return std::min(step % back, back - step % back);
  }
  [[nodiscard]] FramePtr frame(std::size_t step) const {
    auto played = std::make_shared<RgbdFrame>(*recording_.frames[at(step)]);
    played->id = FrameId{static_cast<std::uint32_t>(step)};
    played->stamp = {static_cast<std::int64_t>(step) * 50'000'000};
    return played;
  }

 private:
  const Recording& recording_;
};

/// The truth of the frame that is played.
class PlayedTruth final : public Segmenter {
 public:
  explicit PlayedTruth(const Recording& recording)
      : recording_(recording), player_(recording), truth_(recording) {}
  [[nodiscard]] Result<Segmentation> segment(const RgbdFrame& frame) override {
    auto masks = truth_.segment(*recording_.frames[player_.at(index(frame.id))]);
    masks->frame = frame.id;
    masks->stamp = frame.stamp;
    return masks;
  }
  [[nodiscard]] std::string precision() const override { return "truth"; }

 private:
  const Recording& recording_;
  ToAndFro player_;
  TruthSegmenter truth_;
};

struct Size {
  std::size_t keyframes = 0, landmarks = 0;
};

TEST(SameGround, PeopleWalkAndTheMapStaysAsItIs) {
  const Recording recording = record("walking_xyz", small(2));
  SlamConfig config = small_config(DynamicMode::kFull);
  config.run.keep_trajectory = false;
  const auto runner =
      make_offline_runner(config, recording.camera, std::make_unique<PlayedTruth>(recording));
  const ToAndFro player(recording);
  const std::size_t round = 2 * (recording.frames.size() - 1);
  const std::size_t half = 7 * round;
  Size early, late;  // the most, in the first and the second half
  std::size_t made = 0;
  for (std::size_t step = 0; step < 2 * half; ++step) {
    const TrackResult result = runner->process(player.frame(step));
    ASSERT_EQ(result.state, TrackState::kTracking) << step;
    const SE3 T_truth = recording.truth[0].T_world_camera.inverse() *
                        recording.truth[player.at(step)].T_world_camera;
    ASSERT_LT((T_truth.t() - result.T_world_camera.t()).norm(), 0.02) << step;
    made += result.candidate ? 1 : 0;
    if (step % 10 != 9) continue;
    const Map map = runner->map();
    Size& most = step < half ? early : late;
    most.keyframes = std::max(most.keyframes, map.keyframes().size());
    most.landmarks = std::max(most.landmarks, map.landmark_count());
  }
  EXPECT_GT(made, 4 * late.keyframes) << "new ones are made all the time";
  EXPECT_LE(late.keyframes, early.keyframes + 2);
  EXPECT_LE(late.landmarks, early.landmarks + early.landmarks / 10);
  EXPECT_TRUE(runner->finish().trajectory.empty()) << "nobody asked for it";
}

}  // namespace
}  // namespace ygslam::system_test
