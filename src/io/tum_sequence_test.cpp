#include "io/tum_sequence.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/testing/recorded_data.hpp"
#include "io/frame_loader.hpp"
#include "io/testing/small_sequence.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;
using testing::SmallSequence;
using testing::TempFolder;
using testing::warns_of;

Error refusal_of(const fs::path& root) {
  const auto sequence = open_tum_sequence(root);
  EXPECT_FALSE(sequence.ok());
  return sequence.ok() ? Error{} : sequence.error();
}

TEST(Sequence, ListsAndAssociationsGiveTheSamePairs) {
  const TempFolder folder;
  SmallSequence{.depth_offset_ns = 3'000'000}.write_to(folder.path() / "lists");
  SmallSequence{.depth_offset_ns = 3'000'000, .associations = true}.write_to(folder.path() /
                                                                             "pairs");
  const auto lists = open_tum_sequence(folder.path() / "lists");
  const auto pairs = open_tum_sequence(folder.path() / "pairs");
  ASSERT_TRUE(lists.ok()) << lists.error().message;
  ASSERT_TRUE(pairs.ok()) << pairs.error().message;
  ASSERT_EQ(lists->pairs.size(), 10U);
  ASSERT_EQ(pairs->pairs.size(), 10U);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(lists->pairs[i].stamp, pairs->pairs[i].stamp);
    EXPECT_EQ(lists->pairs[i].depth_file, pairs->pairs[i].depth_file);
  }
  EXPECT_EQ(lists->stamp_decimals, 6);
  EXPECT_TRUE(lists->warnings.empty());
}

TEST(Sequence, SizeComesFromTheFirstReadableImage) {
  const TempFolder folder;
  const SmallSequence small{
      .width = 48, .height = 40, .calibration = "fx 40\nfy 40\ncx 24\ncy 20\n"};
  small.write_to(folder.path());
  testing::write(folder.path() / small.colour_file(0), "no image");
  const auto sequence = open_tum_sequence(folder.path());
  ASSERT_TRUE(sequence.ok());
  EXPECT_EQ(sequence->camera.width, 48);
  EXPECT_EQ(sequence->camera.height, 40);
  EXPECT_EQ(sequence->camera_source, "calibration.txt");
}

TEST(Sequence, CameraComesFromTheCallerThenTheFileThenTheName) {
  const TempFolder folder;
  const fs::path root = folder.path() / "rgbd_dataset_freiburg3_test";
  SmallSequence{.count = 2, .width = 640, .height = 480, .calibration = ""}.write_to(root);
  const auto preset = open_tum_sequence(root / "");  // a trailing slash is no other folder
  ASSERT_TRUE(preset.ok()) << preset.error().message;
  EXPECT_EQ(preset->camera.fx, 535.4);
  EXPECT_EQ(preset->camera_source, "preset TUM freiburg3");
  testing::write(root / "calibration.txt", "fx 500\nfy 500\ncx 320\ncy 240\n");
  EXPECT_EQ(open_tum_sequence(root)->camera.fx, 500);
  CameraConfig given;
  given.fx = given.fy = 600;
  given.cx = 320;
  given.cy = 240;
  given.width = given.height = 0;
  const auto with_given = open_tum_sequence(root, {.colour = given});
  ASSERT_TRUE(with_given.ok()) << with_given.error().message;
  EXPECT_EQ(with_given->camera.fx, 600);
  EXPECT_EQ(with_given->camera.width, 640);
}

