#include "segment/recorded_masks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "core/rng.hpp"
#include "image/cv_view.hpp"
#include "segment/png_ids.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;

class RecordedMasksTest : public ::testing::Test {
 protected:
  RecordedMasksTest()
      : dir_(fs::temp_directory_path() / ("ygslam masks ü " + std::to_string(getpid()))) {
    fs::create_directories(dir_);
  }
  ~RecordedMasksTest() override { fs::remove_all(dir_); }

  void write(const GreyImage& ids, const std::string& name) {
    cv::imwrite((dir_ / name).string(), cv_view(ids));
  }
  void write_text(const std::string& text, const std::string& name) {
    std::ofstream(dir_ / name) << text;
  }
  static GreyImage two_people() {
    GreyImage ids(64, 48);
    for (int v = 10; v < 20; ++v) {
      for (int u = 5; u < 15; ++u) ids.at(u, v) = 3;
      for (int u = 40; u < 60; ++u) ids.at(u, v) = 200;
    }
    return ids;
  }
  static RgbdFrame frame_at(std::int64_t ns) {
    return {FrameId{4}, Timestamp{ns}, ColourImage(64, 48), {}, {}};
  }
  std::unique_ptr<Segmenter> make() {
    auto made = make_recorded_segmenter(dir_);
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().message);
    return made.ok() ? std::move(made).value() : nullptr;
  }

  fs::path dir_;
};

TEST_F(RecordedMasksTest, WithoutClassesAllArePersonsWithTheirBoxes) {
  write(two_people(), "1000.033333.png");
  const auto out = make()->segment(frame_at(1000033333000));
  ASSERT_TRUE(out.ok()) << out.error().message;
  EXPECT_EQ(out->frame, FrameId{4});
  ASSERT_EQ(out->instances.size(), 2U);
  const Instance& second = out->instances[1];
  EXPECT_EQ(second.class_id, 0);
  EXPECT_EQ(second.x0, 40);
  EXPECT_EQ(second.x1, 60);
  EXPECT_EQ(second.y0, 10);
  EXPECT_EQ(second.y1, 20);
  EXPECT_EQ(out->ids.at(5, 10), 1);
  EXPECT_EQ(out->ids.at(59, 19), 2);
  EXPECT_EQ(out->ids.at(0, 0), 0);
  EXPECT_EQ(std::count(out->ids.begin(), out->ids.end(), 0), 64 * 48 - 300);
}

TEST_F(RecordedMasksTest, StampsMatchWithinAMicrosecondOnly) {
  write(two_people(), "1000.033333.png");
  const auto masks = make();
  EXPECT_TRUE(masks->segment(frame_at(1000033333000)).ok());
  EXPECT_TRUE(masks->segment(frame_at(1000033333333)).ok());
  EXPECT_TRUE(masks->segment(frame_at(1000033332000)).ok());
  EXPECT_FALSE(masks->segment(frame_at(1000033335000)).ok());
  EXPECT_FALSE(masks->segment(frame_at(1000066667000)).ok());
}

