#include "motion/masks/label_history.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/rng.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr float kWall_m = 4.0F;
constexpr float kBox_m = 2.0F;

/// A box 100 px wide that moves over the image by step_px per frame, and points: on the box they
/// move with it, on the wall they stay.
struct BoxWorld {
  explicit BoxWorld(std::uint64_t seed) : rng(seed) {
    for (int i = 0; i < 150; ++i)
      wall.emplace_back(random_in_box<2>(rng, {5, 5}, {kWidth - 5, kHeight - 5}).cast<float>());
    for (int i = 0; i < 80; ++i)
      on_box.emplace_back(random_in_box<2>(rng, {4, 4}, {96, 156}).cast<float>());
  }

  [[nodiscard]] int box_x(int k) const { return 20 + step_px * k; }
  [[nodiscard]] bool in_box(const Eigen::Vector2f& p, int k) const {
    return p.x() >= static_cast<float>(box_x(k)) && p.x() < static_cast<float>(box_x(k) + 100) &&
           p.y() >= 40 && p.y() < 200;
  }
  [[nodiscard]] DepthImage depth(int k) const {
    DepthImage d(kWidth, kHeight, kWall_m);
    for (int v = 40; v < 200; ++v)
      for (int u = std::max(box_x(k), 0); u < std::min(box_x(k) + 100, kWidth); ++u)
        d.at(u, v) = kBox_m;
    return d;
  }
  [[nodiscard]] Segmentation mask(int k, int class_id = 0) const {
    Segmentation s;
    s.frame = FrameId{static_cast<std::uint32_t>(k)};
    s.instances.push_back({class_id, 0.9F, 0, 0, 0, 0});
    s.ids = GreyImage(kWidth, kHeight);
    for (int v = 40; v < 200; ++v)
      for (int u = std::max(box_x(k), 0); u < std::min(box_x(k) + 100, kWidth); ++u)
        s.ids.at(u, v) = 1;
    return s;
  }

  struct Frame {
    FeaturesPtr features;
    std::vector<std::int32_t> link;
    std::vector<FlowEnd> ends;  // of the features of the frame before
    std::vector<std::uint8_t> moving;
  };
  /// Visible points of frame k; a share of them is seen without a link (as if detected anew).
  Frame frame(int k, double unlinked_share = 0.2) {
    Frame out;
    auto features = std::make_shared<Features>();
    std::vector<int> index(wall.size() + on_box.size(), -1);
    const auto add = [&](std::size_t id, const Eigen::Vector2f& uv, float depth_m, bool moves) {
      Feature f;
      f.uv_px = f.ideal_px = uv;
      f.depth_m = depth_m;
      const bool linked = !last_index.empty() && rng.uniform() >= unlinked_share;
      out.link.push_back(linked ? last_index[id] : -1);
      out.moving.push_back(moves ? 1 : 0);
      index[id] = static_cast<int>(features->points.size());
      features->points.push_back(f);
    };
    for (std::size_t i = 0; i < wall.size(); ++i)
      if (!in_box(wall[i], k)) add(i, wall[i], kWall_m, false);
    for (std::size_t i = 0; i < on_box.size(); ++i)
      add(wall.size() + i, on_box[i] + Eigen::Vector2f(static_cast<float>(box_x(k)), 40.0F), kBox_m,
          true);
    features->descriptors.resize(features->points.size());
    out.features = features;
    out.ends.resize(last_features);
    for (std::size_t id = 0; id < last_index.size(); ++id)
      if (last_index[id] >= 0 && index[id] >= 0)
        out.ends[last_index[id]] = {features->points[index[id]].uv_px, true};
    last_index = index;
    last_features = features->size();
    return out;
  }

  Rng rng;
  int step_px = 12;
  std::vector<Eigen::Vector2f> wall, on_box;
  std::vector<int> last_index;
  std::size_t last_features = 0;
};

struct Tally {
  int right = 0, wrong = 0, unknown = 0;
};
Tally compare(const std::vector<SemanticPoint>& labels, const std::vector<std::uint8_t>& moving) {
  Tally t;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i].label == SemanticLabel::kUnknown)
      ++t.unknown;
    else if ((labels[i].label == SemanticLabel::kMovable) == (moving[i] != 0))
      ++t.right;
    else
      ++t.wrong;
  }
  return t;
}

