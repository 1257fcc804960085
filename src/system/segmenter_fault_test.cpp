// F15: a detector that is slow, dead, throws or answers with nonsense never holds tracking up and
// never harms it; what it failed to do is counted.
#include <gtest/gtest.h>

#include <condition_variable>
#include <future>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "system/segment_safely.hpp"
#include "system/testing/painted_recording.hpp"

namespace ygslam::system_test {
namespace {

/// A gate that lets nobody through until it is opened.
class Gate {
 public:
  void open() {
    {
      const std::lock_guard lock(mutex_);
      open_ = true;
    }
    opened_.notify_all();
  }
  void wait() {
    std::unique_lock lock(mutex_);
    opened_.wait(lock, [&] { return open_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable opened_;
  bool open_ = false;
};

Segmentation nothing_found(const RgbdFrame& frame) {
  Segmentation masks;
  masks.frame = frame.id;
  masks.stamp = frame.stamp;
  masks.ids = GreyImage(frame.grey.width(), frame.grey.height());
  return masks;
}

/// Answers by a function.
class FunctionSegmenter final : public Segmenter {
 public:
  using Function = std::function<Result<Segmentation>(const RgbdFrame&)>;
  explicit FunctionSegmenter(Function function) : function_(std::move(function)) {}
  [[nodiscard]] Result<Segmentation> segment(const RgbdFrame& frame) override {
    return function_(frame);
  }
  [[nodiscard]] std::string precision() const override { return "test"; }

 private:
  Function function_;
};

std::unique_ptr<Segmenter> by(FunctionSegmenter::Function function) {
  return std::make_unique<FunctionSegmenter>(std::move(function));
}

SlamConfig impatient() {
  SlamConfig config = small_config(DynamicMode::kFull);
  config.run.first_mask_timeout_s = 0;
  return config;
}

/// Everything the recording shows is tracked, and well.
void expect_tracked(const Recording& recording, const Trial& run) {
  EXPECT_EQ(run.results.size(), recording.frames.size());
  EXPECT_EQ(lost_frames(run), 0);
  EXPECT_TRUE(all_poses_finite(run));
  EXPECT_LT(ate_rmse_m(recording, run.trajectory()), 0.02);
}

std::vector<FunctionSegmenter::Function> nonsense() {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  return {
      [](const RgbdFrame&) -> Result<Segmentation> { throw std::runtime_error("no memory"); },
      [](const RgbdFrame&) -> Result<Segmentation> { throw 7; },
      [](const RgbdFrame&) -> Result<Segmentation> {
        return Error{ErrorKind::kModel, "test: no mask"};
      },
      [](const RgbdFrame& frame) -> Result<Segmentation> {  // ids without instances
        Segmentation masks = nothing_found(frame);
        for (std::size_t i = 0; i < masks.ids.size(); ++i)
          masks.ids.data()[i] = static_cast<std::uint8_t>(i * 37 % 256);
        return masks;
      },
      [nan](const RgbdFrame& frame) -> Result<Segmentation> {
        Segmentation masks = nothing_found(frame);
        masks.instances = {{0, nan, nan, 0, nan, 3}};
        std::fill(masks.ids.begin(), masks.ids.end(), std::uint8_t{1});
        return masks;
      },
      [](const RgbdFrame& frame) -> Result<Segmentation> {
        Segmentation masks = nothing_found(frame);
        masks.instances = {{0, 0.9F, 0, 0, 9, 9}};
        masks.ids = GreyImage(4000, 3, 1);
        return masks;
      },
      [](const RgbdFrame& frame) -> Result<Segmentation> {  // no pixels at all
        Segmentation masks = nothing_found(frame);
        masks.ids = GreyImage();
        return masks;
      },
      [](const RgbdFrame& frame) -> Result<Segmentation> {
        Segmentation masks = nothing_found(frame);
        masks.frame = FrameId{index(frame.id) + 1000};
        return masks;
      },
  };
}

TEST(SegmenterFault, F15NonsenseIsAnErrorOfThatFrame) {
  RgbdFrame frame;
  frame.id = FrameId{3};
  frame.grey = GreyImage(32, 24);
  for (const auto& function : nonsense()) {
    const auto segmenter = by(function);
    const Result<Segmentation> masks = segment_safely(*segmenter, frame);
    ASSERT_FALSE(masks.ok());
    EXPECT_EQ(masks.error().kind, ErrorKind::kModel);
    EXPECT_EQ(masks.error().message.find('\n'), std::string::npos);
  }
  const auto good = by(nothing_found);
  EXPECT_TRUE(segment_safely(*good, frame).ok());
}

TEST(SegmenterFault, F15NonsenseIsCountedAndTrackingGoesOnInBothRunners) {
  const Recording recording = painted_recording({.seconds = 0.5});
  const auto frames = static_cast<int>(recording.frames.size());
  const SlamConfig config = impatient();
  for (const auto& function : nonsense()) {
    const Trial offline = run_offline(config, recording, by(function));
    expect_tracked(recording, offline);
    EXPECT_EQ(offline.outcome.statistics.masks_failed, frames);
    EXPECT_EQ(offline.outcome.statistics.masks_used, 0);
    const Trial live = run_live(config, recording, by(function));
    expect_tracked(recording, live);
    EXPECT_GT(live.outcome.statistics.masks_failed, 0);
    EXPECT_EQ(live.outcome.statistics.masks_used, 0);
  }
}

TEST(SegmenterFault, F15ADeadDetectorNeverHoldsTrackingUpAndIsNoticed) {
  const Recording recording = painted_recording({.seconds = 2.5});
  auto gate = std::make_shared<Gate>();
  auto runner = make_live_runner(impatient(), recording.camera, by([gate](const RgbdFrame& frame) {
                                   gate->wait();
                                   return Result<Segmentation>(nothing_found(frame));
                                 }));
  Trial run(std::move(runner));
  // Every frame gets its result although no mask ever comes.
  for (const FramePtr& frame : recording.frames) run.process(frame);
  for (const TrackResult& result : run.results) EXPECT_EQ(result.mask_age_frames, -1);
  gate->open();
  run.finish();
  expect_tracked(recording, run);
  EXPECT_TRUE(run.outcome.statistics.segmenter_silent);
  EXPECT_EQ(run.outcome.statistics.masks_used, 0);
}

TEST(SegmenterFault, F15ADetectorThatNeverComesBackIsLeftBehind) {
  const Recording recording = painted_recording({.seconds = 0.5});
  SlamConfig config = impatient();
  config.run.finish_patience_s = 0.3;
  // Outlives the runner, as the thread that waits for it does.
  const auto never = std::make_shared<std::promise<void>>();
  const std::shared_future<void> released = never->get_future().share();
  const ScopedTimer timer;
  const Trial run = run_live(config, recording, by([released](const RgbdFrame& frame) {
                               released.wait();
                               return Result<Segmentation>(nothing_found(frame));
                             }));
  expect_tracked(recording, run);
  EXPECT_EQ(run.outcome.statistics.masks_used, 0);
  EXPECT_LT(timer.wall_ms(), 60'000);  // it ends at all
  never->set_value();
}

TEST(SegmenterFault, F15ASlowDetectorsMasksAreTakenLateAndOldOnesAreSkipped) {
  const Recording recording = painted_recording({.seconds = 1.5});
  // Each mask takes ten frames: a gate per ten frames, opened when they have been tracked.
  std::vector<std::shared_ptr<Gate>> gates;
  for (std::size_t i = 0; i < recording.frames.size(); i += 10)
    gates.push_back(std::make_shared<Gate>());
  auto runner = make_live_runner(
      impatient(), recording.camera, by([gates](const RgbdFrame& frame) {
        gates[std::min<std::size_t>(index(frame.id) / 10, gates.size() - 1)]->wait();
        return Result<Segmentation>(nothing_found(frame));
      }));
  Trial run(std::move(runner));
  for (std::size_t i = 0; i < recording.frames.size(); ++i) {
    run.process(recording.frames[i]);
    if (i % 10 == 9) gates[i / 10]->open();
  }
  for (const auto& gate : gates) gate->open();
  run.finish();
  expect_tracked(recording, run);
  const auto& statistics = run.outcome.statistics;
  EXPECT_LT(statistics.masks_used, static_cast<int>(recording.frames.size()) / 2);
  EXPECT_FALSE(statistics.segmenter_silent);
}

// Counted in time, for waiting is the fault: one vain wait is a second, all good ones together
// are milliseconds.
TEST(SegmenterFault, AMaskOfThePresentFrameIsNotTakenForAnOldOne) {
  const Recording recording = painted_recording({.seconds = 0.5});
  SlamConfig config = impatient();
  config.run.file_mask_lag_frames = 2;
  auto gate = std::make_shared<Gate>();
  auto runner = make_live_runner(config, recording.camera, by([gate](const RgbdFrame& frame) {
                                   gate->wait();
                                   return Result<Segmentation>(nothing_found(frame));
                                 }));
  // The first mask comes while the fourth frame waits: the next is then the fourth frame's own.
  for (std::size_t i = 0; i < 2; ++i) (void)runner->process(recording.frames[i]);
  {
    const std::jthread later([gate] {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      gate->open();
    });
    for (std::size_t i = 2; i < 4; ++i) (void)runner->process(recording.frames[i]);
  }
  for (std::size_t i = 4; i < recording.frames.size(); ++i)
    (void)runner->process(recording.frames[i]);
  EXPECT_LT(runner->finish().statistics.mask_wait_s, 1.0);
}

TEST(SegmenterFault, FramesWithoutAMaskAreNotWaitedFor) {
  const Recording recording = painted_recording({.seconds = 1});
  SlamConfig config = small_config(DynamicMode::kFull);
  config.run.file_mask_lag_frames = 2;
  const Trial run = run_live(config, recording, by([](const RgbdFrame& frame) {
                               if (index(frame.id) % 6 == 5)
                                 return Result<Segmentation>(nothing_found(frame));
                               return Result<Segmentation>(Error{ErrorKind::kModel, "test: none"});
                             }));
  EXPECT_GT(run.outcome.statistics.masks_used, 0);
  EXPECT_LT(run.outcome.statistics.mask_wait_s, 1.0);
}

}  // namespace
}  // namespace ygslam::system_test