TEST_F(RecordedMasksTest, AnyNumberOfDecimalsIsRead) {
  for (const char* name : {"12.png", "13.5.png", "1311868164.363181.png", "14.0000000004.png"}) {
    write(two_people(), name);
  }
  const auto masks = make();
  EXPECT_TRUE(masks->segment(frame_at(12'000'000'000)).ok());
  EXPECT_TRUE(masks->segment(frame_at(13'500'000'000)).ok());
  EXPECT_TRUE(masks->segment(frame_at(1311868164363181000)).ok());
  EXPECT_TRUE(masks->segment(frame_at(14'000'000'000)).ok());
}

TEST_F(RecordedMasksTest, ClassesComeByNameOrNumberAndUnknownOnesAreLeftOut) {
  GreyImage ids(64, 48);
  for (int u = 1; u <= 4; ++u) ids.at(u, 0) = static_cast<std::uint8_t>(u);
  write(ids, "1.png");
  write_text(R"({"1": "dog", "2": 56, "3": "wardrobe"})", "instances.json");
  const auto out = make()->segment(frame_at(1'000'000'000));
  ASSERT_TRUE(out.ok());
  ASSERT_EQ(out->instances.size(), 3U);
  EXPECT_EQ(out->instances[0].class_id, 16);
  EXPECT_EQ(out->instances[1].class_id, 56);
  EXPECT_EQ(out->instances[2].class_id, 0);
  EXPECT_EQ(out->ids.at(3, 0), 0);
  EXPECT_EQ(out->ids.at(4, 0), 3);
}

TEST_F(RecordedMasksTest, ClassesOfARenderedSequenceStandBesideItsMaskFolder) {
  fs::create_directories(dir_ / "mask");
  write(two_people(), "mask/1.png");
  write_text(R"({"3": "dog", "200": "box"})", "instances.json");
  for (const fs::path& folder : {dir_ / "mask", dir_ / "mask" / ""}) {
    auto made = make_recorded_segmenter(folder);
    ASSERT_TRUE(made.ok());
    const auto out = made.value()->segment(frame_at(1'000'000'000));
    ASSERT_TRUE(out.ok());
    ASSERT_EQ(out->instances.size(), 1U);
    EXPECT_EQ(out->instances[0].class_id, 16);
  }
}

TEST_F(RecordedMasksTest, BadMaskIsAnErrorForItsFrameOnly) {
  write(two_people(), "1.png");
  write(two_people(), "2.png");
  fs::resize_file(dir_ / "2.png", fs::file_size(dir_ / "2.png") / 2);
  write_text("not a picture", "3.png");
  write(GreyImage(32, 48), "4.png");
  write_text("", "5.png");
  const auto masks = make();
  for (int s = 2; s <= 5; ++s) {
    const auto out = masks->segment(frame_at(s * 1'000'000'000LL));
    ASSERT_FALSE(out.ok()) << s;
    EXPECT_THAT(out.error().message, HasSubstr((dir_ / (std::to_string(s) + ".png")).string()));
  }
  EXPECT_TRUE(masks->segment(frame_at(1'000'000'000)).ok());
}

TEST_F(RecordedMasksTest, FolderWithoutMasksIsAnInputError) {
  for (const fs::path& folder : {dir_, dir_ / "nowhere"}) {
    const auto made = make_recorded_segmenter(folder);
    ASSERT_FALSE(made.ok());
    EXPECT_EQ(made.error().kind, ErrorKind::kInput);
    EXPECT_THAT(made.error().message, HasSubstr(folder.string()));
  }
}

TEST_F(RecordedMasksTest, BadInstancesFileIsAnInputError) {
  write(two_people(), "1.png");
  const std::string deep(100000, '[');
  for (const std::string& text :
       {std::string("{"), std::string("[1]"), std::string(R"({"0": "dog"})"),
        std::string(R"({"256": "dog"})"), std::string(R"({"x": "dog"})"),
        std::string(R"({"1": null})"), std::string(R"({"1": 1.5})"), deep, std::string()}) {
    write_text(text, "instances.json");
    const auto made = make_recorded_segmenter(dir_);
    ASSERT_FALSE(made.ok()) << text.substr(0, 20);
    EXPECT_EQ(made.error().kind, ErrorKind::kInput);
    EXPECT_THAT(made.error().message, HasSubstr("instances.json"));
  }
}

TEST_F(RecordedMasksTest, ColourAndSixteenBitPicturesAreNoMasks) {
  cv::imwrite((dir_ / "1.png").string(), cv::Mat(48, 64, CV_8UC3));
  cv::imwrite((dir_ / "2.png").string(), cv::Mat(48, 64, CV_16UC1));
  EXPECT_FALSE(read_png_ids(dir_ / "1.png").ok());
  EXPECT_FALSE(read_png_ids(dir_ / "2.png").ok());
}

TEST_F(RecordedMasksTest, PaletteImagesGiveTheirIndices) {
  const std::vector<std::uint8_t> indices{0, 1, 2, 3, 3, 2, 1, 0};
  const std::vector<std::uint8_t> palette{9, 9, 9, 200, 0, 0, 0, 200, 0, 0, 0, 200};
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = 4;
  image.height = 2;
  image.format = PNG_FORMAT_RGB_COLORMAP;
  image.colormap_entries = 4;
  const std::string file = (dir_ / "p.png").string();
  ASSERT_NE(png_image_write_to_file(&image, file.c_str(), 0, indices.data(), 4, palette.data()), 0);
  const auto ids = read_png_ids(file);
  ASSERT_TRUE(ids.ok()) << ids.error().message;
  EXPECT_THAT(std::vector<std::uint8_t>(ids->begin(), ids->end()), ElementsAreArray(indices));
}

TEST_F(RecordedMasksTest, AnAnnouncedTextTakesNoMemory) {
  using std::string_view_literals::operator""sv;
  constexpr auto kBytes =  // 7 x 4 pixels, then a text of 704 MB that is not there
      "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x07\0\0\0\x04\x08\x02\0\0\0\xcd\xa4\xb2**\0\0\0iTXt"sv;
  const fs::path file = dir_ / "text.png";
  std::ofstream(file, std::ios::binary) << kBytes;
  const auto peak_kb = [] {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
  };
  const auto before_kb = peak_kb();
  EXPECT_FALSE(read_png_ids(file.string()).ok());
  EXPECT_LT(peak_kb(), before_kb + 100'000);
}

TEST_F(RecordedMasksTest, DamagedBytesNeverBreakTheReader) {
  write(two_people(), "1.png");
  std::ifstream in(dir_ / "1.png", std::ios::binary);
  const std::string good((std::istreambuf_iterator<char>(in)), {});
  Rng rng(3);
  for (int i = 0; i < 300; ++i) {
    std::string bad = good;
    bad[rng.below(static_cast<std::uint32_t>(bad.size()))] = static_cast<char>(rng.next());
    bad.resize(1 + rng.below(static_cast<std::uint32_t>(bad.size())));
    write_text(bad, "2.png");
    const auto ids = read_png_ids(dir_ / "2.png");
    EXPECT_TRUE(ids.ok() || ids.error().kind == ErrorKind::kInput);
  }
}

}  // namespace
}  // namespace ygslam
