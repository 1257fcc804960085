// Frames that were placed again during a run: what is kept of them, and where.
#include <gtest/gtest.h>

#include "geometry/geometry_testing.hpp"
#include "io/testing/temp_folder.hpp"
#include "system/run_writer.hpp"
#include "system/testing/one_keyframe.hpp"

namespace ygslam {
namespace {

FrameRecord tracked(std::uint32_t id) {
  FrameRecord record;
  record.frame = FrameId{id};
  record.stamp = {to_ns(100 + id)};
  record.state = TrackState::kTracking;
  record.pose.reference = KeyframeId{0};
  return record;
}

RetrackedFrame retracked(std::uint32_t id, double x_m) {
  return {FrameId{id}, {KeyframeId{0}, SE3(Mat3::Identity(), Vec3(x_m, 0, 0))}};
}

// What is kept of them grows with the run: where no trajectory is, nothing would use it.
TEST(RunLog, FramesPlacedAgainAreKeptWithTheTrajectoryAlone) {
  const Camera camera = geometry_test::test_camera(65, 80, 60);
  for (const bool keeps : {false, true}) {
    RunLog log(keeps);
    TrackResult result;
    result.retracked = {retracked(1, 0.5), retracked(2, 0.6)};
    log.add(tracked(3), result);
    result.retracked = {retracked(1, 0.7)};
    log.add(tracked(4), result);
    log.finish(testing::map_of_one_keyframe(), camera);
    const RevisedPoses& revised = log.outcome().revised;
    ASSERT_EQ(revised.size(), keeps ? 2U : 0U);
    EXPECT_TRUE(!keeps || revised.at(FrameId{1}).t().x() == 0.7) << "the last counts";
  }
}

TEST(FrameFiles, FramesPlacedAgainAreKeptInAFile) {
  const testing::TempFolder folder;
  auto files = FrameFiles::create(folder.path(), 6, true);
  ASSERT_TRUE(files.ok());
  const std::vector<RetrackedFrame> first = {retracked(1, 0.5), retracked(2, 0.6)};
  const std::vector<RetrackedFrame> then = {retracked(1, 0.7)};
  files->add(tracked(3), first);
  files->add(tracked(4), then);
  const SE3 early(Mat3::Identity(), Vec3(0, 0, 1));
  const auto revised =
      files->revised(testing::map_of_one_keyframe(), {{FrameId{0}, early}, {FrameId{2}, early}});
  ASSERT_TRUE(revised.ok());
  ASSERT_EQ(revised->size(), 3U);
  EXPECT_EQ(revised->at(FrameId{0}).t().z(), 1);
  EXPECT_EQ(revised->at(FrameId{1}).t().x(), 0.7);
  EXPECT_EQ(revised->at(FrameId{2}).t().x(), 0.6);
  EXPECT_EQ(files->trajectory()->size(), 2U);
}

}  // namespace
}  // namespace ygslam
