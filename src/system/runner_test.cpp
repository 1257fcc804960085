// Both runners as things with a life: repeatable, independent of one another, gone without a trace.
#include <gtest/gtest.h>

#include <thread>

#include "system/testing/painted_recording.hpp"

namespace ygslam::system_test {
namespace {

std::string bytes(const Trial& run) {
  return format_tum(run.trajectory(), 6) + format_tum(run.live_trajectory(), 6) +
         format_tum(keyframe_trajectory(run.map()), 6);
}

std::unique_ptr<Segmenter> truth(const Recording& recording) {
  return std::make_unique<TruthSegmenter>(recording);
}

SlamConfig patient() {
  SlamConfig config = small_config(DynamicMode::kFull);
  config.run.first_mask_timeout_s = 60;
  return config;
}

TEST(OfflineRunner, F38TheSameRunTwiceGivesTheSameBytes) {
  const Recording recording = painted_recording({.seconds = 2, .mover = true});
  const SlamConfig config = small_config(DynamicMode::kFull);
  const Trial first = run_offline(config, recording, truth(recording));
  const Trial second = run_offline(config, recording, truth(recording));
  EXPECT_EQ(bytes(first), bytes(second));
  const auto a = first.runner->cloud();
  const auto b = second.runner->cloud();
  ASSERT_EQ(a.size(), b.size());
  ASSERT_FALSE(a.empty());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].p_world, b[i].p_world);
    ASSERT_EQ(a[i].colour, b[i].colour);
  }
}

TEST(OfflineRunner, F38TwoAtOnceDoNotInfluenceEachOther) {
  const Recording box = painted_recording({.seconds = 1, .mover = true});
  const Recording still = painted_recording({.seconds = 1});
  const SlamConfig config = small_config(DynamicMode::kFull);
  const std::string box_alone = bytes(run_offline(config, box, truth(box)));
  const std::string still_alone = bytes(run_offline(config, still));
  std::string box_beside, still_beside;
  {
    const std::jthread other([&] { box_beside = bytes(run_offline(config, box, truth(box))); });
    still_beside = bytes(run_offline(config, still));
  }
  EXPECT_EQ(box_beside, box_alone);
  EXPECT_EQ(still_beside, still_alone);
}

class TruthInStep final : public Segmenter {
 public:
  explicit TruthInStep(const Recording& recording) : truth_(recording) {}
  [[nodiscard]] Result<Segmentation> segment(const RgbdFrame& frame) override {
    return truth_.segment(frame);
  }
  [[nodiscard]] std::string precision() const override { return "truth"; }
  [[nodiscard]] bool in_step() const override { return true; }

 private:
  TruthSegmenter truth_;
};

TEST(BothRunners, MasksOfASegmenterInStepAreOfTheFrameItself) {
  const Recording recording = painted_recording({.seconds = 1, .mover = true});
  for (const auto make : {make_offline_runner, make_live_runner}) {
    const Trial run = system_test::run(
        make(patient(), recording.camera, std::make_unique<TruthInStep>(recording), MapUse{}),
        recording);
    for (const FrameRecord& frame : run.frames) {
      EXPECT_EQ(frame.mask_age_frames, 0);
      EXPECT_GT(frame.mask_ms, 0);
    }
    EXPECT_EQ(run.outcome.statistics.masks_used, static_cast<int>(run.frames.size()));
  }
}

TEST(OfflineRunner, AKeyframesOwnMaskFindsItInTheMap) {
  const Recording recording = painted_recording({.seconds = 0.5, .mover = true});
  Trial run(make_offline_runner(small_config(DynamicMode::kFull), recording.camera,
                                std::make_unique<TruthInStep>(recording)));
  run.process(recording.frames.front());
  EXPECT_FALSE(run.runner->cloud().empty()) << "keyframes go into it with their masks";
}

TEST(LiveRunner, FollowsTheCameraAsTheOfflineRunnerDoes) {
  const Recording recording = painted_recording({.seconds = 2, .mover = true});
  const Trial run = run_live(patient(), recording, truth(recording));
  EXPECT_EQ(lost_frames(run), 0);
  EXPECT_LT(ate_rmse_m(recording, run.trajectory()), 0.015);
  EXPECT_GT(run.map().keyframes().size(), 1U);
  // The first frame waits for its mask.
  EXPECT_EQ(run.frames.front().mask_age_frames, 0);
  EXPECT_FALSE(run.runner->cloud().empty());
}

