// Exports of other makers than YOLOv8's, from the file to the masks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <openvino/core/model.hpp>

#include "segment/letterbox.hpp"
#include "segment/model_segmenter.hpp"
#include "segment/test_network.hpp"
#include "segment/toy_networks.hpp"

namespace ygslam {
namespace {

namespace toys = ygslam::testing;

using toys::ToyDetection;
using toys::ToyNetwork;

struct Size {
  int width = 0, height = 0;
};
struct PixelBox {
  int u0 = 0, v0 = 0, u1 = 0, v1 = 0;  // [u0, u1) x [v0, v1)
};

/// A kind of network, with how it wants its image, and its own numbers of COCO's person and dog.
struct Maker {
  const char* name;
  Placement placement;
  std::shared_ptr<ov::Model> (*make)(const ToyNetwork&);
  int person, dog;
  Size net, other_net;
};

constexpr int kDog = 16;

class OtherNetworks : public ::testing::TestWithParam<Maker> {
 protected:
  OtherNetworks()
      : dir_(std::filesystem::temp_directory_path() /
             ("ygslam_other_" + std::to_string(getpid()) + GetParam().name)) {
    std::filesystem::create_directories(dir_);
  }
  ~OtherNetworks() override { std::filesystem::remove_all(dir_); }

  std::unique_ptr<Segmenter> open(const ToyNetwork& toy, std::vector<int> classes = {}) {
    ModelConfig config;
    config.model = dir_ / "toy.xml";
    config.try_in_child = true;
    config.decode.classes = std::move(classes);
    toys::write_network(GetParam().make(toy), config.model);
    auto made = make_model_segmenter(config);
    if (made.ok()) return std::move(made).value();
    ADD_FAILURE() << made.error().message;
    return nullptr;
  }

  /// `box`, grown by a margin, as the network would report it.
  static ToyDetection detection(const PixelBox& box, int label, float score, Size image, Size net) {
    const Letterbox placed =
        make_letterbox(image.width, image.height, net.width, net.height, GetParam().placement);
    const EdgePoint low = placed.to_network({box.u0 - kMargin, box.v0 - kMargin});
    const EdgePoint high = placed.to_network({box.u1 + kMargin, box.v1 + kMargin});
    return {float(low.x), float(low.y), float(high.x), float(high.y), label, score};
  }

  static RgbdFrame frame(Size size, const std::vector<PixelBox>& objects) {
    RgbdFrame out{FrameId{3},
                  Timestamp{42},
                  ColourImage(size.width, size.height, toys::kToyBackground),
                  {},
                  {}};
    for (const PixelBox& o : objects) {
      for (int v = o.v0; v < o.v1; ++v) {
        for (int u = o.u0; u < o.u1; ++u) out.colour.at(u, v) = toys::kToyColour;
      }
    }
    return out;
  }

  /// Every pixel farther than `slack_px` from an edge has its object's id.
  static void expect_ids(const Segmentation& s, const std::vector<PixelBox>& objects,
                         int slack_px) {
    for (int v = 0; v < s.ids.height(); ++v) {
      for (int u = 0; u < s.ids.width(); ++u) {
        int id = 0;
        bool is_near_edge = false;
        for (std::size_t k = 0; k < objects.size(); ++k) {
          const PixelBox& o = objects[k];
          const int inset = std::min({u - o.u0, o.u1 - 1 - u, v - o.v0, o.v1 - 1 - v});
          is_near_edge = is_near_edge || (inset >= -slack_px && inset < slack_px);
          if (inset >= 0) id = static_cast<int>(k) + 1;
        }
        if (is_near_edge) continue;
        ASSERT_EQ(s.ids.at(u, v), id) << u << " " << v;
      }
    }
  }

