#include "system/dense_marks.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace ygslam {
namespace {

/// Two bottles before a wall, 1.5 m away, and a person on the right.
class DenseMarks : public ::testing::Test {
 protected:
  DenseMarks() {
    auto frame = std::make_shared<RgbdFrame>();
    frame->depth_m = DepthImage(160, 120, 1.5F);
    dense_.frame = frame;
    masks_.ids = GreyImage(160, 120);
    const auto show = [&](int class_id, int left, int right) {
      Instance instance;
      instance.class_id = class_id;
      instance.score = 0.5F;
      masks_.instances.push_back(instance);
      for (int v = 40; v < 80; ++v)
        for (int u = left; u < right; ++u)
          masks_.ids.at(u, v) = static_cast<std::uint8_t>(masks_.instances.size());
    };
    show(39, 20, 30);
    show(0, 120, 150);
    show(39, 60, 70);
  }
  void add_point(float u, float v, MotionLabel label) {
    Feature point;
    point.uv_px = {u, v};
    point.depth_m = 1.5F;
    features_.points.push_back(point);
    labels_.push_back(label);
  }
  void mark() { mark_movers_and_things(&masks_, features_, labels_, MovableClasses(), dense_); }

  Segmentation masks_;
  Features features_;
  std::vector<MotionLabel> labels_;
  DenseFrame dense_;
};

TEST_F(DenseMarks, PersonsAreMoversAndBottlesThings) {
  mark();
  ASSERT_EQ(dense_.detections.size(), 2U);
  EXPECT_EQ(dense_.detections[0].semantic_class, coco_class(39));
  EXPECT_EQ(dense_.things.at(25, 60), 1);
  EXPECT_EQ(dense_.things.at(65, 60), 2);
  EXPECT_EQ(dense_.things.at(135, 60), 0);
  EXPECT_EQ(dense_.movers.at(135, 60), 255);
  EXPECT_EQ(dense_.movers.at(25, 60), 0);
  EXPECT_EQ(dense_.motion_votes, (std::vector<MotionVotes>(2)));
}

TEST_F(DenseMarks, PointsVoteOnTheMotionOfTheThingTheyLieOn) {
  add_point(25, 50, MotionLabel::kDynamic);
  add_point(25, 60, MotionLabel::kStatic);
  add_point(25, 70, MotionLabel::kStatic);
  add_point(25, 75, MotionLabel::kUnknown);
  add_point(65, 50, MotionLabel::kDynamic);
  add_point(65.4F, 60.4F, MotionLabel::kDynamic);
  add_point(100, 60, MotionLabel::kDynamic);  // on the wall
  mark();
  EXPECT_EQ(dense_.motion_votes, (std::vector<MotionVotes>{{1, 2}, {2, 0}}));
  const auto moving = moving_detections(dense_.things, dense_.movers, 2, dense_.motion_votes);
  EXPECT_EQ(moving, (std::vector{false, true}));
  EXPECT_EQ(moving_detections(dense_.things, dense_.movers, 2, {}), (std::vector{true, true}))
      << "the pixels alone would tell otherwise";
}

TEST_F(DenseMarks, OnlyWhatIsAsFarAwayAsAPointThatMovesIsMarked) {
  auto frame = std::make_shared<RgbdFrame>(*dense_.frame);
  for (int v = 0; v < 120; ++v) frame->depth_m.at(101, v) = 2.5F;
  dense_.frame = frame;
  add_point(100, 60, MotionLabel::kDynamic);
  mark();
  EXPECT_EQ(dense_.movers.at(100, 60), 255);
  EXPECT_EQ(dense_.movers.at(102, 60), 255);
  EXPECT_EQ(dense_.movers.at(101, 60), 0);
  EXPECT_EQ(dense_.movers.at(100, 90), 0);
}

TEST_F(DenseMarks, WithoutMasksThereIsNoThing) {
  add_point(25, 60, MotionLabel::kDynamic);
  mark_movers_and_things(nullptr, features_, labels_, {}, dense_);
  EXPECT_TRUE(dense_.things.empty());
  EXPECT_TRUE(dense_.detections.empty());
  EXPECT_TRUE(dense_.motion_votes.empty());
  EXPECT_EQ(dense_.movers.at(25, 60), 255);
}

}  // namespace
}  // namespace ygslam
