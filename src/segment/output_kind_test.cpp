#include "segment/output_kind.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scene/coco.hpp"
#include "segment/output_decode.hpp"

namespace ygslam {
namespace {

using Shapes = std::vector<OutputShape>;

const Shapes kYoloShapes{{"output0", {1, 116, 6300}}, {"output1", {1, 32, 120, 160}}};
const Shapes kYoloEndShapes{{"output0", {1, 300, 38}}, {"output1", {1, 32, 120, 160}}};
const Shapes kRtmdetShapes{
    {"dets", {1, kOpen, 5}}, {"labels", {1, kOpen}}, {"masks", {1, kOpen, 480, 640}}};
const Shapes kRfdetrShapes{
    {"dets", {1, 200, 4}}, {"labels", {1, 200, 91}}, {"masks", {1, 200, 108, 108}}};

TEST(RecogniseOutputs, TellsTheKindsApartByShapesAndNames) {
  const auto kind_of = [](const Shapes& shapes) {
    const auto layout = recognise_outputs(shapes, 640, 480, {});
    EXPECT_TRUE(layout.ok()) << layout.error().message;
    return *layout;
  };
  EXPECT_EQ(kind_of(kYoloShapes).kind, OutputKind::kYolo);
  EXPECT_EQ(kind_of({kYoloShapes[1], kYoloShapes[0]}).order[0], 1);
  EXPECT_EQ(kind_of(kYoloEndShapes).kind, OutputKind::kYoloEnd);
  EXPECT_EQ(kind_of({kYoloEndShapes[1], kYoloEndShapes[0]}).order[0], 1);
  EXPECT_EQ(kind_of(kRtmdetShapes).kind, OutputKind::kRtmdet);
  EXPECT_EQ(kind_of(kRfdetrShapes).kind, OutputKind::kRfdetr);
  const OutputLayout turned = kind_of({kRfdetrShapes[2], kRfdetrShapes[0], kRfdetrShapes[1]});
  EXPECT_EQ(turned.kind, OutputKind::kRfdetr);
  EXPECT_THAT(turned.order, ::testing::ElementsAre(1, 2, 0));
  Shapes three_classes = kRfdetrShapes;  // as many logits as numbers of a box
  three_classes[1].lengths[2] = 4;
  const ClassNames names{{0, "person"}, {1, "dog"}, {2, "forklift"}};
  const auto layout =
      recognise_outputs({three_classes[1], three_classes[0], three_classes[2]}, 640, 480, names);
  ASSERT_TRUE(layout.ok()) << layout.error().message;
  EXPECT_THAT(layout->order, ::testing::ElementsAre(1, 0, 2));
  EXPECT_THAT(layout->classes, ::testing::ElementsAre(0, 16, kNoCocoClass, kNoCocoClass));
}

TEST(RecogniseOutputs, WhatIsNoneOfThemIsAnErrorThatSaysWhatWasFoundAndWhatIsRead) {
  Shapes other_size = kYoloShapes, no_masks = kRfdetrShapes, few_masks = kRfdetrShapes,
         open_queries = kRfdetrShapes, small_masks = kRtmdetShapes, few_prototypes = kYoloEndShapes;
  other_size[0].lengths[2] = 8400;
  no_masks.pop_back();
  few_masks[2].lengths[1] = 100;
  open_queries[0].lengths[1] = kOpen;
  small_masks[2].lengths = {1, kOpen, 28, 28};
  few_prototypes[1].lengths[1] = 16;
  for (const Shapes& shapes :
       {Shapes{}, Shapes{{"output0", {1, 84, 6300}}}, Shapes{{"a", {}}, {"b", {}}},
        Shapes(9, {"x", {1, 2}}), Shapes(3, {"", {}}), other_size, no_masks, few_masks,
        open_queries, small_masks, few_prototypes}) {
    const auto layout = recognise_outputs(shapes, 640, 480, {});
    ASSERT_FALSE(layout.ok());
    const std::string& message = layout.error().message;
    EXPECT_EQ(layout.error().kind, ErrorKind::kModel);
    EXPECT_EQ(message.find('\n'), std::string::npos);
    for (const char* kind : {"YOLO-seg [1,36+classes,6300]", "[1,rows,38]", "RTMDet-Ins",
                             "[1,rows,480,640]", "RF-DETR-Seg"})
      EXPECT_THAT(message, ::testing::HasSubstr(kind));
    EXPECT_LT(message.size(), 500U);
    const std::string first = shapes.empty() ? "none" : shapes[0].name;
    EXPECT_THAT(message, ::testing::HasSubstr("outputs " + first));
  }
  const Shapes hostile{{"\x1b[2J" + std::string(5000, 'x'), {1, 1}}};
  const std::string shown = recognise_outputs(hostile, 640, 480, {}).error().message;
  EXPECT_EQ(shown.find('\x1b'), std::string::npos);
  EXPECT_LT(shown.size(), 600U);
}

TEST(RecogniseOutputs, ClassesThatNobodyNamesMustBeCocos) {
  Shapes shapes = kYoloShapes;
  shapes[0].lengths[1] = 36 + 3;
  EXPECT_THAT(recognise_outputs(shapes, 640, 480, {}).error().message,
              ::testing::HasSubstr("YOLO-seg with 3 classes without names"));
  EXPECT_THAT(recognise_outputs(shapes, 640, 480, {{0, "bolt"}, {1, "nut"}}).error().message,
              ::testing::HasSubstr("none of its 3 classes"));
  const auto layout = recognise_outputs(shapes, 640, 480, {{2, "Dog"}, {7, "person"}});
  ASSERT_TRUE(layout.ok()) << layout.error().message;
  EXPECT_THAT(layout->classes, ::testing::ElementsAre(kNoCocoClass, kNoCocoClass, 16));
}

TEST(RecogniseOutputs, NamesThatAreOnlyNumbersSayNothing) {
  ClassNames numbers;
  for (int i = 0; i < 80; ++i) numbers.emplace(i, std::to_string(i));
  const auto layout = recognise_outputs(kYoloShapes, 640, 480, numbers);
  ASSERT_TRUE(layout.ok()) << layout.error().message;
  EXPECT_EQ(layout->classes, coco_table());
}

TEST(ClassTable, CocosOwnNumbersLeaveElevenOut) {
  const ClassTable table = coco_annotation_table();
  ASSERT_EQ(table.size(), 91U);
  EXPECT_EQ(std::count(table.begin(), table.end(), kNoCocoClass), 11);
  const auto name = [&](int number) { return coco_class_name(table[number]); };
  EXPECT_EQ(name(1), "person");
  EXPECT_EQ(name(13), "stop sign");
  EXPECT_EQ(name(18), "dog");
  EXPECT_EQ(name(27), "backpack");
  EXPECT_EQ(name(62), "chair");
  EXPECT_EQ(name(67), "dining table");
  EXPECT_EQ(name(72), "tv");
  EXPECT_EQ(name(84), "book");
  EXPECT_EQ(name(90), "toothbrush");
}

TEST(ClassNames, AreReadAsTheExportersWriteThem) {
  EXPECT_EQ(parse_python_names("{0: 'person', 12: \"driver's seat\", 3:'a\\'b'}"),
            (ClassNames{{0, "person"}, {12, "driver's seat"}, {3, "a'b"}}));
  for (const char* bad : {"", "{", "{}", "[1]", "{'a': 0}", "{0}", "{0: ", "{0: 'a", "{-1: 'a'}",
                          "{99999999999: 'a'}", "{10000: 'a'}"})
    EXPECT_TRUE(parse_python_names(bad).empty()) << bad;
  EXPECT_EQ(parse_rfdetr_names(R"({"task": "segment", "class_id_to_name": {"1": "person"}})"),
            (ClassNames{{1, "person"}}));
  for (const char* bad : {"", "[]", "{}", "{\"class_id_to_name\": 1}", "{\"class_id_to_name\": {",
                          "{\"class_id_to_name\": {\"x\": \"a\", \"1\": 2, \"1x\": \"b\"}}"})
    EXPECT_TRUE(parse_rfdetr_names(bad).empty()) << bad;
}

/// Tensors of zeros.
class Zeros {
 public:
  explicit Zeros(const std::vector<std::vector<std::size_t>>& lengths) : values_(lengths.size()) {
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      std::size_t count = 1;
      for (const std::size_t length : lengths[i]) count *= length;
      values_[i].resize(count);
      tensors.push_back({values_[i], lengths[i]});
    }
  }
  std::vector<OutputTensor> tensors;

