#include "io/image_folders.hpp"

#include <fmt/format.h>
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

/// A folder as Replica's.
fs::path replica_in(const TempFolder& folder) {
  fs::path root = folder.path() / "room0";
  for (const char* number : {"000000", "000001", "000010"})
    write_images(root, std::string("results/frame") + number + ".jpg",
                 std::string("results/depth") + number + ".png");
  testing::write(root / "traj.txt", "1 0 0 0\n");
  testing::write(folder.path() / "cam_params.json",
                 R"({"camera": {"w": 32, "h": 24, "fx": 30.0, "fy": 31.0, "cx": 15.5, "cy": 11.5,
                     "scale": 6553.5}})");
  return root;
}

TEST(ImageFolders, ReplicaIsReadWithItsOwnCamera) {
  const TempFolder folder;
  const fs::path root = replica_in(folder);
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

TEST(ImageFolders, CamerasInSeveralFilesMustAgree) {
  const TempFolder folder;
  const fs::path root = replica_in(folder);
  const fs::path transforms = root / "transforms.json";
  const auto own = open_folder_sequence(root);
  ASSERT_TRUE(own.ok()) << own.error().message;
  const auto nerfstudio = [&](double fx) {
    return fmt::format(R"({{"fl_x": {}, "fl_y": {}, "cx": {}, "cy": {}}})", fx, own->camera.fy,
                       own->camera.cx, own->camera.cy);
  };
  testing::write(transforms, nerfstudio(own->camera.fx));
  const auto both = open_folder_sequence(root);
  ASSERT_TRUE(both.ok()) << both.error().message;
  EXPECT_EQ(both->camera.depth_scale, own->camera.depth_scale) << "which transforms.json lacks";
  testing::write(transforms, nerfstudio(own->camera.fx + 3));
  const auto differing = open_folder_sequence(root);
  ASSERT_FALSE(differing.ok());
  EXPECT_NE(differing.error().message.find("cam_params.json and "), std::string::npos)
      << differing.error().message;
  EXPECT_NE(differing.error().message.find("transforms.json tell of two"), std::string::npos);
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

TEST(ImageFolders, DepthThatIsNumberedFromOneIsTold) {
  for (const int first : {0, 1}) {
    const TempFolder folder;
    for (int i = 0; i < 5; ++i)
      write_images(folder.path(), "rgb/" + std::to_string(i) + ".png",
                   "depth/" + std::to_string(i + first) + ".png");
    testing::write(folder.path() / "calibration.txt", kCalibration);
    const auto sequence = open_folder_sequence(folder.path());
    ASSERT_TRUE(sequence.ok()) << sequence.error().message;
    ASSERT_EQ(sequence->warnings.size(), static_cast<std::size_t>(first));
    if (first == 1) {
      EXPECT_NE(sequence->warnings[0].find("depth/1.png to depth/5.png are as many, but numbered"),
                std::string::npos);
    }
  }
}

TEST(ImageFolders, FilesOfOtherRecordersAreNamed) {
  const TempFolder folder;
  for (const auto& [name, words] : {std::pair{"a.sens", "tools/convert_recording.py makes"},
                                    {"a.R3D", "tools/convert_recording.py makes"},
                                    {"a.mp4", "is a video"},
                                    {"a.zip", "a .zip file is not read"}}) {
    testing::write(folder.path() / name, "x");
    const auto refused = open_folder_sequence(folder.path() / name);
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.error().message.find(words), std::string::npos) << refused.error().message;
  }
}

TEST(ImageFolders, SevenScenesAndBundleFusionLieInOneFolder) {
  const TempFolder folder;
  for (const char* number : {"000000", "000001", "000002"}) {
    const std::string start = std::string("frame-") + number;
    write_images(folder.path(), start + ".color.jpg", start + ".depth.png");
    testing::write(folder.path() / (start + ".pose.txt"), "1 0 0 0\n");
  }
  testing::write(folder.path() / "calibration.txt", kCalibration);
  const auto sequence = open_folder_sequence(folder.path());
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  ASSERT_EQ(sequence.value().pairs.size(), 3U);
  EXPECT_EQ(sequence.value().pairs[2].depth_file, "frame-000002.depth.png");
  EXPECT_EQ(sequence.value().pairs[2].stamp.ns, 66'666'000);
  ASSERT_EQ(sequence.value().notes.size(), 1U);
  EXPECT_NE(sequence.value().notes[0].find("numbers of frames at 30 Hz"), std::string::npos);
}

TEST(ImageFolders, SecondsAndNanosecondsInNamesAreToldAndInOrder) {
  const TempFolder folder;
  for (const char* name : {"1305031102_5304000", "1305031102_38637000", "1305031102_971970000",
                           "1305031103_5303000", "1305031103_38636000"})
    write_images(folder.path(), std::string("color/") + name + ".jpg",
                 std::string("depth/") + name + ".png");
  testing::write(folder.path() / "calibration.txt", kCalibration);
  const auto sequence = open_folder_sequence(folder.path());
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  ASSERT_EQ(sequence.value().pairs.size(), 5U);
  EXPECT_EQ(sequence.value().pairs[0].colour_file, "color/1305031102_5304000.jpg");
  EXPECT_EQ(sequence.value().pairs[3].stamp.ns, 1'305'031'103'005'303'000);
  EXPECT_EQ(
      sequence.value().notes.at(0),
      "names of images are taken as seconds and nanoseconds: color/1305031103_38636000.jpg at "
      "1305031103.038636000 s; seconds and nanoseconds: depth/1305031103_38636000.png at "
      "1305031103.038636000 s");
}

TEST(ImageFolders, NamesThatAreNotClearAreRefusedAndShown) {
  const TempFolder folder;
  for (int i = 0; i < 6; ++i)
    write_images(folder.path(), "rgb/" + std::to_string(33 * i) + ".png",
                 "depth/" + std::to_string(33 * i) + ".png");
  testing::write(folder.path() / "calibration.txt", kCalibration);
  const auto unclear = open_folder_sequence(folder.path());
  ASSERT_FALSE(unclear.ok());
  EXPECT_EQ(unclear.error().kind, ErrorKind::kInput);
  for (const char* part :
       {"rgb: ", "'0' (0) and '132' (132)", "33 apart, or milliseconds", "rgb.txt"})
    EXPECT_NE(unclear.error().message.find(part), std::string::npos) << unclear.error().message;
  const TempFolder mixed;
  for (int i = 0; i < 6; ++i)
    write_images(mixed.path(), "rgb/" + std::to_string(1'305'031'102'175 + 33 * i) + ".png",
                 "depth/" + std::to_string(i) + ".png");
  const auto other = open_folder_sequence(mixed.path());
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().message.find("would be milliseconds since 1970"), std::string::npos);
}