  static constexpr double kMargin = 4;
  std::filesystem::path dir_;
};

TEST_P(OtherNetworks, BoxesClassesAndMasksLieWhereTheNetworkSawThemWhateverTheSizes) {
  const Maker& maker = GetParam();
  for (const Size net : {maker.net, maker.other_net}) {
    for (const Size image : {net, Size{640, 480}, Size{1280, 720}, Size{108, 192}}) {
      SCOPED_TRACE(std::to_string(net.width) + "x" + std::to_string(net.height) + " sees " +
                   std::to_string(image.width) + "x" + std::to_string(image.height));
      const int w = image.width / 12, h = image.height / 12;
      const std::vector<PixelBox> objects{{w, h, 5 * w, 9 * h}, {7 * w, 4 * h, 11 * w, 11 * h}};
      const ToyNetwork toy{net.width,
                           net.height,
                           {detection(objects[0], maker.person, 0.9F, image, net),
                            detection(objects[1], maker.dog, 0.8F, image, net)}};
      const auto segmenter = open(toy);
      ASSERT_TRUE(segmenter);
      const auto out = segmenter->segment(frame(image, objects));
      ASSERT_TRUE(out.ok()) << out.error().message;
      EXPECT_EQ(out->frame, FrameId{3});
      ASSERT_EQ(out->instances.size(), 2U);
      EXPECT_EQ(out->instances[0].class_id, 0);
      EXPECT_EQ(out->instances[1].class_id, kDog);
      EXPECT_NEAR(out->instances[0].score, 0.9, 0.01);
      EXPECT_NEAR(out->instances[1].score, 0.8, 0.01);
      for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_NEAR(out->instances[k].x0, objects[k].u0 - kMargin, 0.05);
        EXPECT_NEAR(out->instances[k].y0, objects[k].v0 - kMargin, 0.05);
        EXPECT_NEAR(out->instances[k].x1, objects[k].u1 + kMargin, 0.05);
        EXPECT_NEAR(out->instances[k].y1, objects[k].v1 + kMargin, 0.05);
      }
      const double px = static_cast<double>(image.width) / net.width;
      expect_ids(*out, objects, static_cast<int>(std::ceil(3 * std::max(px, 1.0))));
    }
  }
}

TEST_P(OtherNetworks, OnlyWantedClassesCountAndWeakDetectionsDoNot) {
  const Maker& maker = GetParam();
  const Size image{640, 480};
  const std::vector<PixelBox> objects{{40, 40, 240, 200}, {340, 40, 540, 200}, {40, 260, 240, 440}};
  const ToyNetwork toy{maker.net.width,
                       maker.net.height,
                       {detection(objects[0], maker.dog, 0.9F, image, maker.net),
                        detection(objects[1], maker.person, 0.8F, image, maker.net),
                        detection(objects[2], maker.person, 0.2F, image, maker.net)}};
  const auto segmenter = open(toy, {0});
  ASSERT_TRUE(segmenter);
  const auto out = segmenter->segment(frame(image, objects));
  ASSERT_TRUE(out.ok()) << out.error().message;
  ASSERT_EQ(out->instances.size(), 1U);
  EXPECT_EQ(out->instances[0].class_id, 0);
  expect_ids(*out, {objects[1]}, 6);
}

TEST_P(OtherNetworks, NothingSeenIsNoError) {
  const Maker& maker = GetParam();
  const Size image{640, 480};
  const ToyNetwork toy{maker.net.width,
                       maker.net.height,
                       {detection({40, 40, 240, 200}, maker.person, 0.01F, image, maker.net)}};
  const auto segmenter = open(toy);
  ASSERT_TRUE(segmenter);
  const auto out = segmenter->segment(frame(image, {}));
  ASSERT_TRUE(out.ok()) << out.error().message;
  EXPECT_TRUE(out->instances.empty());
  expect_ids(*out, {}, 0);
}

TEST_P(OtherNetworks, NamedOutputsMayComeInAnyOrderAndUnnamedOnesInTheExporters) {
  const Maker& maker = GetParam();
  const Size image{640, 480};
  const std::vector<PixelBox> objects{{100, 60, 500, 420}};
  ToyNetwork toy{maker.net.width,
                 maker.net.height,
                 {detection(objects[0], maker.person, 0.9F, image, maker.net)}};
  for (const bool is_named : {true, false}) {
    toy.is_named = is_named;
    toy.masks_first = is_named;
    const auto segmenter = open(toy);
    ASSERT_TRUE(segmenter);
    const auto out = segmenter->segment(frame(image, objects));
    ASSERT_TRUE(out.ok()) << out.error().message;
    ASSERT_EQ(out->instances.size(), 1U);
    expect_ids(*out, objects, 6);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Networks, OtherNetworks,
    ::testing::Values(
        Maker{"yolo_end",
              Placement::kCentred,
              toys::make_yolo_end_toy,
              0,
              kDog,
              {320, 256},
              {192, 288}},
        Maker{
            "rtmdet", Placement::kTopLeft, toys::make_rtmdet_toy, 0, kDog, {320, 320}, {256, 192}},
        Maker{
            "rfdetr", Placement::kStretched, toys::make_rfdetr_toy, 1, 18, {312, 312}, {264, 360}}),
    [](const auto& maker) { return std::string(maker.param.name); });

TEST(OtherNetworks, RfdetrRunsInFullPrecisionUnlessTold) {
  const auto file = std::filesystem::temp_directory_path() /
                    ("ygslam_rfdetr_" + std::to_string(getpid()) + ".xml");
  toys::write_network(toys::make_rfdetr_toy({64, 64, {}, 10}), file);
  ModelConfig config;
  config.model = file;
  const auto made = make_model_segmenter(config);
  ASSERT_TRUE(made.ok()) << made.error().message;
  EXPECT_EQ(made.value()->precision(), "f32");
  std::filesystem::remove(file);
  std::filesystem::remove(std::filesystem::path(file).replace_extension("bin"));
}

TEST(OtherNetworks, ClassesAreThoseThatTheOnnxFileNames) {
  const auto file = std::filesystem::temp_directory_path() /
                    ("ygslam_names_" + std::to_string(getpid()) + ".onnx");
  ModelConfig config;
  config.model = file;
  const auto open_with = [&](const std::string& names) {
    std::ofstream(file, std::ios::binary) << toys::yolo_onnx(names);
    return make_model_segmenter(config);
  };
  const auto made = open_with("{0: 'forklift', 1: 'dog', 2: 'person'}");
  ASSERT_TRUE(made.ok()) << made.error().message;
  const auto out = made.value()->segment({{}, {}, ColourImage(32, 32), {}, {}});
  ASSERT_TRUE(out.ok()) << out.error().message;
  ASSERT_EQ(out->instances.size(), 1U);
  EXPECT_EQ(out->instances[0].class_id, kDog);
  EXPECT_EQ(out->ids.at(16, 16), 1);
  for (const auto& [names, what] :
       {std::pair{"", "YOLO-seg with 3 classes without names"},
        {"{0: 'bolt', 1: 'nut', 2: 'screw'}", "none of its 3 classes is one of COCO's"}}) {
    const auto refused = open_with(names);
    ASSERT_FALSE(refused.ok()) << names;
    EXPECT_EQ(refused.error().kind, ErrorKind::kModel);
    EXPECT_THAT(refused.error().message, ::testing::HasSubstr(file.string() + ": "));
    EXPECT_THAT(refused.error().message, ::testing::HasSubstr(what));
  }
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace ygslam
