// Runs that go on with a map, and runs that are only placed in one.
#include <gtest/gtest.h>

#include "io/testing/temp_folder.hpp"
#include "map/map_bytes.hpp"
#include "system/testing/rendered_recording.hpp"

namespace ygslam {
namespace {

using system_test::record_once;
using system_test::Recording;
using system_test::small;
using system_test::small_config;
using system_test::Trial;

using MakeRunner = decltype(&make_live_runner);

/// The frames from `first` on as if they came `later_s` later, with ids from `first_id` on.
std::vector<FramePtr> again(const Recording& recording, std::size_t first, std::uint32_t first_id,
                            double later_s) {
  std::vector<FramePtr> frames;
  for (std::size_t i = first; i < recording.frames.size(); ++i) {
    auto frame = std::make_shared<RgbdFrame>(*recording.frames[i]);
    frame->id = FrameId{first_id + static_cast<std::uint32_t>(i - first)};
    frame->stamp.ns += static_cast<std::int64_t>(later_s * 1e9);
    frames.push_back(frame);
  }
  return frames;
}

int lost(const Trial& run) {
  return static_cast<int>(
      std::count_if(run.results.begin(), run.results.end(),
                    [](const TrackResult& r) { return r.state == TrackState::kLost; }));
}

double largest_difference_m(const Trial& a, const Trial& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.results.size(); ++i)
    largest = std::max(largest,
                       (a.results[i].T_world_camera.t() - b.results[i].T_world_camera.t()).norm());
  return largest;
}

class MapOfARun : public ::testing::TestWithParam<MakeRunner> {
 protected:
  Trial run(MapUse use, const Recording& recording) {
    return system_test::run(GetParam()(config_, recording.camera, nullptr, std::move(use)),
                            recording);
  }
  SlamConfig config_ = small_config(DynamicMode::kOff);
};

TEST_P(MapOfARun, IsKeptAsItIsByARunThatIsOnlyPlacedInIt) {
  const Recording& recording = record_once("static_xyz", 2);
  const Trial mapped = run({}, recording);
  const std::string bytes = to_bytes(mapped.map());
  const Trial placed = run({mapped.map(), true, {}}, recording);
  EXPECT_EQ(lost(placed), 0);
  EXPECT_LT(largest_difference_m(mapped, placed), 0.02);
  EXPECT_EQ(to_bytes(placed.map()), bytes);
  EXPECT_TRUE(placed.results.front().provisional) << "another room may look the same";
  EXPECT_FALSE(mapped.results.back().provisional);
}

TEST_P(MapOfARun, GoesOnInTheNext) {
  const Recording& recording = record_once("static_xyz", 2);
  const Trial first = run({}, recording);
  const auto next = first.map().next_keyframe_id();
  const Trial second = run({first.map(), false, {}}, recording);
  EXPECT_EQ(lost(second), 0);
  EXPECT_GE(second.map().next_keyframe_id(), next);
  EXPECT_LT(largest_difference_m(first, second), 0.02) << "the same world";
  EXPECT_LT(second.map().keyframes().size(), 2 * first.map().keyframes().size());
}

TEST_P(MapOfARun, IsNotWhereTheCameraIsInAnotherBuilding) {
  const Recording& here = record_once("static_xyz", 1);
  const Recording& elsewhere = record_once("corridor_loop", 1);
  const Trial mapped = run({}, here);
  const Trial placed = run({mapped.map(), true, {}}, elsewhere);
  EXPECT_EQ(lost(placed), static_cast<int>(elsewhere.frames.size()));
}

TEST_P(MapOfARun, IsTakenUpAgainAfterReset) {
  const Recording& recording = record_once("static_xyz", 1);
  const Trial mapped = run({}, recording);
  auto runner = GetParam()(config_, recording.camera, nullptr, {mapped.map(), true, {}});
  for (int round = 0; round < 2; ++round) {
    for (const FramePtr& frame : recording.frames)
      EXPECT_EQ(runner->process(frame).state, TrackState::kTracking);
    runner->reset();
  }
  EXPECT_EQ(runner->map().keyframes().size(), mapped.map().keyframes().size());
}

INSTANTIATE_TEST_SUITE_P(LiveAndOffline, MapOfARun,
                         ::testing::Values(&make_live_runner, &make_offline_runner));

TEST(Relocalisation, FindsAPlaceThatWasLeftLongAgo) {
  const Recording& recording = record_once("room_walk", 14);
  auto runner = make_offline_runner(small_config(DynamicMode::kOff), recording.camera, nullptr);
  Trial run(std::move(runner));
  for (const FramePtr& frame : recording.frames) run.process(frame);
  ASSERT_EQ(lost(run), 0);
  // The camera is carried back to its start in no time.
  const auto count = static_cast<std::uint32_t>(recording.frames.size());
  int frames = 0;
  for (const FramePtr& frame : again(recording, 0, count, 14.1)) {
    run.process(frame);
    if (run.results.back().state == TrackState::kTracking) break;
    if (++frames == 15) break;
  }
  EXPECT_LT(frames, 15);
  const Vec3 truth_m = (recording.truth[0].T_world_camera.inverse() *
                        recording.truth[static_cast<std::size_t>(frames)].T_world_camera)
                           .t();
  EXPECT_LT((run.results.back().T_world_camera.t() - truth_m).norm(), 0.03);
  EXPECT_TRUE(run.results.back().provisional) << "odometry does not know how it came here";
  EXPECT_GT(run.results.back().correction_m, 0.5);
}

TEST(Submap, GoesOnWhereNothingIsKnownAndIsJoinedWhereThePlaceIsSeenAgain) {
  const Recording& recording = record_once("room_walk", 14);
  constexpr std::size_t kKnown = 200;  // frames from here on are mapped first
  for (const auto make : {&make_offline_runner, &make_live_runner}) {
    Trial run(make(small_config(DynamicMode::kOff), recording.camera, nullptr, {}));
    std::vector<StampedPose> truth;
    const auto play = [&](std::size_t first, std::uint32_t first_id, double later_s) {
      for (const FramePtr& frame : again(recording, first, first_id, later_s)) {
        truth.push_back(
            {frame->stamp, recording.truth[first + index(frame->id) - first_id].T_world_camera});
        run.process(frame);
      }
    };
    play(kKnown, 0, -10);
    ASSERT_EQ(lost(run), 0);
    EXPECT_EQ(run.runner->closed_loops(), 0);
    const std::size_t carried_off_at = run.results.size();
    play(0, static_cast<std::uint32_t>(carried_off_at), 4.1);
    run.finish();

    EXPECT_LT(lost(run), 25) << "a second, and a frame or two";
    int unplaced = 0;
    for (std::size_t i = carried_off_at; i < run.results.size(); ++i) {
      const TrackResult& result = run.results[i];
      unplaced += result.unplaced ? 1 : 0;
      EXPECT_TRUE(result.provisional || !result.unplaced);
      const SE3 step = run.results[i - 1].T_odom_camera.inverse() * result.T_odom_camera;
      EXPECT_LT(step.t().norm(), 0.1) << "odometry jumps at " << i;
    }
    EXPECT_GT(unplaced, 100);
    EXPECT_FALSE(run.results.back().unplaced);
    EXPECT_GT(run.runner->closed_loops(), 0) << "the joint is told";
    const auto trajectory = run.trajectory();
    EXPECT_GT(trajectory.size(), run.results.size() - 25) << "with what came before the joint";
    const auto report = evaluate(truth, trajectory, {});
    ASSERT_TRUE(report.ok());
    EXPECT_LT(report->ate_m.rmse, 0.03);
  }
}

TEST(Submap, IsLeftOutOfTheTrajectoryAsLongAsNobodyKnowsWhereItIs) {
  const Recording& recording = record_once("room_walk", 4);
  Recording elsewhere = record_once("static_xyz", 4);
  Trial run(make_offline_runner(small_config(DynamicMode::kOff), recording.camera, nullptr, {}));
  for (const FramePtr& frame : recording.frames) run.process(frame);
  const auto count = static_cast<std::uint32_t>(recording.frames.size());
  for (const FramePtr& frame : again(elsewhere, 0, count, 4.1)) run.process(frame);
  for (const FramePtr& frame : again(recording, 40, 2 * count, 8.2)) run.process(frame);
  run.finish();
  EXPECT_EQ(run.results[count].state, TrackState::kLost);
  EXPECT_TRUE(run.results[2 * count - 1].unplaced);
  EXPECT_FALSE(run.results.back().unplaced);
  const auto trajectory = run.trajectory();
  EXPECT_LT(trajectory.size(), 2 * count);
  EXPECT_GT(trajectory.size(), count + count / 2 - 5);
}

TEST(Relocalisation, IsProvisionalWhereTheCameraMayHaveLeftTheRoomMeanwhile) {
  const Recording& recording = record_once("static_xyz", 1);
  const auto count = static_cast<std::uint32_t>(recording.frames.size());
  const auto is_provisional = [&](double unseen_s) {
    Trial run(make_offline_runner(small_config(DynamicMode::kOff), recording.camera, nullptr));
    for (const FramePtr& frame : recording.frames) run.process(frame);
    EXPECT_FALSE(run.results.back().provisional);
    for (const FramePtr& frame : again(recording, count - 3, count, unseen_s)) run.process(frame);
    EXPECT_EQ(run.results.back().state, TrackState::kTracking);
    return run.results.back().provisional;
  };
  EXPECT_FALSE(is_provisional(0.6));
  EXPECT_TRUE(is_provisional(5)) << "the next room may look the same";
}

}  // namespace
}  // namespace ygslam
