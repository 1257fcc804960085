#include "eval/object_score.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "core/rng.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

using Eigen::Vector3d;

UprightBox random_box(Rng& rng) {
  const auto between = [&](double low, double high) { return rng.uniform(low, high); };
  return {{between(-0.3, 0.3), between(-0.3, 0.3), between(-0.3, 0.3)},
          {between(0.2, 1), between(0.2, 1), between(0.2, 1)},
          between(-4, 4)};
}

bool contains(const UprightBox& box, const Vector3d& p) {
  const Vector3d q =
      Eigen::AngleAxisd(-box.yaw_rad, Vector3d::UnitZ()) * Vector3d(p - box.centre_m);
  return (q.cwiseAbs().array() <= box.size_m.array() / 2).all();
}

TEST(BoxIou, IsOneWithItselfAndTheSameBothWaysAndForAQuarterTurn) {
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    const UprightBox a = random_box(rng), b = random_box(rng);
    EXPECT_NEAR(box_iou(a, a), 1, 1e-9);
    EXPECT_NEAR(box_iou(a, b), box_iou(b, a), 1e-9);
    UprightBox turned = a;
    turned.yaw_rad += std::numbers::pi / 2;
    std::swap(turned.size_m.x(), turned.size_m.y());
    EXPECT_NEAR(box_iou(turned, b), box_iou(a, b), 1e-9);
    UprightBox far = b;
    far.centre_m.x() += 4;
    EXPECT_EQ(box_iou(a, far), 0);
  }
}

TEST(BoxIou, IsWhatRandomPointsSay) {
  Rng rng(2);
  for (int i = 0; i < 30; ++i) {
    const UprightBox a = random_box(rng), b = random_box(rng);
    int both = 0, either = 0;
    for (int k = 0; k < 20000; ++k) {
      const Vector3d p = random_in_box<3>(rng, {-1.1, -1.1, -0.9}, {1.1, 1.1, 0.9});
      const bool in_a = contains(a, p), in_b = contains(b, p);
      both += in_a && in_b ? 1 : 0;
      either += in_a || in_b ? 1 : 0;
    }
    EXPECT_NEAR(box_iou(a, b), static_cast<double>(both) / either, 0.03);
  }
}

const UprightBox kChairBox{{0, 0, 0.5}, {0.5, 0.5, 1}, 0.3};
const UprightBox kTableBox{{2, 0, 0.4}, {1.5, 0.8, 0.8}, 0};

TEST(ObjectScore, OfTheTruthItselfIsPerfect) {
  const TrueObject truth[] = {{"chair", kChairBox, 20}, {"dining table", kTableBox, 20}};
  const FoundObject found[] = {{"dining table", kTableBox}, {"chair", kChairBox}};
  const ObjectScore score = score_objects(found, truth);
  EXPECT_EQ(score.f1(), 1);
  EXPECT_EQ(score.f1_of_class(), 1);
  EXPECT_EQ(score.duplicates, 0);
  EXPECT_NEAR(score.centre_error_m, 0, 1e-12);
  EXPECT_NEAR(score.size_error, 0, 1e-12);
}

TEST(ObjectScore, CountsWhatIsMissedMadeUpDoubleAndMisnamed) {
  UprightBox beside = kTableBox;
  beside.centre_m.y() += 0.1;
  UprightBox part = kChairBox;
  part.size_m = {0.2, 0.2, 0.2};
  const TrueObject truth[] = {{"chair", kChairBox, 20},
                              {"dining table", kTableBox, 20},
                              {"tv", {{0, 5, 1}, {0.5, 0.1, 0.3}, 0}, 20}};
  const FoundObject found[] = {{"chair", kChairBox},
                               {"couch", beside},                             // misnamed
                               {"chair", part},                               // double
                               {"refrigerator", {{5, 5, 1}, {1, 1, 2}, 0}}};  // made up
  const ObjectScore score = score_objects(found, truth);
  EXPECT_EQ(score.found, 4);
  EXPECT_EQ(score.matched, 2);
  EXPECT_EQ(score.right_class, 1);
  EXPECT_EQ(score.duplicates, 1);
  EXPECT_DOUBLE_EQ(score.precision(), 0.5);
  EXPECT_DOUBLE_EQ(score.recall(), 2.0 / 3);
  EXPECT_DOUBLE_EQ(score.f1(), 4.0 / 7);
  EXPECT_DOUBLE_EQ(score.f1_of_class(), 2.0 / 7);
  EXPECT_NEAR(score.centre_error_m, 0.05, 1e-9);
}

TEST(ObjectScore, WhatNeedNotBeFoundCountsNeitherWay) {
  const UprightBox shelf{{0, 3, 1}, {1.2, 0.2, 0.3}, 0}, book{{0.3, 3, 1}, {0.04, 0.2, 0.25}, 0};
  const TrueObject truth[] = {{"chair", kChairBox, 14}, {"book", shelf, 99, true}};
  const FoundObject found[] = {{"chair", kChairBox}, {"book", book}, {"book", shelf}};
  const ObjectScore score = score_objects(found, truth);
  EXPECT_EQ(score.truths, 0);
  EXPECT_EQ(score.found, 0);
  EXPECT_EQ(score.f1(), 0);
  const ObjectScore nothing = score_objects({}, truth);
  EXPECT_EQ(nothing.found + nothing.truths, 0);
}

TEST(ObjectScore, PairsForTheGreatestNumberAndPrefersTheClass) {
  UprightBox left = kChairBox, right = kChairBox;
  left.centre_m.x() -= 0.15;
  right.centre_m.x() += 0.1;
  const TrueObject truth[] = {{"chair", left, 20}, {"chair", right, 20}};
  const FoundObject found[] = {{"chair", kChairBox}, {"chair", right}};
  EXPECT_EQ(score_objects(found, truth).matched, 2);
  const TrueObject same[] = {{"cup", kChairBox, 20}, {"chair", kChairBox, 20}};
  const FoundObject one[] = {{"chair", kChairBox}};
  EXPECT_EQ(score_objects(one, same).right_class, 1);
}

TEST(ObjectScore, SizesAreComparedAlongTheSameSides) {
  UprightBox turned = kTableBox;
  turned.yaw_rad = std::numbers::pi / 2;
  std::swap(turned.size_m.x(), turned.size_m.y());
  turned.size_m.z() *= 1.1;
  const TrueObject truth[] = {{"dining table", kTableBox, 20}};
  const FoundObject found[] = {{"dining table", turned}};
  EXPECT_NEAR(score_objects(found, truth).size_error, 0.1 / 3, 1e-9);
}

}  // namespace
}  // namespace ygslam