TEST(Sequence, AJsonCameraInTheFolderIsFoundAndTwoMustAgree) {
  const TempFolder folder;
  SmallSequence{.count = 2, .calibration = ""}.write_to(folder.path());
  const fs::path transforms = folder.path() / "transforms.json";
  testing::write(transforms, R"({"camera_angle_x": 0.7, "frames": []})");  // no camera that is read
  EXPECT_NE(refusal_of(folder.path()).message.find("no calibration.txt, camera_intrinsic.json"),
            std::string::npos);
  testing::write(folder.path() / "camera_intrinsic.json",
                 R"({"width": 32, "height": 24,
                     "intrinsic_matrix": [30, 0, 0, 0, 31, 0, 15.5, 11.5, 1]})");
  const auto open3d = open_tum_sequence(folder.path());
  ASSERT_TRUE(open3d.ok()) << open3d.error().message;
  EXPECT_EQ(open3d->camera.fy, 31);
  EXPECT_EQ(open3d->camera.depth_scale, 1000);
  EXPECT_NE(open3d->notes.front().find("camera_intrinsic.json is taken for intrinsics of Open3D"),
            std::string::npos);
  testing::write(transforms, R"({"fl_x": 30.1, "fl_y": 31, "cx": 15.5, "cy": 11.5, "frames": []})");
  EXPECT_TRUE(open_tum_sequence(folder.path()).ok()) << "rounded otherwise";
  testing::write(transforms, R"({"fl_x": 33, "fl_y": 31, "cx": 15.5, "cy": 11.5, "frames": []})");
  const Error two = refusal_of(folder.path());
  EXPECT_EQ(two.kind, ErrorKind::kConfig);
  EXPECT_NE(two.message.find("camera_intrinsic.json and "), std::string::npos) << two.message;
  EXPECT_NE(two.message.find("transforms.json tell of two cameras"), std::string::npos);
  testing::write(folder.path() / "calibration.txt", "fx 29\nfy 29\ncx 16\ncy 12\n");
  EXPECT_EQ(open_tum_sequence(folder.path())->camera.fx, 29) << "written for this program";
}

TEST(Sequence, F20WithoutACameraOrWithABadOneItIsAConfigurationError) {
  const TempFolder folder;
  SmallSequence{.calibration = ""}.write_to(folder.path() / "none");
  EXPECT_EQ(refusal_of(folder.path() / "none").kind, ErrorKind::kConfig);
  SmallSequence{.calibration = "fx 30\nfy nan\ncx 16\ncy 12\n"}.write_to(folder.path() / "nan");
  const Error nan = refusal_of(folder.path() / "nan");
  EXPECT_EQ(nan.kind, ErrorKind::kConfig);
  EXPECT_NE(nan.message.find("calibration.txt:2: fy:"), std::string::npos) << nan.message;
  SmallSequence{.calibration = "# c\nfx 30\nfy 30\ncx 1600\ncy 12\n"}.write_to(folder.path() /
                                                                               "cx");
  const Error cx = refusal_of(folder.path() / "cx");
  EXPECT_EQ(cx.kind, ErrorKind::kConfig);
  EXPECT_NE(cx.message.find("calibration.txt:4: cx:"), std::string::npos) << cx.message;
}

TEST(Sequence, MissingFolderListsAndImagesAreInputErrorsThatNameThem) {
  const TempFolder folder;
  EXPECT_EQ(refusal_of(folder.path() / "nowhere").kind, ErrorKind::kInput);
  EXPECT_NE(refusal_of(folder.path()).message.find("rgb.txt: no such file"), std::string::npos);
  const SmallSequence small{.count = 3};
  small.write_to(folder.path());
  fs::remove_all(folder.path() / "rgb");
  const Error error = refusal_of(folder.path());
  EXPECT_EQ(error.kind, ErrorKind::kInput);
  EXPECT_NE(error.message.find("none of 3 colour images can be read"), std::string::npos);
  testing::write(folder.path() / "rgb.txt", "# nothing\n");
  EXPECT_EQ(refusal_of(folder.path()).kind, ErrorKind::kInput);
}

TEST(Sequence, F11AllStampsBadIsAnInputErrorSomeBadAWarning) {
  const TempFolder folder;
  const SmallSequence small{.associations = true};
  small.write_to(folder.path());
  const std::string good = testing::read(folder.path() / "associations.txt");
  testing::write(folder.path() / "associations.txt", "nan rgb/a.png nan depth/a.png\nx y z w\n");
  const Error error = refusal_of(folder.path());
  EXPECT_EQ(error.kind, ErrorKind::kInput);
  EXPECT_NE(error.message.find("associations.txt:1"), std::string::npos) << error.message;
  testing::write(folder.path() / "associations.txt",
                 good + "1000.0 rgb/old.png 1000.0 depth/x.png\n");
  const auto sequence = open_tum_sequence(folder.path());
  ASSERT_TRUE(sequence.ok());
  EXPECT_EQ(sequence->pairs.size(), 10U);
  EXPECT_EQ(sequence->counts.doubled, 1U);
  EXPECT_TRUE(warns_of(*sequence, "1 of 11 lines left out"));
}

