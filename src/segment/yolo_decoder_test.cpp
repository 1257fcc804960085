#include "segment/yolo_decoder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/rng.hpp"
#include "segment/output_decode.hpp"

namespace ygslam {
namespace {

constexpr int kYoloChannels = kYoloOtherChannels + kCocoClasses;

/// Raw outputs of an input of width x height, all zero until something is put in.
class FakeOutputs {
 public:
  FakeOutputs(int net_width, int net_height)
      : width(net_width),
        height(net_height),
        cells(yolo_cells(width, height)),
        proto_width(width / 4),
        proto_height(height / 4),
        detections(static_cast<std::size_t>(kYoloChannels) * cells, 0.0F),
        prototypes(static_cast<std::size_t>(kPrototypes) * proto_width * proto_height, 0.0F) {}

  float& detection(int channel, int cell) {
    return detections[static_cast<std::size_t>(channel) * cells + cell];
  }
  float& prototype(int k, int x, int y) {
    return prototypes[(static_cast<std::size_t>(k) * proto_height + y) * proto_width + x];
  }
  /// Centre and size in network pixels; its mask is prototype `k`.
  void add(int cell, int class_id, float score, float cx, float cy, float w, float h, int k) {
    detection(0, cell) = cx;
    detection(1, cell) = cy;
    detection(2, cell) = w;
    detection(3, cell) = h;
    detection(kYoloBoxValues + class_id, cell) = score;
    detection(kYoloBoxValues + kCocoClasses + k, cell) = 1.0F;
  }
  void fill_prototype(int k, float value) {
    for (int y = 0; y < proto_height; ++y) {
      for (int x = 0; x < proto_width; ++x) prototype(k, x, y) = value;
    }
  }

  int width, height, cells, proto_width, proto_height;
  std::vector<float> detections, prototypes;
};

Decoded decode(const FakeOutputs& raw, int width, int height, const DecodeConfig& config = {}) {
  const auto size = [](int length) { return static_cast<std::size_t>(length); };
  const std::vector<OutputTensor> tensors{
      {raw.detections, {1, kYoloChannels, size(raw.cells)}},
      {raw.prototypes, {1, kPrototypes, size(raw.proto_height), size(raw.proto_width)}}};
  return *decode_outputs({OutputKind::kYolo, {0, 1, 0}, coco_table()}, tensors,
                         make_letterbox(width, height, raw.width, raw.height), config);
}

TEST(YoloDecode, NothingDetectedGivesEmptyIds) {
  const Decoded out = decode(FakeOutputs(640, 480), 640, 480);
  EXPECT_TRUE(out.instances.empty());
  EXPECT_EQ(out.rejected, 0);
  EXPECT_EQ(out.ids.width(), 640);
  EXPECT_EQ(out.ids.height(), 480);
  EXPECT_TRUE(std::all_of(out.ids.begin(), out.ids.end(), [](auto id) { return id == 0; }));
}

TEST(YoloDecode, FullMaskFillsExactlyItsBox) {
  FakeOutputs raw(640, 480);
  raw.fill_prototype(3, 1.0F);
  raw.add(17, 0, 0.9F, 200, 150, 100, 60, 3);
  const Decoded out = decode(raw, 640, 480);
  ASSERT_EQ(out.instances.size(), 1U);
  EXPECT_EQ(out.instances[0].class_id, 0);
  EXPECT_FLOAT_EQ(out.instances[0].score, 0.9F);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const bool inside = u >= 150 && u < 250 && v >= 120 && v < 180;
      ASSERT_EQ(out.ids.at(u, v), inside ? 1 : 0) << u << " " << v;
    }
  }
}

TEST(YoloDecode, MaskEdgeLiesBetweenPrototypesWhereBilinearInterpolationPutsIt) {
  // Prototype 1 changes sign linearly in x: zero at cell centre x = 80 exactly, that is network
  // pixel coordinate 4 * 80.5 = 322; pixels from 322 on (centres 322.5...) are inside.
  FakeOutputs raw(640, 480);
  for (int y = 0; y < raw.proto_height; ++y) {
    for (int x = 0; x < raw.proto_width; ++x) {
      raw.prototype(1, x, y) = static_cast<float>(x - 80);
    }
  }
  raw.add(0, 0, 0.8F, 320, 240, 640, 480, 1);
  const Decoded out = decode(raw, 640, 480);
  ASSERT_EQ(out.instances.size(), 1U);
  for (int u = 0; u < 640; ++u) ASSERT_EQ(out.ids.at(u, 100), u >= 322 ? 1 : 0) << u;
}