 private:
  std::vector<std::vector<float>> values_;
};

TEST(DecodeOutputs, TensorsOfOtherLengthsThanTheFileSaidAreAnError) {
  const Letterbox box = make_letterbox(64, 64, 64, 64);
  const auto is_taken = [&](OutputKind kind, const std::vector<std::vector<std::size_t>>& lengths) {
    const Zeros zeros(lengths);
    return decode_outputs({kind, {0, 1, lengths.size() == 2 ? 0 : 2}, coco_table()}, zeros.tensors,
                          box, {})
        .ok();
  };
  EXPECT_TRUE(is_taken(OutputKind::kYolo, {{1, 116, 84}, {1, 32, 16, 16}}));
  EXPECT_FALSE(is_taken(OutputKind::kYolo, {{1, 117, 84}, {1, 32, 16, 16}}));
  EXPECT_FALSE(is_taken(OutputKind::kYolo, {{1, 116, 84}, {1, 32, 16, 17}}));
  EXPECT_FALSE(is_taken(OutputKind::kYolo, {{1, 116, 84}, {1, 32, 16, 16}, {1}}));
  EXPECT_TRUE(is_taken(OutputKind::kYoloEnd, {{1, 0, 38}, {1, 32, 16, 16}}));
  EXPECT_FALSE(is_taken(OutputKind::kYoloEnd, {{2, 7, 38}, {1, 32, 16, 16}}));
  EXPECT_TRUE(is_taken(OutputKind::kRtmdet, {{1, 3, 5}, {1, 3}, {1, 2, 64, 64}}));
  EXPECT_TRUE(is_taken(OutputKind::kRtmdet, {{1, 1, 5}, {1, 1}, {1, 0, 64, 64}}));
  EXPECT_FALSE(is_taken(OutputKind::kRtmdet, {{1, 3, 5}, {1, 3}, {1, 4, 64, 64}}));
  EXPECT_FALSE(is_taken(OutputKind::kRtmdet, {{1, 0, 5}, {1, 3}, {1, 0, 64, 64}}));
  EXPECT_FALSE(is_taken(OutputKind::kRtmdet, {{1, 3, 5}, {1, 2}, {1, 2, 64, 64}}));
  EXPECT_FALSE(is_taken(OutputKind::kRtmdet, {{1, 3, 5}, {1, 3}, {1, 3, 32, 64}}));
  EXPECT_TRUE(is_taken(OutputKind::kRfdetr, {{1, 5, 4}, {1, 5, 80}, {1, 5, 16, 16}}));
  EXPECT_FALSE(is_taken(OutputKind::kRfdetr, {{1, 5, 4}, {1, 5, 91}, {1, 5, 16, 16}}));
  EXPECT_FALSE(is_taken(OutputKind::kRfdetr, {{1, 5, 4}, {1, 4, 80}, {1, 5, 16, 16}}));
  EXPECT_FALSE(is_taken(OutputKind::kRfdetr, {{1, 0, 4}, {1, 0, 80}, {1, 0, 16, 16}}));
}

TEST(DecodeOutputs, RowsThatMakeNoSenseAreCountedAndTheRestKept) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const Letterbox box = make_letterbox(64, 64, 64, 64, Placement::kTopLeft);
  const std::vector<float> boxes{
      0,  0,    64,   64, 0.9F,  // kept
      0,  0,    kNan, 64, 0.9F, 0,  0,    64, 64, kNan, 0,  0,    64, 64, 7, 0, 0, 64,
      64, 0.9F, 0,    0,  64,   64, 0.9F, 9,  9,  5,    64, 0.9F, 0,  0,  0, 0, 0};  // padding,
                                                                                     // whose label
                                                                                     // says nothing
  const std::vector<float> labels{0, 0, 0, 0, 80, 0.5F, 0, -1};
  const std::vector<float> masks(std::size_t{7} * 64 * 64, 1.0F);
  const std::vector<OutputTensor> tensors{
      {boxes, {1, 8, 5}}, {labels, {1, 8}}, {masks, {1, 7, 64, 64}}};
  const auto out = decode_outputs({OutputKind::kRtmdet, {0, 1, 2}, coco_table()}, tensors, box, {});
  ASSERT_TRUE(out.ok());
  EXPECT_EQ(out->instances.size(), 1U);
  EXPECT_EQ(out->rejected, 6);
}

}  // namespace
}  // namespace ygslam
