#include "segment/people_network.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "segment/cpu_features.hpp"
#include "segment/embedded_network.hpp"
#include "segment/people_decode.hpp"
#include "segment/test_network.hpp"

namespace ygslam {
namespace {

using ::testing::HasSubstr;
using testing::people_onnx;

CameraConfig camera_of(int width, int height) {
  CameraConfig camera;
  camera.fx = camera.fy = std::max(width, height);
  camera.cx = width / 2.0, camera.cy = height / 2.0;
  camera.width = width, camera.height = height;
  return camera;
}

/// Without depth.
RgbdFrame empty_frame(int width, int height) {
  return {
      FrameId{7}, Timestamp{123456789}, ColourImage(width, height), {}, DepthImage(width, height)};
}

/// Measured, so that the test network sees somebody there.
void draw_person(RgbdFrame& frame, int u0, int v0, int u1, int v1, float depth_m) {
  for (int v = v0; v < v1; ++v)
    for (int u = u0; u < u1; ++u) frame.depth_m.at(u, v) = depth_m;
}

Segmentation segmented(const RgbdFrame& frame, PeopleConfig config = {Precision::kF32, 1}) {
  const auto made = make_people_segmenter(
      people_onnx(), camera_of(frame.colour.width(), frame.colour.height()), config);
  if (!made.ok()) throw std::runtime_error(made.error().message);
  auto masks = made.value()->segment(frame);
  if (!masks.ok()) throw std::runtime_error(masks.error().message);
  return std::move(masks).value();
}

/// Farther than slack_px from the rectangle's edge every pixel is right.
void expect_rectangle(const GreyImage& ids, int u0, int v0, int u1, int v1, int slack_px) {
  for (int v = 0; v < ids.height(); ++v) {
    for (int u = 0; u < ids.width(); ++u) {
      const int inset = std::min({u - u0, u1 - 1 - u, v - v0, v1 - 1 - v});
      if (inset >= -slack_px && inset < slack_px) continue;
      ASSERT_EQ(ids.at(u, v), inset >= 0 ? 1 : 0) << u << " " << v;
    }
  }
}

void expect_fault(const Result<std::unique_ptr<Segmenter>>& made, ErrorKind kind,
                  const std::string& what) {
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.error().kind, kind) << made.error().message;
  EXPECT_THAT(made.error().message, HasSubstr("the built-in people network"));
  EXPECT_THAT(made.error().message, HasSubstr(what));
  EXPECT_EQ(made.error().message.find('\n'), std::string::npos);
}

TEST(PeopleNetwork, MaskLiesWhereTheNetworkSawSomebodyAndCarriesTheFramesId) {
  RgbdFrame frame = empty_frame(640, 480);
  draw_person(frame, 160, 120, 400, 360, 2);
  const Segmentation out = segmented(frame);
  EXPECT_EQ(out.frame, FrameId{7});
  EXPECT_EQ(out.stamp.ns, 123456789);
  ASSERT_EQ(out.instances.size(), 1U);
  const Instance& person = out.instances[0];
  EXPECT_EQ(person.class_id, 0);
  EXPECT_NEAR(person.score, 1 / (1 + std::exp(-4.0)), 1e-3);
  expect_rectangle(out.ids, 160, 120, 400, 360, 2);
  EXPECT_NEAR(person.x0, 160, 2);
  EXPECT_NEAR(person.y0, 120, 2);
  EXPECT_NEAR(person.x1, 400, 2);
  EXPECT_NEAR(person.y1, 360, 2);
}

TEST(PeopleNetwork, ImagesOfAnySizeAreTaken) {
  for (const auto& [width, height] :
       {std::pair{1280, 720}, {100, 160}, {160, 120}, {641, 479}, {321, 240}}) {
    RgbdFrame frame = empty_frame(width, height);
    const int u0 = width / 4, v0 = height / 5, u1 = width / 2, v1 = height / 2;
    draw_person(frame, u0, v0, u1, v1, 2);
    const Segmentation out = segmented(frame);
    ASSERT_TRUE(out.ids.same_size(frame.colour));
    EXPECT_EQ(out.instances.size(), 1U);
    expect_rectangle(out.ids, u0, v0, u1, v1, 2 + width / 160);
  }
  for (const auto& [width, height] : {std::pair{1, 1}, {640, 3}, {2, 480}}) {
    RgbdFrame frame = empty_frame(width, height);
    draw_person(frame, 0, 0, width, height, 2);
    EXPECT_TRUE(segmented(frame).ids.same_size(frame.colour));
  }
}

TEST(PeopleNetwork, TwoWhoTouchInTheImageAreToldApartByDepth) {
  RgbdFrame frame = empty_frame(640, 480);
  draw_person(frame, 100, 100, 260, 400, 2);
  draw_person(frame, 260, 100, 360, 400, 2.1F);
  EXPECT_EQ(segmented(frame).instances.size(), 1U);
  draw_person(frame, 260, 100, 360, 400, 2.5F);
  const Segmentation two = segmented(frame);
  ASSERT_EQ(two.instances.size(), 2U);
  EXPECT_EQ(two.ids.at(180, 250), 1) << "the larger one first";
  EXPECT_EQ(two.ids.at(300, 250), 2);
  EXPECT_NEAR(two.instances[0].x1, 260, 4) << "to within a cell";
}

TEST(PeopleNetwork, WithoutDepthThereIsNoGap) {
  const std::vector<float> somebody_everywhere(kPeopleCells, 1.0F);
  DepthImage cells_m(kPeopleColumns, kPeopleRows, 2.0F);
  for (int row = 0; row < kPeopleRows; ++row) cells_m.at(80, row) = 0;
  const PeopleGrid grid = make_people_grid(640, 480);
  EXPECT_EQ(decode_people(somebody_everywhere, cells_m, grid, 130, 640, 480).instances.size(), 1U);
  for (int row = 0; row < kPeopleRows; ++row) cells_m.at(80, row) = 4;
  EXPECT_EQ(decode_people(somebody_everywhere, cells_m, grid, 130, 640, 480).instances.size(), 3U);
}

/// Of the image's pixels, where the network says somebody everywhere.
double share_of_people(const DepthImage& cells_m) {
  const std::vector<float> somebody_everywhere(kPeopleCells, 1.0F);
  const PeopleGrid grid = make_people_grid(640, 480);
  const DecodedPeople people = decode_people(somebody_everywhere, cells_m, grid, 130, 640, 480);
  const auto count = std::ranges::count_if(people.ids, [](std::uint8_t id) { return id > 0; });
  return static_cast<double>(count) / static_cast<double>(people.ids.size());
}

TEST(PeopleNetwork, WhereNothingIsMeasuredThereIsNobody) {
  DepthImage cells_m(kPeopleColumns, kPeopleRows);
  EXPECT_EQ(share_of_people(cells_m), 0);
  for (int i = 0; i < kPeopleCells; i += 30) cells_m.data()[i] = 2;  // sparse
  EXPECT_LT(share_of_people(cells_m), 0.05);
}

TEST(PeopleNetwork, AHoleWithStraightEdgesIsNobodyAndARoundOneMayBe) {
  const auto with_hole = [](const auto& is_in_hole) {
    DepthImage cells_m(kPeopleColumns, kPeopleRows, 2.0F);
    for (int row = 0; row < kPeopleRows; ++row)
      for (int column = 0; column < kPeopleColumns; ++column)
        if (is_in_hole(column, row)) cells_m.at(column, row) = 0;
    return 1 - share_of_people(cells_m);  // nobody
  };
  EXPECT_NEAR(with_hole([](int c, int) { return c >= 80; }), 0.5, 0.01) << "the right half";
  EXPECT_NEAR(with_hole([](int, int r) { return r < 30; }), 0.25, 0.01) << "the upper quarter";
  EXPECT_NEAR(with_hole([](int c, int r) { return c >= 80 && r >= 60; }), 0.25, 0.01) << "a corner";
  EXPECT_EQ(with_hole([](int c, int r) { return std::hypot(c - 70, r - 80) < 60; }), 0)
      << "right before the lens";
  const auto is_edge = [](int c, int r) { return c < 5 || c >= 155 || r < 3 || r >= 117; };
  EXPECT_EQ(with_hole(is_edge), 0) << "registered depth ends before the image does";
  EXPECT_EQ(
      with_hole([&](int c, int r) { return is_edge(c, r) || std::hypot(c - 40, r - 80) < 50; }), 0)
      << "right before the lens, beyond the end of the depth";
  EXPECT_GT(with_hole([&](int c, int r) { return is_edge(c, r) || c >= 80; }), 0.5)
      << "the right half, and the end of the depth";
}

TEST(PeopleNetwork, CrumbsGoToWhomTheyTouchAndElsewhereAreNobody) {
  RgbdFrame frame = empty_frame(640, 480);
  draw_person(frame, 100, 100, 260, 400, 2);
  draw_person(frame, 160, 200, 172, 212, 1);  // 3 x 3 cells before the chest
  draw_person(frame, 500, 200, 512, 212, 2);
  const Segmentation out = segmented(frame);
  ASSERT_EQ(out.instances.size(), 1U);
  EXPECT_EQ(out.ids.at(166, 206), 1);
  EXPECT_EQ(out.ids.at(506, 206), 0);
}

/// How many bodies the network's answer shows where these boxes of cells are measured.
struct CellBox {
  int column0, row0, column1, row1;
  float depth_m;
};
std::size_t bodies(std::initializer_list<CellBox> boxes) {
  std::vector<float> logits(kPeopleCells, -5.0F);
  DepthImage cells_m(kPeopleColumns, kPeopleRows, 4.0F);
  for (const CellBox& box : boxes)
    for (int row = box.row0; row < box.row1; ++row)
      for (int column = box.column0; column < box.column1; ++column) {
        logits[row * kPeopleColumns + column] = 5;
        cells_m.at(column, row) = box.depth_m;
      }
  return decode_people(logits, cells_m, make_people_grid(640, 480), 130, 640, 480).instances.size();
}

TEST(PeopleNetwork, OneBodyInSeveralPartsIsOne) {
  const CellBox chest{60, 20, 92, 60, 2};  // 49 x 62 cm
  EXPECT_EQ(bodies({chest, {62, 72, 90, 110, 2.1F}}), 1U) << "legs below a table";
  EXPECT_EQ(bodies({chest, {62, 60, 90, 100, 1.7F}}), 1U) << "the knees of who sits";
  EXPECT_EQ(bodies({chest, {80, 30, 90, 42, 1.8F}}), 1U) << "a hand before the chest";
}

TEST(PeopleNetwork, WhoStandsBesideOrBehindIsAnother) {
  const CellBox chest{60, 20, 92, 60, 2};
  EXPECT_EQ(bodies({chest, {100, 20, 132, 60, 2}}), 2U) << "side by side";
  EXPECT_EQ(bodies({chest, {92, 20, 120, 60, 2.4F}}), 2U) << "beside and behind, touching";
  EXPECT_EQ(bodies({chest, {70, 8, 86, 20, 3.0F}}), 2U) << "a head behind the shoulders";
  EXPECT_EQ(bodies({chest, {60, 100, 92, 119, 2}}), 2U) << "too far below";
}

TEST(PeopleNetwork, AHandAloneCountsForLessThanABody) {
  constexpr float kBeginsAnObject = 0.5F;
  RgbdFrame frame = empty_frame(640, 480);
  draw_person(frame, 100, 100, 220, 300, 2);  // 37 x 62 cm
  draw_person(frame, 400, 200, 436, 236, 2);  // 11 x 11 cm
  const Segmentation out = segmented(frame);
  ASSERT_EQ(out.instances.size(), 2U);
  EXPECT_GT(out.instances[0].score, 0.95F);
  EXPECT_LT(out.instances[1].score, kBeginsAnObject);
  EXPECT_GT(out.instances[1].score, 0.0F);
}

TEST(PeopleNetwork, BytesThatAreNoSuchNetworkAreAModelError) {
  const std::string whole = people_onnx();
  const CameraConfig camera = camera_of(640, 480);
  for (const std::string& bytes :
       {std::string(), std::string("no network"), std::string(100000, '\0'),
        whole.substr(0, whole.size() / 2), whole.substr(0, whole.size() - 1)})
    expect_fault(make_people_segmenter(bytes, camera, {}), ErrorKind::kModel, "");
  expect_fault(make_people_segmenter(people_onnx(4, 3), camera, {}), ErrorKind::kModel, "shape");
}

TEST(PeopleNetwork, PrecisionsAreThoseOfAnyNetwork) {
  const CameraConfig camera = camera_of(640, 480);
  expect_fault(make_people_segmenter(people_onnx(), camera, {Precision::kInt8, 1}),
               ErrorKind::kConfig, "int8");
  const auto exact = make_people_segmenter(people_onnx(), camera, {Precision::kF32, 1});
  ASSERT_TRUE(exact.ok()) << exact.error().message;
  EXPECT_EQ(exact.value()->precision(), "f32");
  const auto coarse = make_people_segmenter(people_onnx(), camera, {Precision::kBf16, 1});
  EXPECT_EQ(coarse.ok(), cpu_bf16() != Bf16::kNone);
}

TEST(PeopleNetwork, TheQuantisedWeightsBuiltInAreReadOrSaidToBeMissing) {
  const CameraConfig camera = camera_of(640, 480);
  const auto built_in = make_people_segmenter(camera, {Precision::kInt8, 1});
  const auto network = embedded_network("people_int8.xml");
  const auto weights = embedded_network("people_int8.bin");
  if (!network || !weights) {
    expect_fault(built_in, ErrorKind::kModel, "assets/people_int8.xml");
    return;
  }
  ASSERT_TRUE(built_in.ok()) << built_in.error().message;
  EXPECT_EQ(built_in.value()->precision(), "int8");
  EXPECT_TRUE(built_in.value()->in_step());
  EXPECT_TRUE(built_in.value()->segment(empty_frame(640, 480)).ok());
  const auto any = make_people_segmenter(*network, camera, {Precision::kAuto, 1}, *weights);
  ASSERT_TRUE(any.ok()) << any.error().message;
  EXPECT_EQ(any.value()->precision(), "int8");
  expect_fault(make_people_segmenter(*network, camera, {Precision::kF32, 1}, *weights),
               ErrorKind::kConfig, "is quantised");
  for (const std::string_view bytes : {weights->substr(0, weights->size() / 2), std::string_view()})
    expect_fault(make_people_segmenter(*network, camera, {Precision::kInt8, 1}, bytes),
                 ErrorKind::kModel, "cannot be read");
}

TEST(PeopleNetwork, WhatMakesNoSenseIsAnErrorOfTheFrame) {
  const CameraConfig camera = camera_of(640, 480);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto mad = make_people_segmenter(people_onnx(nan), camera, {Precision::kF32, 1});
  ASSERT_TRUE(mad.ok()) << mad.error().message;
  const auto none = mad.value()->segment(empty_frame(640, 480));
  ASSERT_FALSE(none.ok());
  EXPECT_THAT(none.error().message, HasSubstr("frame 7: the network's output makes no sense"));
  const auto sound = make_people_segmenter(people_onnx(), camera, {});
  EXPECT_FALSE(sound.value()->segment(empty_frame(320, 240)).ok()) << "of another camera";
  EXPECT_TRUE(sound.value()->segment(empty_frame(640, 480)).ok());
}

TEST(PeopleNetwork, TheWeightsBuiltInAreReadOrSaidToBeMissing) {
  const auto made = make_people_segmenter(camera_of(640, 480), {});
  if (embedded_network("people.onnx")) {
    ASSERT_TRUE(made.ok()) << made.error().message;
    EXPECT_TRUE(made.value()->in_step());
    EXPECT_TRUE(made.value()->segment(empty_frame(640, 480)).ok());
  } else {
    expect_fault(made, ErrorKind::kModel, "assets/people.onnx");
  }
}

}  // namespace
}  // namespace ygslam
