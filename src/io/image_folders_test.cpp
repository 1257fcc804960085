#include "io/image_folders.hpp"

#include <gtest/gtest.h>

#include "io/frame_loader.hpp"
#include "io/testing/small_sequence.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;
using testing::TempFolder;

void write_images(const fs::path& root, const std::string& colour, const std::string& depth) {
  Rng rng(3);
  testing::write(root / colour, colour.ends_with(".png")
                                    ? encode_png(testing::random_colour(32, 24, rng))
                                    : encode_jpeg(testing::random_colour(32, 24, rng)));
  ygslam::Image<std::uint16_t> raw(32, 24);
  for (auto& value : raw) value = 2000;
  testing::write(root / depth, encode_png(raw));
}

constexpr const char* kCalibration = "fx 30\nfy 30\ncx 15.5\ncy 11.5\ndepth_scale 1000\n";

TEST(ImageFolders, ReplicaIsReadWithItsOwnCamera) {
  const TempFolder folder;
  const fs::path root = folder.path() / "room0";
  for (const char* number : {"000000", "000001", "000010"})
    write_images(root, std::string("results/frame") + number + ".jpg",
                 std::string("results/depth") + number + ".png");
  testing::write(root / "traj.txt", "1 0 0 0\n");
  testing::write(folder.path() / "cam_params.json",
                 R"({"camera": {"w": 32, "h": 24, "fx": 30.0, "fy": 31.0, "cx": 15.5, "cy": 11.5,
                     "scale": 6553.5}})");
  const auto sequence = open_folder_sequence(root);
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  ASSERT_EQ(sequence.value().pairs.size(), 3U);
  EXPECT_EQ(sequence.value().camera.fy, 31);
  EXPECT_EQ(sequence.value().camera.depth_scale, 6553.5);
  EXPECT_EQ(sequence.value().camera.height, 24);
  EXPECT_EQ(sequence.value().pairs[1].stamp.ns, 33'333'000);
  EXPECT_EQ(sequence.value().pairs[2].stamp.ns, 333'333'000) << "the tenth at 30 Hz";
  EXPECT_EQ(sequence.value().pairs[2].depth_file, "results/depth000010.png");
  const auto frame = load_frame(sequence.value(), 0);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  EXPECT_NEAR(frame.value().depth_m.at(3, 3), 2000 / 6553.5, 1e-6);
}

TEST(ImageFolders, ScannetAsExportedIsReadInTheOrderOfItsNumbers) {
  const TempFolder folder;
  for (const char* number : {"0", "2", "10"})
    write_images(folder.path(), std::string("color/") + number + ".jpg",
                 std::string("depth/") + number + ".png");
  testing::write(folder.path() / "intrinsic/intrinsic_color.txt",
                 "30 0 15.5 0\n0 31 11.5 0\n0 0 1 0\n0 0 0 1\n");
  const auto sequence = open_folder_sequence(folder.path());
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  ASSERT_EQ(sequence.value().pairs.size(), 3U);
  EXPECT_EQ(sequence.value().pairs[1].colour_file, "color/2.jpg");
  EXPECT_EQ(sequence.value().camera.fy, 31);
  EXPECT_EQ(sequence.value().camera.depth_scale, 1000);
  testing::write(folder.path() / "intrinsic/intrinsic_color.txt", "30 0 15.5\n");
  const auto broken = open_folder_sequence(folder.path());
  ASSERT_FALSE(broken.ok());
  EXPECT_EQ(broken.error().kind, ErrorKind::kConfig);
}

TEST(ImageFolders, StampsInNamesAreTakenAsStamps) {
  const TempFolder folder;
  write_images(folder.path(), "rgb/1305031102.175304.png", "depth/1305031102.180100.png");
  write_images(folder.path(), "rgb/1305031102.211214.png", "depth/1305031102.212000.png");
  testing::write(folder.path() / "calibration.txt", kCalibration);
  const auto sequence = open_folder_sequence(folder.path());
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  ASSERT_EQ(sequence.value().pairs.size(), 2U);
  EXPECT_EQ(sequence.value().pairs[0].stamp.ns, 1'305'031'102'175'304'000);
  EXPECT_EQ(sequence.value().pairs[0].depth_stamp.ns, 1'305'031'102'180'100'000);
}

TEST(ImageFolders, WhatHasNoPartnerOrNoNumberIsLeftOut) {
  const TempFolder folder;
  for (const char* name : {"img_1", "img_2", "img_3", "img_5"})
    write_images(folder.path(), std::string("images/") + name + ".JPG",
                 std::string("depth/") + name + ".png");
  fs::remove(folder.path() / "depth/img_2.png");
  write_images(folder.path(), "images/cover.jpg", "depth/img_7.png");
  testing::write(folder.path() / "images/notes.txt", "no image");
  testing::write(folder.path() / "calibration.txt", kCalibration);
  const auto sequence = open_folder_sequence(folder.path());
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  ASSERT_EQ(sequence.value().pairs.size(), 3U);
  EXPECT_EQ(sequence.value().pairs[1].colour_file, "images/img_3.JPG");
  EXPECT_EQ(sequence.value().counts.malformed, 1U);
  EXPECT_EQ(sequence.value().warnings.size(), 1U);
}

TEST(ImageFolders, ListsGoBeforeAndNothingIsInventedWithoutACamera) {
  const TempFolder folder;
  testing::SmallSequence{.count = 3}.write_to(folder.path());
  const auto listed = open_folder_sequence(folder.path());
  ASSERT_TRUE(listed.ok()) << listed.error().message;
  EXPECT_EQ(listed.value().pairs.front().stamp.ns, 1'000'000'000'000);

  fs::remove(folder.path() / "rgb.txt");
  fs::remove(folder.path() / "depth.txt");
  EXPECT_EQ(open_folder_sequence(folder.path()).value().pairs.front().stamp.ns, 1'000'000'000'000)
      << "by their names";
  fs::remove(folder.path() / "calibration.txt");
  const auto unknown = open_folder_sequence(folder.path());
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().kind, ErrorKind::kConfig);
  fs::remove_all(folder.path() / "depth");
  const auto half = open_folder_sequence(folder.path());
  ASSERT_FALSE(half.ok());
  EXPECT_EQ(half.error().kind, ErrorKind::kInput);
}

}  // namespace
}  // namespace ygslam
