#include "io/folder_truth.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "io/associated_poses.hpp"
#include "io/image_list.hpp"
#include "io/testing/small_sequence.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;
using testing::TempFolder;

/// The camera turned by a quarter about z, at (x, 2, 3).
std::string pose_text(double x) {
  return "0 -1 0 " + std::to_string(x) + "\n1 0 0 2\n0 0 1 3\n0 0 0 1\n";
}

void expect_poses(const fs::path& path, std::size_t count) {
  const auto truth = read_trajectory(path);
  ASSERT_TRUE(truth.ok()) << truth.error().message;
  ASSERT_TRUE(truth->has_stamps);
  ASSERT_EQ(truth->poses.size(), count);
  EXPECT_EQ(truth->poses[1].stamp.ns, 33'333'000) << "as images of these names have";
  EXPECT_EQ(truth->poses[1].T_world_camera.t(), Vec3(1, 2, 3));
  EXPECT_NEAR((truth->poses[1].T_world_camera.R() * Vec3(1, 0, 0) - Vec3(0, 1, 0)).norm(), 0, 1e-9);
}

TEST(FolderTruth, SevenScenesHasAPoseBesideEachImage) {
  const TempFolder folder;
  for (int i = 0; i < 3; ++i)
    testing::write(folder.path() / ("frame-00000" + std::to_string(i) + ".pose.txt"), pose_text(i));
  testing::write(folder.path() / "info2.txt", "no pose");
  expect_poses(folder.path(), 3);
  EXPECT_EQ(truth_of_folder(folder.path()), folder.path());
}

TEST(FolderTruth, ScannetHasAFolderOfPosesSomeOfWhichAreNone) {
  const TempFolder folder;
  for (int i = 0; i < 12; ++i)
    testing::write(folder.path() / ("pose/" + std::to_string(i) + ".txt"), pose_text(i));
  testing::write(folder.path() / "pose/7.txt",
                 "-inf -inf -inf -inf\n-inf -inf -inf -inf\n"
                 "-inf -inf -inf -inf\n-inf -inf -inf -inf\n");
  expect_poses(folder.path(), 11);
  expect_poses(folder.path() / "pose", 11);
}

TEST(FolderTruth, ReplicasLinesBelongToItsImages) {
  const TempFolder folder;
  std::string lines;
  for (int i = 0; i < 4; ++i) {
    testing::write(folder.path() / ("results/frame00000" + std::to_string(i) + ".jpg"), "");
    std::string line = pose_text(i);
    std::replace(line.begin(), line.end(), '\n', ' ');
    lines += line + "\n";
  }
  testing::write(folder.path() / "traj.txt", lines);
  expect_poses(folder.path(), 4);
  fs::remove(folder.path() / "results/frame000003.jpg");
  const auto other = read_trajectory(folder.path());
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().message.find("4 poses for 3 images"), std::string::npos);
}

TEST(FolderTruth, WhatIsNoPoseIsRefused) {
  EXPECT_TRUE(parse_pose_file(pose_text(1)).ok());
  EXPECT_TRUE(parse_pose_file("1 0 0 0\n0 1 0 0\n0 0 1 0").ok()) << "three rows";
  EXPECT_FALSE(parse_pose_file("nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1").value().has_value());
  for (const char* text : {"", "1 0 0 0", "2 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1",
                           "1 0 0 0 0 1 0 0 0 0 1 0 5 5 5 1", "1 0 0 x 0 1 0 0 0 0 1 0"})
    EXPECT_FALSE(parse_pose_file(text).ok()) << text;
  const TempFolder folder;
  EXPECT_FALSE(truth_of_folder(folder.path()));
  const auto none = read_trajectory(folder.path());
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().message.find("no poses: read are groundtruth.txt"), std::string::npos);
  testing::write(folder.path() / "poses/1.txt", "1 2 3");
  testing::write(folder.path() / "poses/2.txt", pose_text(0));
  EXPECT_NE(read_trajectory(folder.path()).error().message.find("1.txt: is no 4x4 matrix"),
            std::string::npos);
}

const std::string kImages = "1.5 rgb/my file.png 1.51 depth/1.png";

TEST(AssociatedPoses, StandBehindTheImagesOrBefore) {
  for (const auto& [line, words] : {std::pair{kImages + " 1.52 1 2 3 0 0 0 1", 8},
                                    {kImages + " 1 2 3 0.6 0 0 0.8", 7},
                                    {"1.52 1 2 3 0 0 0 1 " + kImages, 8},
                                    {kImages, 0},
                                    {kImages + " 1.52 1 2 3 0 0 0 2", 0}}) {
    const auto split = split_association(line);
    EXPECT_EQ(split.pose.size(), static_cast<std::size_t>(words)) << line;
    if (words > 0) {
      EXPECT_EQ(split.images, kImages);
    }
  }
}

TEST(FolderTruth, TheFolderOfARunIsNoTruthButNamesItsTrajectory) {
  const TempFolder folder;
  testing::write(folder.path() / "trajectory.txt", "1 0 0 0 0 0 0 1\n");
  const auto truth = read_trajectory(folder.path());
  ASSERT_FALSE(truth.ok());
  EXPECT_NE(
      truth.error().message.find("did you mean " + (folder.path() / "trajectory.txt").string()),
      std::string::npos);
}

TEST(AssociatedPoses, AreATrajectoryAndTheListARecording) {
  const std::string text = "# a list\n" + kImages + " 1.52 1 2 3 0 0 0 1\n" +
                           "2.5 rgb/2.png 2.5 depth/2.png 2.52 2 2 3 0 0 0 1\n";
  const auto file = parse_trajectory(text, "a.txt");
  ASSERT_TRUE(file.ok()) << file.error().message;
  ASSERT_EQ(file->poses.size(), 2U);
  EXPECT_EQ(file->poses[0].stamp.ns, 1'520'000'000);
  EXPECT_EQ(file->poses[1].T_world_camera.t(), Vec3(2, 2, 3));
  EXPECT_EQ(file->taken_for, "poses in a list of associated images");
  const auto list = parse_associations(text);
  ASSERT_EQ(list.entries.size(), 2U);
  EXPECT_EQ(list.entries[0].colour.file, "rgb/my file.png");
  EXPECT_EQ(list.entries[0].depth.file, "depth/1.png");
}

}  // namespace
}  // namespace ygslam
