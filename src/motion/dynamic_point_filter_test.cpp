#include "motion/dynamic_point_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "motion/motion_test_world.hpp"

namespace ygslam {
namespace {

using motion_test::board_mask;
using motion_test::detect;
using motion_test::render;
using motion_test::Rendered;
using motion_test::Scene;

/// Camera gliding sideways, board moving up and across.
Scene scene_at(int k, bool board_moves) {
  Scene scene;
  scene.T_camera_world = SE3(so3_exp({0, 0.004 * k, 0}), Vec3(-0.05 * k, 0.01 * k, 0.01 * k));
  if (board_moves) scene.board_centre_m += Vec3(0.03 * k, -0.04 * k, 0);
  return scene;
}

struct Step {
  Rendered rendered;
  FeaturesPtr features;
  FilterResult result;
};

struct RunConfig {
  DynamicMode mode = DynamicMode::kGeometry;
  int frames = 6;
  bool board_moves = true;
  int mask_delay = -1;  // frames; -1 = no masks
  bool predict = false;
  bool rigid = true;
  MotionConfig motion{};
};

std::vector<Step> run(const RunConfig& config) {
  DynamicConfig dynamic;
  dynamic.mode = config.mode;
  dynamic.motion = config.motion;
  dynamic.rigid.enabled = config.rigid;
  DynamicPointFilter filter(dynamic, motion_test::small_camera(), 7);
  std::vector<Step> steps;
  for (int k = 0; k < config.frames; ++k) {
    Step step;
    step.rendered = render(scene_at(k, config.board_moves), static_cast<std::uint32_t>(k));
    step.features = detect(*step.rendered.frame, motion_test::small_camera());
    std::vector<SegmentationPtr> masks;
    if (config.mask_delay == 0) masks.push_back(board_mask(step.rendered));
    if (config.mask_delay > 0 && k >= config.mask_delay)
      masks.push_back(board_mask(steps[k - config.mask_delay].rendered));
    std::optional<FlowPrediction> predicted;
    if (config.predict && k > 0)
      predicted = FlowPrediction{scene_at(k, true).T_camera_world *
                                 scene_at(k - 1, true).T_camera_world.inverse()};
    step.result = filter.step(*step.rendered.frame, step.features, masks, predicted);
    steps.push_back(std::move(step));
  }
  return steps;
}

struct Score {
  double recall = 0, precision = 1, false_alarm = 0;
};

/// Against the board of the frame; points within 3 px of its edge are left out.
Score score(const Step& step) {
  double positives = 0, found = 0, flagged = 0, negatives = 0;
  const GreyImage& board = step.rendered.board;
  for (std::size_t i = 0; i < step.features->size(); ++i) {
    const auto& uv = step.features->points[i].uv_px;
    int inside = 0, all = 0;
    for (int dv = -3; dv <= 3; ++dv)
      for (int du = -3; du <= 3; ++du)
        if (const int u = static_cast<int>(uv.x()) + du, v = static_cast<int>(uv.y()) + dv;
            board.contains(u, v))
          ++all, inside += board.at(u, v);
    if (inside != 0 && inside != all) continue;
    const bool dynamic = step.result.labels.label[i] == MotionLabel::kDynamic;
    positives += inside ? 1 : 0;
    negatives += inside ? 0 : 1;
    found += inside && dynamic ? 1 : 0;
    flagged += dynamic ? 1 : 0;
  }
  return {found / std::max(positives, 1.0), flagged > 0 ? found / flagged : 1,
          (flagged - found) / std::max(negatives, 1.0)};
}

TEST(DynamicPointFilter, OffDoesNothingAndTrustsEverything) {
  for (const Step& step : run({.mode = DynamicMode::kOff, .frames = 3})) {
    EXPECT_EQ(step.result.labels.static_points, static_cast<int>(step.features->size()));
    EXPECT_TRUE(std::all_of(step.result.labels.weight.begin(), step.result.labels.weight.end(),
                            [](float w) { return w == 1.0F; }));
    EXPECT_EQ(step.result.followed, 0);
    EXPECT_EQ(step.result.check.state, CheckState::kNotRun);
  }
}

TEST(DynamicPointFilter, GeometryFindsAMoverNoDetectorKnows) {
  const auto steps = run({});
  for (std::size_t k = 1; k < steps.size(); ++k) {
    EXPECT_EQ(steps[k].result.check.state, CheckState::kDone);
    EXPECT_GT(score(steps[k]).recall, 0.7) << k;
    EXPECT_LT(score(steps[k]).false_alarm, 0.03) << k;
  }
}

TEST(DynamicPointFilter, StaticRoomFlagsAlmostNothing) {
  for (const bool predict : {false, true}) {
    const auto steps = run({.board_moves = false, .predict = predict});
    for (const Step& step : steps) {
      EXPECT_LE(step.result.labels.dynamic_points,
                0.01 * static_cast<double>(step.features->size()));
      EXPECT_FALSE(step.result.labels.too_few_static);
    }
  }
}

TEST(DynamicPointFilter, LateMasksLabelTheCurrentFrame) {
  const auto steps = run({.mode = DynamicMode::kSemantic, .frames = 8, .mask_delay = 3});
  for (std::size_t k = 3; k < steps.size(); ++k) {
    EXPECT_EQ(steps[k].result.mask_age_frames, 3);
    EXPECT_GT(score(steps[k]).recall, 0.93) << k;
    EXPECT_GT(score(steps[k]).precision, 0.95) << k;
  }
  EXPECT_EQ(steps[2].result.mask_age_frames, -1);
}

TEST(DynamicPointFilter, FullModeWithFreshMasksIsNearlyPerfect) {
  for (const Step& step : run({.mode = DynamicMode::kFull, .mask_delay = 0})) {
    EXPECT_GT(score(step).recall, 0.99);
    EXPECT_LT(score(step).false_alarm, 0.02);
  }
}

TEST(DynamicPointFilter, LinksFollowTheTrueMotion) {
  const auto steps = run({.frames = 4, .board_moves = false});
  const Camera camera = motion_test::small_camera();
  for (std::size_t k = 1; k < steps.size(); ++k) {
    const SE3 T = scene_at(static_cast<int>(k), false).T_camera_world *
                  scene_at(static_cast<int>(k) - 1, false).T_camera_world.inverse();
    int linked = 0, right = 0;
    const auto& links = steps[k].result.links;
    for (std::size_t i = 0; i < links.size(); ++i) {
      if (links[i] < 0) continue;
      const Feature& before = steps[k - 1].features->points[links[i]];
      const Vec3 p = T * camera.unproject(before.ideal_px.cast<double>(), before.depth_m);
      ++linked;
      right += (camera.project(p).cast<float>() - steps[k].features->points[i].ideal_px).norm() < 3;
    }
    EXPECT_GT(linked, 0.5 * static_cast<double>(links.size()));
    EXPECT_GT(right, 0.95 * linked);
  }
}

TEST(DynamicPointFilter, EverythingMaskedFallsBackAndSaysSo) {
  DynamicConfig config;
  config.propagation.mask.far_behind_ratio = 100;  // do not let depth mend this mask
  DynamicPointFilter filter(config, motion_test::small_camera(), 7);
  for (int k = 0; k < 5; ++k) {
    const Rendered rendered = render(scene_at(k, true), static_cast<std::uint32_t>(k));
    const auto features = detect(*rendered.frame, motion_test::small_camera());
    auto all = std::make_shared<Segmentation>(*board_mask(rendered));
    std::fill(all->ids.begin(), all->ids.end(), std::uint8_t{1});
    const auto result =
        filter.step(*rendered.frame, features, std::vector<SegmentationPtr>{all}, std::nullopt);
    EXPECT_TRUE(result.labels.too_few_static);
    EXPECT_EQ(result.labels.recalled, 60);
    int on_board = 0;
    for (std::size_t i = 0; i < features->size(); ++i) {
      if (result.labels.weight[i] <= 0) continue;
      const auto& uv = features->points[i].uv_px;
      on_board += rendered.board.at(static_cast<int>(uv.x()), static_cast<int>(uv.y()));
    }
    // Geometry alone tells the room from the board.
    if (k > 0) {
      EXPECT_LE(on_board, 3) << k;
    }
  }
}

TEST(DynamicPointFilter, ClassicCheckRunsOnHarrisCorners) {
  RunConfig config;
  config.motion.prior = false;
  config.motion.corners = FlowCorners::kHarris;
  config.rigid = false;
  const auto steps = run(config);
  for (std::size_t k = 1; k < steps.size(); ++k) {
    EXPECT_EQ(steps[k].result.check.state, CheckState::kDone);
    EXPECT_LT(score(steps[k]).false_alarm, 0.03) << k;
    int judged = 0;
    for (const float d : steps[k].result.epipolar_px) judged += d >= 0 ? 1 : 0;
    EXPECT_GT(judged, 0.1 * static_cast<double>(steps[k].features->size())) << k;
  }
}

TEST(DynamicPointFilter, ReportedLabelsAreTheNextPrior) {
  DynamicConfig config;
  config.mode = DynamicMode::kGeometry;
  DynamicPointFilter filter(config, motion_test::small_camera(), 7);
  const Rendered first = render(scene_at(0, true), 0);
  const auto features = detect(*first.frame, motion_test::small_camera());
  (void)filter.step(*first.frame, features, {}, std::nullopt);
  filter.report(std::vector<MotionLabel>(features->size(), MotionLabel::kDynamic));
  const Rendered second = render(scene_at(1, true), 1);
  const auto result = filter.step(*second.frame, detect(*second.frame, motion_test::small_camera()),
                                  {}, std::nullopt);
  EXPECT_EQ(result.check.state, CheckState::kTooFewStatic);
}

TEST(DynamicPointFilter, SecondLookWithTheTrueMotionCorrectsAWrongPrior) {
  DynamicConfig config;
  config.mode = DynamicMode::kGeometry;
  DynamicPointFilter filter(config, motion_test::small_camera(), 7);
  Step first{render(scene_at(0, true), 0), nullptr, {}};
  first.features = detect(*first.rendered.frame, motion_test::small_camera());
  (void)filter.step(*first.rendered.frame, first.features, {}, std::nullopt);
  // The board is taken for the room and the room for the mover.
  std::vector<MotionLabel> swapped;
  for (const Feature& f : first.features->points)
    swapped.push_back(
        first.rendered.board.at(static_cast<int>(f.uv_px.x()), static_cast<int>(f.uv_px.y()))
            ? MotionLabel::kStatic
            : MotionLabel::kDynamic);
  filter.report(swapped);
  Step second{render(scene_at(1, true), 1), nullptr, {}};
  second.features = detect(*second.rendered.frame, motion_test::small_camera());
  second.result = filter.step(*second.rendered.frame, second.features, {}, std::nullopt);
  const Score before = score(second);
  second.result.labels =
      filter.rejudge(scene_at(1, true).T_camera_world * scene_at(0, true).T_camera_world.inverse(),
                     scene_at(1, true).T_camera_world);
  const Score after = score(second);
  EXPECT_GT(before.false_alarm, 0.3);
  EXPECT_LT(after.false_alarm, 0.05);
  EXPECT_GT(after.recall, 0.7);
}

TEST(DynamicPointFilter, SecondLookWithoutAFirstChangesNothing) {
  DynamicPointFilter filter({}, motion_test::small_camera(), 7);
  EXPECT_TRUE(filter.rejudge(SE3(), SE3()).label.empty());
  const Rendered first = render(scene_at(0, true), 0);
  const auto features = detect(*first.frame, motion_test::small_camera());
  const auto result = filter.step(*first.frame, features, {}, std::nullopt);
  EXPECT_EQ(filter.rejudge(SE3(), SE3()).label, result.labels.label);
}

TEST(DynamicPointFilter, IntrudersStayWithTheirPointsUntilTheMapSaysOtherwise) {
  DynamicConfig config;
  config.mode = DynamicMode::kGeometry;
  DynamicPointFilter filter(config, motion_test::small_camera(), 7);
  const auto on_board = [](const Step& step) {
    std::vector<std::uint8_t> result;
    for (const Feature& f : step.features->points)
      result.push_back(
          step.rendered.board.at(static_cast<int>(f.uv_px.x()), static_cast<int>(f.uv_px.y())) > 0);
    return result;
  };
  Step step;
  for (int k = 0; k < 4; ++k) {
    step = {render(scene_at(0, true), static_cast<std::uint32_t>(k)), nullptr, {}};
    step.features = detect(*step.rendered.frame, motion_test::small_camera());
    step.result = filter.step(*step.rendered.frame, step.features, {}, std::nullopt);
    const auto board = on_board(step);
    if (k == 2) {
      EXPECT_EQ(step.result.intrudes, board) << "nothing moves, but it is remembered";
    }
    if (k == 3) {
      EXPECT_EQ(step.result.intrudes, std::vector<std::uint8_t>(board.size(), 0));
    }
    if (k == 1) {
      const StaticLabels labels = filter.rejudge(SE3(), SE3(), board);
      for (std::size_t i = 0; i < board.size(); ++i)
        EXPECT_EQ(labels.label[i] == MotionLabel::kDynamic, board[i] != 0) << i;
    } else if (k == 2) {
      (void)filter.rejudge(SE3(), SE3(), std::vector<std::uint8_t>(board.size(), 0));
    }
  }
}

TEST(DynamicPointFilter, WhatMovesWithoutAMaskBecomesAnObject) {
  DynamicConfig config;
  config.mode = DynamicMode::kGeometry;
  DynamicPointFilter filter(config, motion_test::small_camera(), 7);
  Rendered last;
  for (int k = 0; k < 14; ++k) {
    last = render(scene_at(k, true), static_cast<std::uint32_t>(k));
    const auto features = detect(*last.frame, motion_test::small_camera());
    (void)filter.step(*last.frame, features, {}, std::nullopt);
    if (k == 0) continue;
    const SE3 T_now_world = scene_at(k, true).T_camera_world;
    (void)filter.rejudge(T_now_world * scene_at(k - 1, true).T_camera_world.inverse(), T_now_world);
  }
  const auto objects = filter.objects();
  ASSERT_EQ(objects.size(), 1U);
  EXPECT_FALSE(objects[0].resting);
  const SE3 T_camera_world = scene_at(13, true).T_camera_world;
  const Vec2 centre_px =
      motion_test::small_camera().project(T_camera_world * objects[0].centre_world);
  EXPECT_TRUE(last.board.at(static_cast<int>(centre_px.x()), static_cast<int>(centre_px.y())));
}

TEST(DynamicPointFilter, SurvivesBlankFramesMissingDepthAndOtherSizes) {
  DynamicPointFilter filter({}, motion_test::small_camera(), 7);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (int k = 0; k < 6; ++k) {
    const Rendered rendered = render(scene_at(k, true), static_cast<std::uint32_t>(k));
    RgbdFrame frame = *rendered.frame;
    FeaturesPtr features = detect(frame, motion_test::small_camera());
    if (k == 1) std::fill(frame.depth_m.begin(), frame.depth_m.end(), nan);
    if (k == 2) {
      std::fill(frame.grey.begin(), frame.grey.end(), std::uint8_t{0});
      features = std::make_shared<const Features>();
    }
    if (k == 4) {
      frame.grey = GreyImage(64, 48, 10);
      frame.depth_m = DepthImage(64, 48, 1.0F);
    }
    if (k == 1) {
      auto broken = std::make_shared<Features>(*features);
      for (auto& p : broken->points) p.depth_m = nan;
      features = broken;
    }
    const auto result =
        filter.step(frame, features, std::vector<SegmentationPtr>{nullptr, board_mask(rendered)},
                    FlowPrediction{SE3(Mat3::Identity(), Vec3(0.01, 0, 0))});
    EXPECT_EQ(result.labels.label.size(), features->size());
    for (const float w : result.labels.weight) EXPECT_TRUE(w >= 0 && w <= 1);
  }
}

TEST(DynamicPointFilter, SameSeedSameResult) {
  const auto a = run({.mode = DynamicMode::kFull, .mask_delay = 2});
  const auto b = run({.mode = DynamicMode::kFull, .mask_delay = 2});
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].result.labels.label, b[k].result.labels.label);
    EXPECT_EQ(a[k].result.labels.weight, b[k].result.labels.weight);
    EXPECT_EQ(a[k].result.epipolar_px, b[k].result.epipolar_px);
  }
}

}  // namespace
}  // namespace ygslam