TEST(Sequence, ListedFilesThatDoNotExistAreToldOnce) {
  const TempFolder folder;
  const SmallSequence small{.count = 30};
  small.write_to(folder.path());
  for (const int i : {4, 5, 6, 20}) fs::remove(folder.path() / small.depth_file(i));
  fs::remove(folder.path() / small.colour_file(9));
  testing::write(folder.path() / "depth.txt",
                 testing::read(folder.path() / "depth.txt") + "1000.017 depth/between.png\n");
  const auto sequence = open_tum_sequence(folder.path());
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  EXPECT_EQ(sequence->pairs.size(), 30U) << "who reads them tells of each";
  ASSERT_EQ(sequence->absent.size(), 1U) << "nobody reads it";
  EXPECT_EQ(sequence->absent[0].file, "depth/between.png");
  EXPECT_EQ(sequence->warnings.size(), 3U) << "of both lists, and of the line that was added";
  EXPECT_TRUE(
      warns_of(*sequence, "depth.txt: 5 of 31 listed files do not exist, first depth/between.png"));
}

TEST(Sequence, ImagesThatSeveralLinesNameAreToldOnce) {
  const TempFolder folder;
  const SmallSequence small{.count = 6};
  small.write_to(folder.path());
  std::string text;
  for (int i = 0; i < 6; ++i)
    text += format_stamp({small.first_ns + i * small.interval_ns}, 6) + " " +
            small.colour_file(i < 3 ? 0 : i) + "\n";
  testing::write(folder.path() / "rgb.txt", text);
  const auto sequence = open_tum_sequence(folder.path());
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  ASSERT_EQ(sequence->warnings.size(), 1U);
  EXPECT_TRUE(warns_of(
      *sequence,
      "rgb.txt: 2 of 6 listed images are named by a line before, first " + small.colour_file(0)));
}

TEST(Sequence, ListsInAnyOrderAreSortedAndItIsToldOnce) {
  const TempFolder folder;
  const SmallSequence small{.count = 24, .associations = true};
  small.write_to(folder.path());
  const auto sorted = open_tum_sequence(folder.path());
  std::string reversed;
  const std::string text = testing::read(folder.path() / "associations.txt");
  for (const TextLine& line : data_lines(text)) reversed = std::string(line.text) + "\n" + reversed;
  testing::write(folder.path() / "associations.txt", reversed);
  const auto sequence = open_tum_sequence(folder.path());
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  ASSERT_EQ(sequence->pairs.size(), 24U);
  for (std::size_t i = 0; i < 24; ++i) {
    EXPECT_EQ(sequence->pairs[i].colour_file, sorted->pairs[i].colour_file);
    EXPECT_EQ(sequence->pairs[i].depth_file, sorted->pairs[i].depth_file);
  }
  ASSERT_EQ(sequence->warnings.size(), 1U);
  EXPECT_TRUE(warns_of(*sequence, "23 of 24 lines are older than a line before: sorted"));
}