TEST(YoloDecode, MaskIsTheLinearCombinationOfPrototypes) {
  Rng rng(5);
  FakeOutputs raw(320, 256);
  for (float& p : raw.prototypes) p = static_cast<float>(rng.normal());
  raw.add(9, 0, 0.8F, 160, 128, 320, 256, 0);
  for (int k = 0; k < kPrototypes; ++k) {
    raw.detection(kYoloBoxValues + kCocoClasses + k, 9) = static_cast<float>(rng.normal());
  }
  const Decoded out = decode(raw, 320, 256);
  ASSERT_EQ(out.instances.size(), 1U);
  // Reference: the definition, pixel by pixel in double.
  const auto linear = [&](int x, int y) {
    x = std::clamp(x, 0, raw.proto_width - 1);
    y = std::clamp(y, 0, raw.proto_height - 1);
    double sum = 0;
    for (int k = 0; k < kPrototypes; ++k) {
      sum += static_cast<double>(raw.detection(kYoloBoxValues + kCocoClasses + k, 9)) *
             raw.prototype(k, x, y);
    }
    return sum;
  };
  for (int i = 0; i < 3000; ++i) {
    const int u = static_cast<int>(rng.below(320));
    const int v = static_cast<int>(rng.below(256));
    const double px = (u + 0.5) / 4 - 0.5;
    const double py = (v + 0.5) / 4 - 0.5;
    const int x = static_cast<int>(std::floor(px));
    const int y = static_cast<int>(std::floor(py));
    const double fx = px - x;
    const double fy = py - y;
    const double value = (1 - fy) * ((1 - fx) * linear(x, y) + fx * linear(x + 1, y)) +
                         fy * ((1 - fx) * linear(x, y + 1) + fx * linear(x + 1, y + 1));
    if (std::abs(value) < 1e-4) continue;
    ASSERT_EQ(out.ids.at(u, v), value > 0 ? 1 : 0) << u << " " << v;
  }
}

TEST(YoloDecode, LetterboxIsUndoneForBoxesAndMasks) {
  // 1280x720 in 640x480: scale 1/2, 60 px above and below.
  FakeOutputs raw(640, 480);
  raw.fill_prototype(0, 1.0F);
  raw.add(4, 2, 0.7F, 300, 200, 80, 40, 0);
  const Decoded out = decode(raw, 1280, 720);
  ASSERT_EQ(out.instances.size(), 1U);
  const Instance& car = out.instances[0];
  EXPECT_EQ(car.class_id, 2);
  EXPECT_NEAR(car.x0, 520, 1e-3);
  EXPECT_NEAR(car.y0, 240, 1e-3);
  EXPECT_NEAR(car.x1, 680, 1e-3);
  EXPECT_NEAR(car.y1, 320, 1e-3);
  EXPECT_EQ(std::count(out.ids.begin(), out.ids.end(), 1), 160 * 80);
  EXPECT_EQ(out.ids.at(520, 240), 1);
  EXPECT_EQ(out.ids.at(679, 319), 1);
}

TEST(YoloDecode, BetterScoreLiesOnTop) {
  FakeOutputs raw(640, 480);
  raw.fill_prototype(0, 1.0F);
  raw.add(0, 0, 0.6F, 200, 200, 200, 200, 0);
  raw.add(1, 16, 0.9F, 250, 200, 200, 200, 0);
  const Decoded out = decode(raw, 640, 480);
  ASSERT_EQ(out.instances.size(), 2U);
  EXPECT_EQ(out.instances[0].class_id, 16);
  EXPECT_EQ(out.ids.at(280, 200), 1);
  EXPECT_EQ(out.ids.at(120, 200), 2);
}

TEST(YoloDecode, OnlyWantedClassesCount) {
  FakeOutputs raw(640, 480);
  raw.fill_prototype(0, 1.0F);
  raw.add(0, 0, 0.6F, 100, 100, 50, 50, 0);
  raw.add(1, 16, 0.9F, 400, 300, 50, 50, 0);
  raw.add(2, 56, 0.9F, 250, 300, 50, 50, 0);
  raw.detection(kYoloBoxValues + 0, 2) = 0.4F;  // a chair that might be a person
  DecodeConfig persons;
  persons.classes = {0};
  const Decoded out = decode(raw, 640, 480, persons);
  ASSERT_EQ(out.instances.size(), 2U);
  EXPECT_EQ(out.instances[0].class_id, 0);
  EXPECT_EQ(out.instances[1].class_id, 0);
  EXPECT_FLOAT_EQ(out.instances[1].score, 0.4F);
}

