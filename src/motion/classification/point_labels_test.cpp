#include "motion/classification/point_labels.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/rng.hpp"

namespace ygslam {
namespace {

EpipolarCheck good_check() {
  EpipolarCheck check;
  check.state = CheckState::kDone;
  check.fit_quality = 1;
  return check;
}

PointEvidence evidence(SemanticLabel semantic, float distance_px) {
  PointEvidence e;
  e.semantic.label = semantic;
  e.epipolar_px = distance_px;
  return e;
}

PointLabels classify_one(DynamicMode mode, const PointEvidence& e, const EpipolarCheck& check) {
  ClassifierConfig config;
  config.min_static = 0;  // nothing comes back
  return classify(mode, std::vector{e}, check, {}, config);
}

TEST(PointLabels, ModesListenToTheirOwnEvidenceOnly) {
  const auto check = good_check();
  const auto masked = evidence(SemanticLabel::kMovable, 0.3F);
  const auto violator = evidence(SemanticLabel::kStatic, 4.0F);
  const auto label = [&](DynamicMode mode, const PointEvidence& e) {
    return classify_one(mode, e, check).label[0];
  };
  EXPECT_EQ(label(DynamicMode::kOff, masked), MotionLabel::kStatic);
  EXPECT_EQ(label(DynamicMode::kOff, violator), MotionLabel::kStatic);
  EXPECT_EQ(label(DynamicMode::kGeometry, masked), MotionLabel::kStatic);
  EXPECT_EQ(label(DynamicMode::kGeometry, violator), MotionLabel::kDynamic);
  EXPECT_EQ(label(DynamicMode::kSemantic, masked), MotionLabel::kDynamic);
  EXPECT_EQ(label(DynamicMode::kSemantic, violator), MotionLabel::kStatic);
  EXPECT_EQ(label(DynamicMode::kFull, masked), MotionLabel::kDynamic);
  EXPECT_EQ(label(DynamicMode::kFull, violator), MotionLabel::kDynamic);
}

TEST(PointLabels, PointsNobodyJudgedAreUnknown) {
  const auto e = evidence(SemanticLabel::kUnknown, -1);
  const auto labels = classify_one(DynamicMode::kFull, e, good_check());
  EXPECT_EQ(labels.label[0], MotionLabel::kUnknown);
  EXPECT_GT(labels.weight[0], 0);
  EXPECT_LT(labels.weight[0], 1);
}

TEST(PointLabels, AFitThatTheCandidatesDisagreeOnCountsLess) {
  const auto violator = evidence(SemanticLabel::kStatic, 4.0F);
  auto check = good_check();
  check.fit_quality = 0.1;
  const auto labels = classify_one(DynamicMode::kFull, violator, check);
  EXPECT_FALSE(labels.check_believed);
  EXPECT_EQ(labels.label[0], MotionLabel::kUnknown);
  EXPECT_GT(labels.weight[0], 0);
  EXPECT_LT(labels.weight[0], 0.6F);
}

TEST(PointLabels, WithoutNewEvidenceTheOldLabelHolds) {
  EpipolarCheck none;
  none.state = CheckState::kTooFewStatic;
  auto e = evidence(SemanticLabel::kUnknown, -1);
  e.previous = MotionLabel::kDynamic;
  EXPECT_EQ(classify_one(DynamicMode::kGeometry, e, none).label[0], MotionLabel::kDynamic);
  e.previous = MotionLabel::kStatic;
  EXPECT_EQ(classify_one(DynamicMode::kGeometry, e, none).label[0], MotionLabel::kStatic);
}

TEST(PointLabels, DynamicPointsComeBackOverUnknown) {
  auto e = evidence(SemanticLabel::kUnknown, 0.2F);
  e.previous = MotionLabel::kDynamic;
  const auto first = classify_one(DynamicMode::kGeometry, e, good_check());
  EXPECT_EQ(first.label[0], MotionLabel::kUnknown);
  e.previous = first.label[0];
  EXPECT_EQ(classify_one(DynamicMode::kGeometry, e, good_check()).label[0], MotionLabel::kStatic);
}

TEST(PointLabels, WhenEverythingIsMaskedTheLeastSuspiciousComeBack) {
  Rng rng(1);
  std::vector<PointEvidence> all;
  for (int i = 0; i < 300; ++i)
    all.push_back(evidence(SemanticLabel::kMovable,
                           i < 200 ? 0.1F : static_cast<float>(rng.uniform(1.5, 9))));
  ClassifierConfig config;
  const auto labels = classify(DynamicMode::kFull, all, good_check(), {}, config);
  EXPECT_TRUE(labels.too_few_static);
  EXPECT_EQ(labels.fallback_points, config.min_static);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (labels.weight[i] <= 0) continue;
    EXPECT_LT(i, 200U);  // those that obey the epipolar geometry
    EXPECT_EQ(labels.label[i], MotionLabel::kUnknown);
    EXPECT_GE(labels.weight[i], 0.1F);
    EXPECT_LE(labels.weight[i], 0.5F);
  }
  EXPECT_EQ(labels.dynamic_points, 300 - config.min_static);
}

TEST(PointLabels, OnlyWhatAMaskAloneExcludesComesBack) {
  std::vector<PointEvidence> all;
  for (int i = 0; i < 40; ++i) all.push_back(evidence(SemanticLabel::kStatic, 0.1F));
  for (int i = 0; i < 10; ++i) all.push_back(evidence(SemanticLabel::kMovable, 0.1F));
  for (int i = 0; i < 100; ++i) all.push_back(evidence(SemanticLabel::kStatic, 1.5F));
  const auto labels = classify(DynamicMode::kFull, all, good_check(), {}, {});
  EXPECT_TRUE(labels.too_few_static);
  EXPECT_EQ(labels.fallback_points, 10);
  for (int i = 0; i < 10; ++i) EXPECT_GT(labels.weight[40 + i], 0.0F);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(labels.weight[50 + i], 0.0F);
  EXPECT_EQ(labels.static_points, 40);
}

TEST(PointLabels, WhatMovesNeverComesBack) {
  const std::vector<PointEvidence> all(100, evidence(SemanticLabel::kMovable, 9.0F));
  const auto labels = classify(DynamicMode::kFull, all, good_check(), {}, {});
  EXPECT_TRUE(labels.too_few_static);
  EXPECT_EQ(labels.fallback_points, 0);
  EXPECT_EQ(labels.dynamic_points, 100);
}

TEST(PointLabels, EnoughStaticPointsNeedNoFallback) {
  std::vector<PointEvidence> all(200, evidence(SemanticLabel::kStatic, 0.1F));
  all.resize(250, evidence(SemanticLabel::kMovable, 0.1F));
  const auto labels = classify(DynamicMode::kFull, all, good_check(), {}, {});
  EXPECT_FALSE(labels.too_few_static);
  EXPECT_EQ(labels.fallback_points, 0);
  EXPECT_EQ(labels.static_points, 200);
  EXPECT_EQ(labels.dynamic_points, 50);
  EXPECT_EQ(labels.unknown_points, 0);
}

TEST(PointLabels, BoundaryPointsAreNoGroundToStandOn) {
  // Ten static points and a hundred that break the motion at a boundary: unknown, of no weight.
  std::vector<PointEvidence> evidence(110);
  for (std::size_t i = 10; i < evidence.size(); ++i) {
    evidence[i].ego_motion = {8, 8};
    evidence[i].on_boundary = true;
  }
  for (std::size_t i = 0; i < 10; ++i) evidence[i].ego_motion = {0.1F, 0.1F};
  const ClassifierConfig config;
  const PointLabels labels = classify(DynamicMode::kGeometry, evidence, {}, {}, config);
  EXPECT_EQ(labels.dynamic_points, 0);
  EXPECT_TRUE(labels.too_few_static);
  EXPECT_EQ(std::count_if(labels.weight.begin(), labels.weight.end(),
                          [](float weight) { return weight > 0; }),
            10);
}

TEST(PointLabels, WhatRestsComesBackBeforeWhatMoves) {
  ClassifierConfig config;
  config.min_static = 3;
  std::vector<PointEvidence> points(6, evidence(SemanticLabel::kMovable, 0.3F));
  for (std::size_t i = 3; i < 6; ++i) points[i].rests = true;
  const auto labels = classify(DynamicMode::kFull, points, good_check(), {}, config);
  EXPECT_TRUE(labels.too_few_static);
  EXPECT_EQ(labels.fallback_points, 3);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(labels.label[i], i < 3 ? MotionLabel::kDynamic : MotionLabel::kUnknown) << i;
    EXPECT_EQ(labels.weight[i] > 0, i >= 3) << i;
  }
  config.min_static = 0;
  for (const auto label : classify(DynamicMode::kFull, points, good_check(), {}, config).label)
    EXPECT_EQ(label, MotionLabel::kDynamic) << "as long as there are others it stays out";
}

TEST(PointLabels, FreeSpaceViolationsAreDynamicByGeometryAndNeverComeBack) {
  auto intruder = evidence(SemanticLabel::kStatic, 0.3F);
  intruder.in_free_space = true;
  for (const DynamicMode mode : {DynamicMode::kGeometry, DynamicMode::kFull}) {
    const auto labels =
        classify(mode, std::vector(5, intruder), good_check(), {}, ClassifierConfig{});
    EXPECT_TRUE(labels.too_few_static);
    EXPECT_EQ(labels.dynamic_points, 5);
  }
  EXPECT_EQ(classify_one(DynamicMode::kSemantic, intruder, good_check()).label[0],
            MotionLabel::kStatic);
}

}  // namespace
}  // namespace ygslam
