#include "motion/classification/point_classifier.hpp"

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
  FrameEvidence evidence;
  PointLabels labels;
};

Step seen_at(int k, bool board_moves) {
  Step step{render(scene_at(k, board_moves), static_cast<std::uint32_t>(k)), nullptr, {}, {}};
  step.features = detect(*step.rendered.frame, motion_test::small_camera());
  return step;
}

/// One frame as the tracker has it before the pose.
void observe(PointClassifier& classifier, std::span<const SegmentationPtr> masks,
             const std::optional<FlowPrediction>& predicted, Step& step) {
  const RgbdFrame& frame = *step.rendered.frame;
  step.evidence = classifier.observe(frame, step.features, classifier.follow(frame, predicted), {},
                                     masks, predicted);
  step.labels = classifier.classify(step.evidence);
}

void remember(PointClassifier& classifier, const Step& step) {
  classifier.remember(step.evidence, step.labels.label);
}

/// Per feature 1 on the board.
std::vector<std::uint8_t> on_board(const Step& step) {
  std::vector<std::uint8_t> result;
  for (const Feature& f : step.features->points)
    result.push_back(
        step.rendered.board.at(static_cast<int>(f.uv_px.x()), static_cast<int>(f.uv_px.y())) > 0);
  return result;
}

struct RunConfig {
  DynamicMode mode = DynamicMode::kGeometry;
  int frames = 6;
  bool board_moves = true;
  int mask_delay = -1;  // frames; -1 = no masks
  bool predict = false;
  bool rigid = true;
  EpipolarConfig epipolar{};
};

std::vector<Step> run(const RunConfig& config) {
  DynamicConfig dynamic;
  dynamic.mode = config.mode;
  dynamic.epipolar = config.epipolar;
  dynamic.ego_motion.enabled = config.rigid;
  PointClassifier classifier(dynamic, motion_test::small_camera(), 7);
  std::vector<Step> steps;
  for (int k = 0; k < config.frames; ++k) {
    Step step = seen_at(k, config.board_moves);
    std::vector<SegmentationPtr> masks;
    if (config.mask_delay == 0) masks.push_back(board_mask(step.rendered));
    if (config.mask_delay > 0 && k >= config.mask_delay)
      masks.push_back(board_mask(steps[k - config.mask_delay].rendered));
    std::optional<FlowPrediction> predicted;
    if (config.predict && k > 0)
      predicted = FlowPrediction{scene_at(k, true).T_camera_world *
                                 scene_at(k - 1, true).T_camera_world.inverse()};
    observe(classifier, masks, predicted, step);
    remember(classifier, step);
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
    const bool dynamic = step.labels.label[i] == MotionLabel::kDynamic;
    positives += inside ? 1 : 0;
    negatives += inside ? 0 : 1;
    found += inside && dynamic ? 1 : 0;
    flagged += dynamic ? 1 : 0;
  }
  return {found / std::max(positives, 1.0), flagged > 0 ? found / flagged : 1,
          (flagged - found) / std::max(negatives, 1.0)};
}

TEST(PointClassifier, OffDoesNothingAndTrustsEverything) {
  for (const Step& step : run({.mode = DynamicMode::kOff, .frames = 3})) {
    EXPECT_EQ(step.labels.static_points, static_cast<int>(step.features->size()));
    EXPECT_TRUE(std::all_of(step.labels.weight.begin(), step.labels.weight.end(),
                            [](float w) { return w == 1.0F; }));
    EXPECT_EQ(step.evidence.followed.size(), 0U);
    EXPECT_EQ(step.evidence.epipolar.state, CheckState::kNotRun);
  }
}

TEST(PointClassifier, GeometryFindsAMoverNoDetectorKnows) {
  const auto steps = run({});
  for (std::size_t k = 1; k < steps.size(); ++k) {
    EXPECT_EQ(steps[k].evidence.epipolar.state, CheckState::kDone);
    EXPECT_GT(score(steps[k]).recall, 0.7) << k;
    EXPECT_LT(score(steps[k]).false_alarm, 0.03) << k;
  }
}