TEST(ImageFolders, AFolderThatIsNoneSaysWhatItHoldsAndWhereOneIs) {
  const TempFolder folder;
  const fs::path root = folder.path() / "walk";
  testing::SmallSequence{.count = 3}.write_to(root);
  const auto refusal = [](const fs::path& path) {
    const auto sequence = open_folder_sequence(path);
    EXPECT_FALSE(sequence.ok());
    EXPECT_TRUE(sequence.ok() || sequence.error().kind == ErrorKind::kInput);
    return sequence.ok() ? std::string() : sequence.error().message;
  };
  const auto expect_told = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect_told(refusal(root / "rgb"), "it holds 3 .png; read are rgb.txt and depth.txt");
  expect_told(refusal(root / "rgb"), "did you mean its parent ");
  expect_told(refusal(root / "rgb.txt"), "did you mean its parent ");
  expect_told(refusal(folder.path()), "it contains 1: walk; did you mean " + root.string() + "?");
  fs::create_directories(folder.path() / "else/img");
  testing::write(folder.path() / "else/a.txt", "x");
  expect_told(refusal(folder.path() / "else"), "it holds img/, 1 .txt; read are");
  fs::create_directories(folder.path() / "empty");
  expect_told(refusal(folder.path() / "empty"), "it holds nothing; read are");
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

constexpr const char* kFusionInfo =
    "m_versionNumber = 4\nm_sensorName = StructureSensor\nm_colorWidth = 32\nm_colorHeight = 24\n"
    "m_depthWidth = 32\nm_depthHeight = 24\nm_depthShift = 1000\n"
    "m_calibrationColorIntrinsic = 30 0 15.5 0 0 31 11.5 0 0 0 1 0 0 0 0 1 \n"
    "m_calibrationColorExtrinsic = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 \n"
    "m_calibrationDepthIntrinsic = 30 0 15.5 0 0 31 11.5 0 0 0 1 0 0 0 0 1 \n"
    "m_calibrationDepthExtrinsic = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 \nm_frames.size = 3\n";

TEST(ImageFolders, BundleFusionsInfoTellsOfBothCameras) {
  const TempFolder folder;
  for (const char* number : {"000000", "000001", "000002"})
    write_images(folder.path(), std::string("frame-") + number + ".color.jpg",
                 std::string("frame-") + number + ".depth.png");
  testing::write(folder.path() / "info.txt", kFusionInfo);
  const auto sequence = open_folder_sequence(folder.path());
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  EXPECT_EQ(sequence->camera.fy, 31);
  EXPECT_EQ(sequence->camera.depth_scale, 1000);
  EXPECT_EQ(sequence->registration, nullptr) << "one and the same camera";
  std::string apart = kFusionInfo;
  apart.replace(apart.find("DepthIntrinsic = 30"), 19, "DepthIntrinsic = 28");
  apart.replace(apart.find("DepthExtrinsic = 1 0 0 0"), 24, "DepthExtrinsic = 1 0 0 0.02");
  testing::write(folder.path() / "_info.txt", apart);
  fs::remove(folder.path() / "info.txt");
  const auto registered = open_folder_sequence(folder.path());
  ASSERT_TRUE(registered.ok()) << registered.error().message;
  ASSERT_NE(registered->registration, nullptr);
  EXPECT_EQ(registered->registration->depth_camera().fx, 28);
  EXPECT_NEAR(registered->registration->baseline_m(), 0.02, 1e-6);
  std::string narrow = kFusionInfo;  // the depth camera's middle lies outside its image
  narrow.replace(narrow.find("m_depthWidth = 32"), 17, "m_depthWidth = 9");
  testing::write(folder.path() / "_info.txt", narrow);
  const auto outside = open_folder_sequence(folder.path());
  ASSERT_FALSE(outside.ok());
  EXPECT_NE(outside.error().message.find("m_calibrationDepthIntrinsic: cx"), std::string::npos)
      << outside.error().message;
  testing::write(folder.path() / "_info.txt", "m_calibrationColorIntrinsic = 1 2 3\n");
  const auto broken = open_folder_sequence(folder.path());
  ASSERT_FALSE(broken.ok());
  EXPECT_EQ(broken.error().kind, ErrorKind::kConfig);
}

TEST(ImageFolders, SevenScenesHasAPresetThatIsTold) {
  const TempFolder folder;
  for (const char* number : {"000000", "000001"}) {
    const std::string start = std::string("frame-") + number;
    testing::write(folder.path() / (start + ".color.png"), encode_png(ColourImage(640, 480)));
    testing::write(folder.path() / (start + ".depth.png"),
                   encode_png(ygslam::Image<std::uint16_t>(640, 480)));
  }
  const auto sequence = open_folder_sequence(folder.path());
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  EXPECT_EQ(sequence->camera.fx, 585);
  EXPECT_EQ(sequence->camera.cy, 240);
  EXPECT_EQ(sequence->camera.depth_scale, 1000);
  EXPECT_EQ(sequence->camera_source, "preset 7-Scenes");
}

TEST(ImageFolders, OfTwoImagesWithOneNameNoneIsChosen) {
  const TempFolder folder;
  for (const char* name : {"1", "2"})
    write_images(folder.path(), std::string("rgb/") + name + ".png",
                 std::string("depth/") + name + ".png");
  testing::write(folder.path() / "depth/1.npy", "x");
  testing::write(folder.path() / "calibration.txt", kCalibration);
  const auto sequence = open_folder_sequence(folder.path());
  ASSERT_FALSE(sequence.ok());
  EXPECT_EQ(sequence.error().kind, ErrorKind::kInput);
  EXPECT_NE(sequence.error().message.find("which one is it, "), std::string::npos);
  EXPECT_NE(sequence.error().message.find("1.npy"), std::string::npos);
}

}  // namespace
}  // namespace ygslam