TEST(YoloDecode, OtherClassesTakeWhatTheWantedOnesLeaveAndChangeNothingOfThem) {
  FakeOutputs raw(640, 480);
  raw.fill_prototype(0, 1.0F);
  raw.add(1, 0, 0.5F, 200, 200, 100, 100, 0);   // a person ...
  raw.add(2, 77, 0.9F, 204, 200, 100, 100, 0);  // ... also taken for a teddy bear,
  raw.add(3, 56, 0.9F, 250, 200, 100, 100, 0);  // behind which a chair stands,
  raw.add(4, 62, 0.7F, 500, 400, 60, 60, 0);    // and a screen elsewhere
  DecodeConfig config{0.25, 0.7, 32, {0}};
  const Decoded wanted = decode(raw, 640, 480, config);
  config.others = true;
  const Decoded all = decode(raw, 640, 480, config);
  ASSERT_EQ(wanted.instances.size(), 1U);
  ASSERT_EQ(all.instances.size(), 3U);
  EXPECT_EQ(all.instances[0].class_id, 0);
  EXPECT_EQ(all.instances[1].class_id, 56);
  EXPECT_EQ(all.instances[2].class_id, 62);
  for (std::size_t i = 0; i < all.ids.size(); ++i) {
    const int id = all.ids.begin()[i];
    ASSERT_EQ(wanted.ids.begin()[i], id == 1 ? 1 : 0);
  }
  EXPECT_EQ(all.ids.at(220, 200), 1) << "the chair's box holds this pixel too";
  EXPECT_EQ(all.ids.at(280, 200), 2);
  EXPECT_EQ(all.ids.at(500, 400), 3);
}

TEST(YoloDecode, ScoresBelowTheThresholdAreNoDetections) {
  FakeOutputs raw(640, 480);
  raw.fill_prototype(0, 1.0F);
  raw.add(0, 0, 0.49F, 100, 100, 50, 50, 0);
  raw.add(1, 0, 0.5F, 300, 100, 50, 50, 0);
  DecodeConfig config;
  config.score_threshold = 0.5;
  EXPECT_EQ(decode(raw, 640, 480, config).instances.size(), 1U);
}

TEST(YoloDecode, GarbageIsRejectedAndTheRestKept) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInf = std::numeric_limits<float>::infinity();
  FakeOutputs raw(640, 480);
  raw.fill_prototype(0, 1.0F);
  raw.add(0, 0, kNan, 100, 100, 50, 50, 0);
  raw.add(1, 0, 17.0F, 100, 100, 50, 50, 0);
  raw.add(2, 0, 0.9F, kNan, 100, 50, 50, 0);
  raw.add(3, 0, 0.9F, 100, 100, kInf, 50, 0);
  raw.add(4, 0, 0.9F, 100, 100, -50, 50, 0);
  raw.add(5, 0, 0.9F, -500, 100, 50, 50, 0);
  raw.add(6, 0, 0.9F, 400, 400, 50, 50, 0);
  raw.detection(kYoloBoxValues + kCocoClasses + 7, 6) = kNan;
  raw.add(7, 0, 0.8F, 300, 300, 50, 50, 0);
  const Decoded out = decode(raw, 640, 480);
  ASSERT_EQ(out.instances.size(), 1U);
  EXPECT_FLOAT_EQ(out.instances[0].score, 0.8F);
  EXPECT_EQ(out.rejected, 7);
}

TEST(YoloDecode, NanPrototypesMaskNothing) {
  FakeOutputs raw(640, 480);
  raw.fill_prototype(0, std::numeric_limits<float>::quiet_NaN());
  raw.add(0, 0, 0.9F, 100, 100, 50, 50, 0);
  const Decoded out = decode(raw, 640, 480);
  EXPECT_TRUE(out.instances.empty());
  EXPECT_EQ(out.rejected, 1);
  EXPECT_TRUE(std::all_of(out.ids.begin(), out.ids.end(), [](auto id) { return id == 0; }));
}