TEST(PointClassifier, StaticRoomFlagsAlmostNothing) {
  for (const bool predict : {false, true}) {
    const auto steps = run({.board_moves = false, .predict = predict});
    for (const Step& step : steps) {
      EXPECT_LE(step.labels.dynamic_points, 0.01 * static_cast<double>(step.features->size()));
      EXPECT_FALSE(step.labels.too_few_static);
    }
  }
}

TEST(PointClassifier, LateMasksLabelTheCurrentFrame) {
  const auto steps = run({.mode = DynamicMode::kSemantic, .frames = 8, .mask_delay = 3});
  for (std::size_t k = 3; k < steps.size(); ++k) {
    EXPECT_EQ(steps[k].evidence.mask_age_frames, 3);
    EXPECT_GT(score(steps[k]).recall, 0.93) << k;
    EXPECT_GT(score(steps[k]).precision, 0.95) << k;
  }
  EXPECT_EQ(steps[2].evidence.mask_age_frames, -1);
}

TEST(PointClassifier, FullModeWithFreshMasksIsNearlyPerfect) {
  for (const Step& step : run({.mode = DynamicMode::kFull, .mask_delay = 0})) {
    EXPECT_GT(score(step).recall, 0.99);
    EXPECT_LT(score(step).false_alarm, 0.02);
  }
}