TEST(Sequence, AClockThatWasSetBackIsToldAndNoFrameIsLost) {
  for (const bool associations : {true, false}) {
    const TempFolder folder;
    const SmallSequence small{.count = 40, .associations = associations};
    small.write_to(folder.path());
    const auto steady = open_tum_sequence(folder.path());
    for (const char* name : {"associations.txt", "rgb.txt", "depth.txt"}) {
      if (!fs::exists(folder.path() / name)) continue;
      const std::string as_recorded = testing::read(folder.path() / name);
      std::string text;
      int line_number = 0;
      for (const TextLine& line : data_lines(as_recorded)) {
        std::string words;
        for (const std::string_view word : words_of(line.text)) {
          const auto stamp = parse_stamp(word);
          const bool is_set_back = stamp && line_number >= 20;
          words +=
              (is_set_back ? format_stamp({stamp->stamp.ns - 500'000'000}, 6) : std::string(word)) +
              " ";
        }
        text += words + "\n";
        ++line_number;
      }
      testing::write(folder.path() / name, text);
    }
    const auto sequence = open_tum_sequence(folder.path());
    ASSERT_TRUE(sequence.ok()) << sequence.error().message;
    ASSERT_EQ(sequence->pairs.size(), 40U);
    for (std::size_t i = 0; i < 40; ++i) {
      EXPECT_EQ(sequence->pairs[i].colour_file, steady->pairs[i].colour_file);
      EXPECT_EQ(sequence->pairs[i].depth_file, steady->pairs[i].depth_file);
      EXPECT_NEAR(seconds_between(sequence->pairs[i].stamp, steady->pairs[i].stamp), 0, 0.001);
    }
    EXPECT_TRUE(warns_of(*sequence, "the clock was set back"));
  }
}

TEST(Sequence, AssociationsOfAPartAreTold) {
  for (const int count : {3, 8}) {
    const TempFolder folder;
    const SmallSequence small{.count = 4, .associations = true};
    small.write_to(folder.path());
    std::string list;
    for (int i = 0; i < count; ++i) list += std::to_string(i) + ".5 rgb/a.png\n";
    testing::write(folder.path() / "rgb.txt", list);
    const auto sequence = open_tum_sequence(folder.path());
    ASSERT_TRUE(sequence.ok());
    EXPECT_EQ(warns_of(*sequence, "rgb.txt beside it"),
              count > 2 * static_cast<int>(sequence->pairs.size()));
  }
}

TEST(Sequence, AListWithLinesOfTheFirstMacintoshIsRefused) {
  const TempFolder folder;
  const SmallSequence small{.count = 3, .associations = true};
  small.write_to(folder.path());
  std::string text = testing::read(folder.path() / "associations.txt");
  std::replace(text.begin(), text.end(), '\n', '\r');
  testing::write(folder.path() / "associations.txt", text);
  EXPECT_NE(refusal_of(folder.path()).message.find("associations.txt:1: a carriage return"),
            std::string::npos);
}

TEST(Sequence, AListInUtf16IsNamedAsSuch) {
  const TempFolder folder;
  const SmallSequence small{.count = 3, .associations = true};
  small.write_to(folder.path());
  const std::string text = testing::read(folder.path() / "associations.txt");
  for (const std::string mark : {"\xFF\xFE", "\xFE\xFF", ""}) {
    std::string wide = mark;
    for (const char c : text)
      wide += mark == "\xFE\xFF" ? std::string{'\0', c} : std::string{c, '\0'};
    testing::write(folder.path() / "associations.txt", wide);
    EXPECT_NE(refusal_of(folder.path()).message.find("associations.txt: is UTF-16 text"),
              std::string::npos)
        << refusal_of(folder.path()).message;
  }
}

TEST(Sequence, F12WithoutPairsTheInputErrorTellsTheOffset) {
  const TempFolder folder;
  SmallSequence{.interval_ns = 200'000'000, .depth_offset_ns = 50'000'000}.write_to(folder.path());
  const Error error = refusal_of(folder.path());
  EXPECT_EQ(error.kind, ErrorKind::kInput);
  EXPECT_NE(error.message.find("offset by 50 ms"), std::string::npos) << error.message;
}

TEST(Sequence, F12FewerThanATenthPairedIsAnInputError) {
  const TempFolder folder;
  const SmallSequence small{.count = 30};
  small.write_to(folder.path());
  std::string depth = testing::read(folder.path() / "depth.txt");
  const auto keep = [&](int lines) {
    std::size_t end = depth.find('\n') + 1;  // the comment
    for (int i = 0; i < lines; ++i) end = depth.find('\n', end) + 1;
    testing::write(folder.path() / "depth.txt", depth.substr(0, end));
  };
  keep(2);
  EXPECT_EQ(refusal_of(folder.path()).kind, ErrorKind::kInput);
  keep(3);
  EXPECT_TRUE(open_tum_sequence(folder.path()).ok());
}