TEST(LabelHistory, MaskOfTheNewestFrameLabelsItExactly) {
  BoxWorld world(1);
  LabelHistory history({});
  const auto f = world.frame(0);
  history.push(FrameId{0}, f.features, f.link, f.ends, world.depth(0));
  EXPECT_EQ(history.mask_age_frames(), -1);
  EXPECT_EQ(compare(history.current(), f.moving).unknown, static_cast<int>(f.features->size()));
  ASSERT_TRUE(history.apply(world.mask(0)));
  const auto t = compare(history.current(), f.moving);
  EXPECT_EQ(t.right, static_cast<int>(f.features->size()));
  EXPECT_EQ(history.mask_age_frames(), 0);
  for (const auto& p : history.current()) EXPECT_EQ(p.mask_age_frames, 0);
}

TEST(LabelHistory, LateLabelsFollowTheFlowWhereAPastedMaskIsWrong) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    BoxWorld world(seed);
    LabelHistory history({});
    BoxWorld::Frame last;
    for (int k = 0; k <= 8; ++k) {
      last = world.frame(k);
      history.push(FrameId{static_cast<std::uint32_t>(k)}, last.features, last.link, last.ends,
                   world.depth(k));
    }
    ASSERT_TRUE(history.apply(world.mask(2)));
    EXPECT_EQ(history.mask_age_frames(), 6);
    const auto t = compare(history.current(), last.moving);
    const auto n = static_cast<double>(last.features->size());
    EXPECT_GT(t.right, 0.88 * n) << "seed " << seed;
    EXPECT_LT(t.wrong, 0.01 * n) << "seed " << seed;
    // The same mask laid over the current image.
    int pasted_wrong = 0;
    for (std::size_t i = 0; i < last.moving.size(); ++i)
      pasted_wrong +=
          world.in_box(last.features->points[i].uv_px, 2) != (last.moving[i] != 0) ? 1 : 0;
    EXPECT_GT(pasted_wrong, 0.2 * n) << "seed " << seed;
  }
}

TEST(LabelHistory, NewerMaskReplacesOlderAndOlderIsRefusedAfterwards) {
  BoxWorld world(3);
  LabelHistory history({});
  for (int k = 0; k <= 5; ++k) {
    const auto f = world.frame(k);
    history.push(FrameId{static_cast<std::uint32_t>(k)}, f.features, f.link, f.ends,
                 world.depth(k));
  }
  EXPECT_TRUE(history.apply(world.mask(4)));
  EXPECT_EQ(history.mask_age_frames(), 1);
  EXPECT_FALSE(history.apply(world.mask(1)));
  EXPECT_FALSE(history.apply(world.mask(4)));
  EXPECT_TRUE(history.apply(world.mask(5)));
  EXPECT_EQ(history.mask_age_frames(), 0);
}

TEST(LabelHistory, RefusesMasksItCannotPlace) {
  BoxWorld world(3);
  LabelHistoryConfig config;
  config.history_frames = 4;
  LabelHistory history(config);
  EXPECT_FALSE(history.apply(world.mask(0)));
  for (int k = 0; k <= 10; ++k) {
    const auto f = world.frame(k);
    history.push(FrameId{static_cast<std::uint32_t>(k)}, f.features, f.link, f.ends,
                 world.depth(k));
  }
  EXPECT_LE(history.size(), 5U);  // memory is bounded
  EXPECT_FALSE(history.apply(world.mask(2)));
  EXPECT_FALSE(history.apply(world.mask(99)));
  Segmentation wrong_size = world.mask(9);
  wrong_size.ids = GreyImage(100, 100, 1);
  EXPECT_FALSE(history.apply(wrong_size));
  wrong_size.ids = {};
  EXPECT_FALSE(history.apply(wrong_size));
  EXPECT_TRUE(history.apply(world.mask(7)));
}

TEST(LabelHistory, OldMasksFadeToUnknown) {
  BoxWorld world(4);
  LabelHistoryConfig config;
  config.max_mask_age_frames = 3;
  LabelHistory history(config);
  for (int k = 0; k <= 5; ++k) {
    const auto f = world.frame(k, 0.0);
    history.push(FrameId{static_cast<std::uint32_t>(k)}, f.features, f.link, f.ends,
                 world.depth(k));
    if (k == 0) {
      ASSERT_TRUE(history.apply(world.mask(0)));
    }
    const auto t = compare(history.current(), f.moving);
    if (k <= 3) {
      EXPECT_LT(t.unknown, 0.05 * static_cast<double>(f.moving.size())) << k;
      EXPECT_EQ(t.wrong, 0) << k;
    } else {
      EXPECT_EQ(t.right + t.wrong, 0) << k;
      EXPECT_EQ(history.mask_age_frames(), -1);
    }
  }
}