TEST(PointClassifier, LinksFollowTheTrueMotion) {
  const auto steps = run({.frames = 4, .board_moves = false});
  const Camera& camera = motion_test::small_camera();
  for (std::size_t k = 1; k < steps.size(); ++k) {
    const SE3 T = scene_at(static_cast<int>(k), false).T_camera_world *
                  scene_at(static_cast<int>(k) - 1, false).T_camera_world.inverse();
    int linked = 0, right = 0;
    const auto& links = steps[k].evidence.links;
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

TEST(PointClassifier, FeaturesThatWereFollowedGoOnFromTheirPoints) {
  PointClassifier classifier(DynamicConfig{.mode = DynamicMode::kGeometry},
                             motion_test::small_camera(), 7);
  Step first = seen_at(0, false);
  observe(classifier, {}, std::nullopt, first);
  remember(classifier, first);
  const Step second = seen_at(1, false);
  const RgbdFrame& frame = *second.rendered.frame;
  FrameFlow flow = classifier.follow(frame, std::nullopt);
  ASSERT_EQ(flow.previous, first.features);
  // Every second one, in another order.
  Features followed;
  std::vector<std::int32_t> links;
  for (auto k = static_cast<std::int32_t>(first.features->size()) - 1; k >= 0; k -= 2) {
    const FlowEnd& end = flow.followed.ends[static_cast<std::size_t>(k)];
    if (!end.found) continue;
    followed.points.push_back(first.features->points[static_cast<std::size_t>(k)]);
    followed.points.back().uv_px = followed.points.back().ideal_px = end.uv_px;
    followed.descriptors.emplace_back();
    links.push_back(k);
  }
  ASSERT_GT(links.size(), 50U);
  const auto evidence = classifier.observe(frame, std::make_shared<const Features>(followed),
                                           std::move(flow), links, {}, std::nullopt);
  EXPECT_EQ(evidence.links, links);
  const PointLabels labels = classifier.classify(evidence);
  EXPECT_GT(labels.static_points, 0.9 * static_cast<double>(links.size()));
}

TEST(PointClassifier, EverythingMaskedFallsBackAndSaysSo) {
  DynamicConfig config;
  config.masks.mask.far_behind_ratio = 100;  // do not let depth mend this mask
  PointClassifier classifier(config, motion_test::small_camera(), 7);
  for (int k = 0; k < 5; ++k) {
    Step step = seen_at(k, true);
    auto all = std::make_shared<Segmentation>(*board_mask(step.rendered));
    std::fill(all->ids.begin(), all->ids.end(), std::uint8_t{1});
    observe(classifier, std::vector<SegmentationPtr>{all}, std::nullopt, step);
    remember(classifier, step);
    EXPECT_TRUE(step.labels.too_few_static);
    EXPECT_EQ(step.labels.fallback_points, 60);
    const auto board = on_board(step);
    int usable_on_board = 0;
    for (std::size_t i = 0; i < board.size(); ++i)
      usable_on_board += step.labels.weight[i] > 0 ? board[i] : 0;
    // Geometry alone tells the room from the board.
    if (k > 0) {
      EXPECT_LE(usable_on_board, 3) << k;
    }
  }
}

TEST(PointClassifier, ClassicCheckRunsOnHarrisCorners) {
  RunConfig config;
  config.epipolar.prior = false;
  config.epipolar.corners = FlowCorners::kHarris;
  config.rigid = false;
  const auto steps = run(config);
  for (std::size_t k = 1; k < steps.size(); ++k) {
    EXPECT_EQ(steps[k].evidence.epipolar.state, CheckState::kDone);
    EXPECT_LT(score(steps[k]).false_alarm, 0.03) << k;
    int judged = 0;
    for (const PointEvidence& point : steps[k].evidence.points)
      judged += point.epipolar_px >= 0 ? 1 : 0;
    EXPECT_GT(judged, 0.1 * static_cast<double>(steps[k].features->size())) << k;
  }
}

TEST(PointClassifier, RememberedLabelsAreTheNextPrior) {
  DynamicConfig config;
  config.mode = DynamicMode::kGeometry;
  PointClassifier classifier(config, motion_test::small_camera(), 7);
  for (int k = 0; k < 2; ++k) {
    Step step = seen_at(k, true);
    observe(classifier, {}, std::nullopt, step);
    std::fill(step.labels.label.begin(), step.labels.label.end(), MotionLabel::kDynamic);
    remember(classifier, step);
  }
  Step third = seen_at(2, true);
  observe(classifier, {}, std::nullopt, third);
  EXPECT_EQ(third.evidence.epipolar.state, CheckState::kTooFewStatic);
}

TEST(PointClassifier, FreeSpaceViolationsStayWithTheirPointsUntilTheMapSaysOtherwise) {
  DynamicConfig config;
  config.mode = DynamicMode::kGeometry;
  PointClassifier classifier(config, motion_test::small_camera(), 7);
  const auto flags = [](const FrameEvidence& evidence) {
    std::vector<std::uint8_t> result;
    for (const PointEvidence& point : evidence.points) result.push_back(point.in_free_space);
    return result;
  };
  for (int k = 0; k < 4; ++k) {
    Step step{render(scene_at(0, true), static_cast<std::uint32_t>(k)), nullptr, {}, {}};
    step.features = detect(*step.rendered.frame, motion_test::small_camera());
    observe(classifier, {}, std::nullopt, step);
    const auto board = on_board(step);
    const std::vector<std::uint8_t> none(board.size(), 0);
    if (k == 1) {
      step.evidence = with_free_space(step.evidence, board);
      step.labels = classifier.classify(step.evidence);
      for (std::size_t i = 0; i < board.size(); ++i)
        EXPECT_EQ(step.labels.label[i] == MotionLabel::kDynamic, board[i] != 0) << i;
    } else if (k == 2) {
      EXPECT_EQ(flags(step.evidence), board) << "nothing moves, but it is remembered";
      step.evidence = with_free_space(step.evidence, none);
    } else if (k == 3) {
      EXPECT_EQ(flags(step.evidence), none);
    }
    remember(classifier, step);
  }
}

TEST(PointClassifier, TellsWhatMovesFromWhatStands) {
  DynamicConfig config;
  config.mode = DynamicMode::kGeometry;
  PointClassifier classifier(config, motion_test::small_camera(), 7);
  int board_points = 0, board_moves = 0, room_points = 0, room_moves = 0;
  for (int k = 0; k < 6; ++k) {
    Step step = seen_at(k, true);
    observe(classifier, {}, std::nullopt, step);
    const auto motion = classifier.motion_of(step.evidence);
    const auto board = on_board(step);
    for (std::size_t i = 0; k > 0 && i < board.size(); ++i) {
      if (motion[i] == PointMotion::kUnknown) continue;
      const int moves = motion[i] == PointMotion::kMoves ? 1 : 0;
      (board[i] ? board_points : room_points) += 1;
      (board[i] ? board_moves : room_moves) += moves;
    }
    remember(classifier, step);
  }
  EXPECT_GT(board_moves, 0.8 * board_points);
  EXPECT_LT(room_moves, 0.02 * room_points);
  EXPECT_GT(board_points, 100);
}

TEST(PointClassifier, SurvivesBlankFramesMissingDepthAndOtherSizes) {
  PointClassifier classifier({}, motion_test::small_camera(), 7);
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
    const FlowPrediction predicted{SE3(Mat3::Identity(), Vec3(0.01, 0, 0))};
    FrameEvidence evidence =
        classifier.observe(frame, features, classifier.follow(frame, predicted), {},
                           std::vector<SegmentationPtr>{nullptr, board_mask(rendered)}, predicted);
    const PointLabels labels = classifier.classify(evidence);
    EXPECT_EQ(labels.label.size(), features->size());
    for (const float w : labels.weight) EXPECT_TRUE(w >= 0 && w <= 1);
    classifier.remember(std::move(evidence), labels.label);
  }
}

// With a rolling shutter both ends of a flow are brought to the middle of their frames, or neither.
TEST(PointClassifier, CornersWithoutAMiddleInstantKeepBothEndsAsSeen) {
  for (const FlowCorners corners : {FlowCorners::kHarris, FlowCorners::kOrb}) {
    DynamicConfig config;
    config.mode = DynamicMode::kGeometry;
    config.epipolar.corners = corners;
    std::vector<std::vector<FollowedPoint>> ends;
    for (const double readout_s : {0.0, 0.03}) {
      PointClassifier classifier(config, motion_test::small_camera(), 7);
      Step before = seen_at(0, false);
      observe(classifier, {}, std::nullopt, before);
      remember(classifier, before);
      Step step = seen_at(1, false);
      FlowPrediction predicted;
      predicted.T_current_previous =
          scene_at(1, false).T_camera_world * scene_at(0, false).T_camera_world.inverse();
      predicted.read_out.times.colour_readout_s = readout_s;
      predicted.read_out.body_velocity << 0.5, 0.2, 0, 0.3, 1, 0.5;
      observe(classifier, {}, predicted, step);
      ends.push_back(step.evidence.followed.points);
    }
    ASSERT_EQ(ends[0].size(), ends[1].size());
    double apart_px = 0;
    for (std::size_t i = 0; i < ends[0].size(); ++i)
      if (ends[0][i].current_px.allFinite() && ends[1][i].current_px.allFinite())
        apart_px = std::max(apart_px, (ends[0][i].current_px - ends[1][i].current_px).norm());
    if (corners == FlowCorners::kHarris) {
      EXPECT_EQ(apart_px, 0);
    } else {
      EXPECT_GT(apart_px, 0.5);
    }
  }
}

TEST(PointClassifier, SameSeedSameResult) {
  const auto a = run({.mode = DynamicMode::kFull, .mask_delay = 2});
  const auto b = run({.mode = DynamicMode::kFull, .mask_delay = 2});
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].labels.label, b[k].labels.label);
    EXPECT_EQ(a[k].labels.weight, b[k].labels.weight);
    for (std::size_t i = 0; i < a[k].evidence.points.size(); ++i)
      EXPECT_EQ(a[k].evidence.points[i].epipolar_px, b[k].evidence.points[i].epipolar_px);
  }
}

}  // namespace
}  // namespace ygslam
