#include "system/dense_offer.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <future>

#include "dense/dense_map.hpp"
#include "system/testing/rendered_recording.hpp"

namespace ygslam {
namespace {

FramePtr frame_at(double t_s) {
  auto frame = std::make_shared<RgbdFrame>();
  frame->stamp.ns = static_cast<std::int64_t>(1e9 * t_s);
  return frame;
}

TEST(DenseOffer, IsAFrameWhereNoneWasForAWhile) {
  DenseOffer offer(0.5);
  TrackResult result;
  result.state = TrackState::kTracking;
  int offered = 0;
  for (int i = 0; i < 60; ++i) offered += offer.step(frame_at(i / 30.0), result) ? 1 : 0;
  EXPECT_EQ(offered, 4);
  EXPECT_TRUE(offer.step(frame_at(3), result));
  result.candidate.emplace();
  EXPECT_FALSE(offer.step(frame_at(4), result)) << "it is there as a keyframe";
  result.candidate.reset();
  EXPECT_FALSE(offer.step(frame_at(4.4), result));
  EXPECT_TRUE(offer.step(frame_at(4.6), result));
  EXPECT_FALSE(DenseOffer(0).step(frame_at(9), result));
}

TEST(DenseOffer, IsNoFrameWithoutASurePlace) {
  DenseOffer offer(0.5);
  TrackResult result;
  for (const TrackState state : {TrackState::kWaiting, TrackState::kWeak, TrackState::kLost}) {
    result.state = state;
    EXPECT_FALSE(offer.step(frame_at(1), result));
  }
  result.state = TrackState::kTracking;
  result.provisional = true;
  EXPECT_FALSE(offer.step(frame_at(2), result));
  result.provisional = false;
  EXPECT_TRUE(offer.step(frame_at(2), result));
}

struct DenseViews {
  std::size_t keyframes = 0, frames = 0;
  std::uint64_t fingerprint = 0, again = 0;  // and of the same views at once
};

DenseViews views_of_run(decltype(&make_live_runner) make, double interval_s) {
  const auto& recording = system_test::record_once("walking_static", 4);
  SlamConfig config = system_test::small_config(DynamicMode::kFull);
  config.dense.interval_s = interval_s;
  auto runner = make(config, recording.camera,
                     std::make_unique<system_test::TruthSegmenter>(recording), MapUse{});
  for (const FramePtr& frame : recording.frames) static_cast<void>(runner->process(frame));
  runner->finish();
  DenseViews views;
  runner->inspect_dense([&](DenseMap& dense) {
    DenseUpdate poses;
    const Map map = runner->map();
    for (const auto& [id, keyframe] : map.keyframes())
      poses.T_world_camera[id] = keyframe.T_camera_world.inverse();
    for (const SavedView& view : dense.saved()) ++(view.anchor ? views.frames : views.keyframes);
    views.fingerprint = dense.volume().fingerprint();
    DenseMap again(config.dense, recording.camera);
    again.restore(dense.saved());
    again.apply(poses);
    again.finish();
    views.again = again.volume().fingerprint();
  });
  return views;
}

/// The camera stands and people walk: what they uncover is in no keyframe.
TEST(DenseOffer, FillsTheMapWhereTheCameraStands) {
  for (const auto make : {&make_offline_runner, &make_live_runner}) {
    const DenseViews with = views_of_run(make, 0.5);
    EXPECT_GT(with.frames, 0U);
    EXPECT_EQ(with.fingerprint, with.again);
  }
  EXPECT_EQ(views_of_run(&make_offline_runner, 0).frames, 0U);
  EXPECT_EQ(views_of_run(&make_offline_runner, 0.5).fingerprint,
            views_of_run(&make_offline_runner, 0.5).fingerprint);
}

/// More updates than its queue takes, while it is busy with the first.
TEST(DenseMapBehind, HoldsNobodyUpAndGetsWhatItMissed) {
  const auto& recording = system_test::record_once("walking_static", 4);
  std::promise<void> over;
  const std::shared_future<void> is_over = over.get_future().share();
  MapUse use;
  use.dense_sink.look_at_once = [is_over](DenseMap&) { is_over.wait(); };
  SlamConfig config = system_test::small_config(DynamicMode::kFull);
  config.run.first_mask_timeout_s = 60;
  auto runner =
      make_live_runner(config, recording.camera,
                       std::make_unique<system_test::TruthSegmenter>(recording), std::move(use));
  auto run = std::async(std::launch::async, [&] {
    for (const FramePtr& frame : recording.frames) {
      static_cast<void>(runner->process(frame));
      for (int i = 0; i < 2; ++i) runner->correct({});
    }
  });
  const bool went_on = run.wait_for(std::chrono::minutes(2)) == std::future_status::ready;
  over.set_value();
  run.get();
  EXPECT_TRUE(went_on);
  const SlamOutcome& outcome = runner->finish();
  EXPECT_GT(outcome.statistics.dense_skipped, 0) << "frames between keyframes";
  std::size_t views = 0;
  runner->inspect_dense([&](DenseMap& dense) {
    for (const SavedView& view : dense.saved()) views += view.anchor ? 0 : 1;
  });
  EXPECT_EQ(views, runner->map().keyframes().size());
}

}  // namespace
}  // namespace ygslam