TEST(Sequence, F31ImagesOutsideTheFolderAreNotOpened) {
  const TempFolder folder;
  const SmallSequence small{.count = 3, .associations = true};
  small.write_to(folder.path() / "seq");
  testing::write(folder.path() / "seq/associations.txt",
                 "1000 ../seq/" + small.colour_file(0) + " 1000 " + small.depth_file(0) + "\n");
  EXPECT_EQ(refusal_of(folder.path() / "seq").kind, ErrorKind::kInput);
}

TEST(Sequence, F37PathsWithSpacesAndUtf8Work) {
  const TempFolder folder("ygslam Küche mit Leuten");
  const SmallSequence small;
  small.write_to(folder.path() / "ein Raum");
  const auto sequence = open_tum_sequence(folder.path() / "ein Raum");
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  EXPECT_TRUE(load_frame(*sequence, 9).ok());
}

TEST(LoadFrame, GivesColourGreyAndDepthOfTheSamePair) {
  const TempFolder folder;
  const SmallSequence small;
  small.write_to(folder.path());
  const auto sequence = open_tum_sequence(folder.path());
  const auto frame = load_frame(*sequence, 4);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  const auto raw = decode_depth(testing::read(folder.path() / small.depth_file(4)));
  const float expected = static_cast<float>(raw->at(3, 2)) / 5000.0F;
  const bool in_range = expected >= 0.3F && expected <= 8.0F;
  EXPECT_FLOAT_EQ(frame->depth_m.at(3, 2), in_range ? expected : 0.0F);
  EXPECT_EQ(frame->stamp, sequence->pairs[4].stamp);
  EXPECT_EQ(frame->id, FrameId{4});
  EXPECT_TRUE(frame->grey.same_size(frame->colour));
}

TEST(Sequence, RecordedSequencesOpenAndTheirFramesDecode) {
  const fs::path data = testing::shared_folder() / "data";
  YGSLAM_NEEDS_RECORDED(data);
  for (const auto& folder : fs::directory_iterator(data)) {
    if (!fs::exists(folder.path() / "associations.txt")) continue;
    const auto sequence = open_tum_sequence(folder.path());
    ASSERT_TRUE(sequence.ok()) << sequence.error().message;
    EXPECT_EQ(sequence->counts.left_out(), 0U);
    EXPECT_TRUE(sequence->warnings.empty()) << sequence->warnings.front();
    for (std::size_t i = 0; i < sequence->pairs.size(); i += 60) {
      const auto frame = load_frame(*sequence, i);
      ASSERT_TRUE(frame.ok()) << frame.error().message;
      const auto with_depth = std::count_if(frame->depth_m.begin(), frame->depth_m.end(),
                                            [](float d) { return d > 0; });
      EXPECT_GT(with_depth, 640 * 480 / 4) << folder.path() << " " << i;
    }
  }
}

TEST(TumSequence, NumberedFramesOfIclNuimAreToldAndMayNameDepthFirst) {
  const TempFolder folder;
  testing::SmallSequence small{.count = 12};
  small.write_to(folder.path());
  std::string lines;
  for (int i = 0; i < small.count; ++i)
    lines += std::to_string(i) + " ./" + small.depth_file(i) + " " + std::to_string(i) + " ./" +
             small.colour_file(i) + "\n";
  testing::write(folder.path() / "associations.txt", lines);
  const auto sequence = open_tum_sequence(folder.path());
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  ASSERT_EQ(sequence->pairs.size(), 12U);
  EXPECT_EQ(sequence->pairs[1].colour_file, "./" + small.colour_file(1));
  EXPECT_EQ(sequence->pairs[1].stamp.ns, 1'000'000'000);
  ASSERT_EQ(sequence->notes.size(), 1U);
  EXPECT_NE(sequence->notes[0].find("numbers of frames?"), std::string::npos);
}

}  // namespace
}  // namespace ygslam