TEST(YoloDecode, RandomBytesNeverBreakIt) {
  Rng rng(6);
  for (int round = 0; round < 20; ++round) {
    FakeOutputs raw(64 + 32 * static_cast<int>(rng.below(4)), 96);
    const auto scramble = [&](float& f) {
      const auto bits = static_cast<std::uint32_t>(rng.next());
      f = rng.below(2) == 0 ? std::bit_cast<float>(bits) : static_cast<float>(rng.uniform());
    };
    std::for_each(raw.detections.begin(), raw.detections.end(), scramble);
    std::for_each(raw.prototypes.begin(), raw.prototypes.end(), scramble);
    DecodeConfig config;
    config.max_instances = 255;
    const Decoded out = decode(raw, 101, 57, config);
    ASSERT_LE(out.instances.size(), 255U);
    for (const Instance& i : out.instances) {
      ASSERT_TRUE(i.score >= 0.25F && i.score <= 1.0F);
      ASSERT_TRUE(i.x0 >= 0 && i.x0 < i.x1 && i.x1 <= 101);
      ASSERT_TRUE(i.y0 >= 0 && i.y0 < i.y1 && i.y1 <= 57);
    }
    ASSERT_LE(*std::max_element(out.ids.begin(), out.ids.end()), out.instances.size());
  }
}

std::vector<Instance> random_boxes(Rng& rng, int count) {
  std::vector<Instance> boxes(count);
  for (Instance& b : boxes) {
    b.class_id = static_cast<int>(rng.below(3));
    b.score = static_cast<float>(rng.uniform());
    b.x0 = static_cast<float>(rng.uniform(0, 100));
    b.y0 = static_cast<float>(rng.uniform(0, 100));
    b.x1 = b.x0 + static_cast<float>(rng.uniform(1, 60));
    b.y1 = b.y0 + static_cast<float>(rng.uniform(1, 60));
  }
  return boxes;
}

TEST(SuppressOverlaps, KeptBoxesOfOneClassOverlapLittleAndDroppedOnesAreCoveredByBetter) {
  Rng rng(7);
  for (int round = 0; round < 50; ++round) {
    const auto boxes = random_boxes(rng, 80);
    const double limit = rng.uniform(0.1, 0.9);
    const std::vector<int> kept = suppress_overlaps(boxes, limit, 255);
    for (std::size_t a = 0; a < kept.size(); ++a) {
      for (std::size_t b = a + 1; b < kept.size(); ++b) {
        ASSERT_GE(boxes[kept[a]].score, boxes[kept[b]].score);
        if (boxes[kept[a]].class_id != boxes[kept[b]].class_id) continue;
        ASSERT_LE(box_iou(boxes[kept[a]], boxes[kept[b]]), limit);
      }
    }
    for (int i = 0; i < static_cast<int>(boxes.size()); ++i) {
      if (std::find(kept.begin(), kept.end(), i) != kept.end()) continue;
      ASSERT_TRUE(std::any_of(kept.begin(), kept.end(), [&](int k) {
        return boxes[k].class_id == boxes[i].class_id && boxes[k].score >= boxes[i].score &&
               box_iou(boxes[k], boxes[i]) > limit;
      }));
    }
  }
}

TEST(SuppressOverlaps, IsIdempotentAndKeepsTheBestWhenLimited) {
  Rng rng(8);
  const auto boxes = random_boxes(rng, 100);
  const std::vector<int> all = suppress_overlaps(boxes, 0.5, 255);
  std::vector<Instance> survivors;
  for (const int i : all) survivors.push_back(boxes[i]);
  EXPECT_EQ(suppress_overlaps(survivors, 0.5, 255).size(), survivors.size());
  const std::vector<int> few = suppress_overlaps(boxes, 0.5, 5);
  ASSERT_EQ(few.size(), 5U);
  EXPECT_TRUE(std::equal(few.begin(), few.end(), all.begin()));
}

TEST(BoxIou, IsSymmetricBetweenZeroAndOneAndOneForItself) {
  Rng rng(9);
  const auto boxes = random_boxes(rng, 40);
  for (const Instance& a : boxes) {
    EXPECT_NEAR(box_iou(a, a), 1.0F, 1e-5F);
    for (const Instance& b : boxes) {
      ASSERT_FLOAT_EQ(box_iou(a, b), box_iou(b, a));
      ASSERT_TRUE(box_iou(a, b) >= 0 && box_iou(a, b) <= 1.0F + 1e-6F);
    }
  }
}

}  // namespace
}  // namespace ygslam