TEST(LiveRunner, FramesOutOfAFileWaitForMasksThatAreTooOld) {
  const Recording recording = painted_recording({.seconds = 2, .mover = true});
  SlamConfig config = patient();
  config.run.file_mask_lag_frames = 2;
  const Trial run = run_live(config, recording, truth(recording));
  for (const FrameRecord& frame : run.frames) {
    EXPECT_GE(frame.mask_age_frames, 0);
    EXPECT_LE(frame.mask_age_frames, 2);
  }
}

TEST(LiveRunner, FeedAFewAndFinishFiftyTimes) {
  const Recording recording = painted_recording({.seconds = 0.25, .mover = true});
  for (int i = 0; i < 50; ++i) {
    auto runner = make_live_runner(patient(), recording.camera, truth(recording));
    const std::size_t count = static_cast<std::size_t>(i) % (recording.frames.size() + 1);
    for (std::size_t k = 0; k < count; ++k) (void)runner->process(recording.frames[k]);
    const SlamOutcome& outcome = runner->finish();
    EXPECT_EQ(outcome.statistics.frames, count);
    EXPECT_EQ(final_trajectory(outcome.trajectory, outcome.revised, runner->map()).size(), count);
  }
}

using MakeRunner = decltype(&make_live_runner);

/// What holds for both runners.
class AnyRunner : public ::testing::TestWithParam<MakeRunner> {
 protected:
  std::unique_ptr<Runner> make() {
    return GetParam()(patient(), recording_.camera, truth(recording_), {});
  }
  Recording recording_ = painted_recording({.seconds = 1.0, .mover = true});
};

TEST_P(AnyRunner, LetsOneLookInWhileItRuns) {
  auto runner = make();
  std::size_t told = 0;
  runner->add_sink([&](const FrameRecord& frame, const TrackResult& result) {
    EXPECT_EQ(frame.frame, recording_.frames[told++]->id);
    EXPECT_EQ(result.labels.label.size(), result.features->size());
  });
  std::uint64_t version = 0;
  for (const FramePtr& frame : recording_.frames) {
    (void)runner->process(frame);
    const Map map = runner->map();
    EXPECT_GE(map.version(), version);
    version = map.version();
    (void)runner->cloud();
  }
  EXPECT_EQ(told, recording_.frames.size());
  const auto& outcome = runner->finish();
  EXPECT_EQ(&runner->finish(), &outcome) << "may be called again";
  EXPECT_EQ(outcome.statistics.frames, recording_.frames.size());
  EXPECT_GE(runner->map().version(), version);
  EXPECT_GT(runner->map().landmark_count(), 100U);
}

TEST_P(AnyRunner, StartsANewWorldAfterReset) {
  auto runner = make();
  for (std::size_t i = 0; i < 10; ++i) (void)runner->process(recording_.frames[i]);
  runner->reset();
  EXPECT_TRUE(runner->map().keyframes().empty());
  for (std::size_t i = 10; i < recording_.frames.size(); ++i) {
    const TrackResult result = runner->process(recording_.frames[i]);
    EXPECT_EQ(result.state, TrackState::kTracking) << i;
    if (i == 10) {
      EXPECT_EQ(result.T_world_camera.t(), Vec3::Zero()) << "the new world";
    }
  }
  const auto& outcome = runner->finish();
  EXPECT_EQ(outcome.trajectory.size(), recording_.frames.size() - 10);
  EXPECT_EQ(outcome.trajectory.front().frame, recording_.frames[10]->id);
}

INSTANTIATE_TEST_SUITE_P(LiveAndOffline, AnyRunner,
                         ::testing::Values(&make_live_runner, &make_offline_runner));

TEST(LiveRunner, MayBeDroppedWithoutFinish) {
  const Recording recording = painted_recording({.seconds = 0.25, .mover = true});
  for (int i = 0; i < 20; ++i) {
    auto runner = make_live_runner(patient(), recording.camera, truth(recording));
    const std::size_t count = static_cast<std::size_t>(i) % (recording.frames.size() + 1);
    for (std::size_t k = 0; k < count; ++k) (void)runner->process(recording.frames[k]);
  }
}

}  // namespace
}  // namespace ygslam::system_test