TEST(LabelHistory, OnlyMovableClassesCount) {
  BoxWorld world(5);
  const auto f = world.frame(0);
  constexpr int kCup = 41;
  for (const bool asked_for : {false, true}) {
    LabelHistoryConfig config;
    if (asked_for) config.mask.movable = MovableClasses({kCup});
    LabelHistory history(config);
    history.push(FrameId{0}, f.features, f.link, f.ends, world.depth(0));
    ASSERT_TRUE(history.apply(world.mask(0, kCup)));
    int movable = 0;
    for (const auto& p : history.current()) movable += p.label == SemanticLabel::kMovable ? 1 : 0;
    EXPECT_EQ(movable > 0, asked_for);
  }
}

TEST(MaskLabels, DepthMendsTheRim) {
  BoxWorld world(7);
  Segmentation small =
      world.mask(0);                // the box is 20..119; make the mask two pixels too small and,
  for (int v = 40; v < 200; ++v) {  // on the right, two too large
    small.ids.at(20, v) = small.ids.at(21, v) = 0;
    small.ids.at(120, v) = small.ids.at(121, v) = 1;
  }
  Features features;
  const auto add = [&](float u, float depth_m) {
    Feature f;
    f.uv_px = f.ideal_px = {u, 120.0F};
    f.depth_m = depth_m;
    features.points.push_back(f);
  };
  add(20, kBox_m);    // outside the mask, at the box's depth
  add(121, kWall_m);  // inside the mask, far behind
  add(70, kBox_m);    // inside
  add(10, kWall_m);   // well outside
  add(18, kWall_m);   // within the rim, behind
  add(70, kWall_m);   // inside, seen through a hole
  add(117, 0);        // inside, near the edge, without depth: in the object's shadow or on it
  add(70, 0);         // inside, without depth
  features.descriptors.resize(features.points.size());
  const auto labels = label_by_mask(features, small, CoarseDepth(world.depth(0)), {});
  EXPECT_EQ(labels[0].label, SemanticLabel::kMovable);
  EXPECT_EQ(labels[1].label, SemanticLabel::kStatic);
  EXPECT_EQ(labels[2].label, SemanticLabel::kMovable);
  EXPECT_EQ(labels[3].label, SemanticLabel::kStatic);
  EXPECT_EQ(labels[4].label, SemanticLabel::kStatic);
  EXPECT_EQ(labels[5].label, SemanticLabel::kStatic);
  EXPECT_EQ(labels[6].label, SemanticLabel::kUnknown);
  EXPECT_EQ(labels[7].label, SemanticLabel::kMovable);
}

TEST(FlowField, WhatHasNoDepthAsksItsLikeOnly) {
  std::vector<Feature> previous(2);
  previous[0].uv_px = {50, 50};  // on a near object
  previous[0].depth_m = 1.0F;
  previous[1].uv_px = {60, 50};  // in its shadow
  DepthImage depth(120, 100, 1.0F);
  for (int v = 0; v < 100; ++v)
    for (int u = 56; u < 64; ++u) depth.at(u, v) = 0;
  const std::vector<FlowEnd> ends{{{50, 50}, true}, {{60, 50}, true}};
  const FlowField field(ends, previous, depth, {});
  const auto asked = [&](float u, float depth_m) {
    Feature feature;
    feature.uv_px = {u, 50.0F};
    feature.depth_m = depth_m;
    std::vector<std::uint32_t> found;
    field.neighbours(feature, [&](std::uint32_t k, float) { found.push_back(k); });
    return found;
  };
  EXPECT_EQ(asked(55, 1.0F), std::vector<std::uint32_t>{0});
  EXPECT_EQ(asked(57, 0.0F), std::vector<std::uint32_t>{1});
}

TEST(MaskLabels, SurviveDepthThatIsNotANumber) {
  BoxWorld world(8);
  auto f = world.frame(0);
  auto broken = std::make_shared<Features>(*f.features);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (auto& p : broken->points) p.depth_m = nan;
  broken->points[0].uv_px = {nan, nan};
  broken->points[1].uv_px = {-20, 1e9F};
  LabelHistory history({});
  const DepthImage depth(kWidth, kHeight, nan);
  history.push(FrameId{0}, broken, std::vector<std::int32_t>(broken->size(), -1), {}, depth);
  ASSERT_TRUE(history.apply(world.mask(0)));
  auto t = compare(history.current(), f.moving);
  EXPECT_LE(t.wrong, 2);
  EXPECT_GT(t.right, 150);
  history.push(FrameId{1}, broken, std::vector<std::int32_t>(broken->size(), -1),
               std::vector<FlowEnd>(broken->size(), {{nan, nan}, true}), depth);
  EXPECT_EQ(history.current().size(), broken->size());
}

}  // namespace
}  // namespace ygslam
