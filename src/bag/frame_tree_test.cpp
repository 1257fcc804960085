#include "bag/frame_tree.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace ygslam {
namespace {

ros::TransformStamped transform(const std::string& parent, const std::string& child, double x_m) {
  ros::TransformStamped t;
  t.header.frame_id = parent;
  t.child_frame_id = child;
  t.transform.position.x = x_m;
  return t;
}

const BagTopic kStatic{"/tf_static", "tf2_msgs/TFMessage", Layout::kCdr};
const BagTopic kMoving{"/tf", "tf2_msgs/TFMessage", Layout::kCdr};

void take(FrameTree& tree, const BagTopic& topic, std::vector<ros::TransformStamped> transforms) {
  tree.take(topic, to_cdr(ros::TfMessage{std::move(transforms)}));
}

double x_of(const FrameTree& tree, const std::string& target, const std::string& source) {
  const auto T = tree.T_target_source(target, source);
  return T.ok() ? T->t().x() : NAN;
}

TEST(FrameTree, ConnectsFramesOverTheirAncestor) {
  FrameTree tree;
  take(tree, kStatic,
       {transform("link", "colour_frame", 0.015), transform("link", "depth", 0.001)});
  take(tree, kStatic, {transform("/colour_frame", "/colour", 0.1)});
  EXPECT_NEAR(x_of(tree, "colour", "depth"), 0.001 - 0.115, 1e-12);
  EXPECT_NEAR(x_of(tree, "/depth", "colour"), 0.114, 1e-12);
  EXPECT_NEAR(x_of(tree, "link", "colour"), 0.115, 1e-12);
  EXPECT_EQ(x_of(tree, "depth", "depth"), 0);
  EXPECT_TRUE(std::isnan(x_of(tree, "colour", "elsewhere")));
}

TEST(FrameTree, StaticGoesBeforeWhatMayMove) {
  FrameTree tree;
  take(tree, kMoving, {transform("link", "depth", 1)});
  take(tree, kMoving, {transform("link", "depth", 2)});
  EXPECT_EQ(x_of(tree, "link", "depth"), 1) << "the first stays";
  take(tree, kStatic, {transform("link", "depth", 3)});
  take(tree, kMoving, {transform("link", "depth", 4)});
  EXPECT_EQ(x_of(tree, "link", "depth"), 3);
}

TEST(FrameTree, WhatMayMoveTellsNoPlaceThatStays) {
  FrameTree tree;
  take(tree, kStatic, {transform("head", "camera", 1), transform("head", "imu", 2)});
  take(tree, kMoving, {transform("base", "head", 4)});
  const auto still = [&](const std::string& target) {
    return tree.T_target_source(target, "camera", FrameTree::Trust::kStatic);
  };
  EXPECT_EQ(x_of(tree, "base", "camera"), 5);
  ASSERT_FALSE(still("base").ok());
  EXPECT_EQ(still("base").error().message, "no transform between them on /tf_static");
  ASSERT_TRUE(still("imu").ok());
  EXPECT_EQ(still("imu")->t().x(), -1);
}

TEST(FrameTree, HostileTransformsEndNowhere) {
  FrameTree tree;
  take(tree, kStatic, {transform("a", "b", 1), transform("b", "a", 1)});  // in a circle
  EXPECT_TRUE(std::isnan(x_of(tree, "a", "c")));
  auto bad = transform("a", "d", NAN);
  auto zero = transform("a", "e", 1);
  zero.transform.orientation.w = 0;
  take(tree, kStatic, {bad, zero});
  EXPECT_TRUE(std::isnan(x_of(tree, "a", "d")));
  EXPECT_TRUE(std::isnan(x_of(tree, "a", "e")));
  tree.take(kStatic, Bytes{0, 1, 0, 0, 255, 255, 255, 255});
}

TEST(FrameTree, SaysWhereItsLimitsAreWhyNothingIsFound) {
  const auto missing = [](const FrameTree& tree, const std::string& target) {
    return tree.T_target_source(target, "colour").error().message;
  };
  FrameTree small;
  take(small, kStatic, {transform("link", "colour", 1)});
  EXPECT_EQ(missing(small, "depth"), "no transform between them");
  FrameTree wide;
  std::vector<ros::TransformStamped> many;
  for (int i = 0; i < 10'000; ++i) many.push_back(transform("link", "f" + std::to_string(i), 1));
  many.push_back(transform("link", "colour", 1));
  take(wide, kStatic, many);
  EXPECT_EQ(missing(wide, "f0"), "no transform between them among the first 10000 frames");
  FrameTree deep;
  std::vector<ros::TransformStamped> chain = {transform("f0", "colour", 1)};
  for (int i = 0; i < 62; ++i)
    chain.push_back(transform("f" + std::to_string(i + 1), "f" + std::to_string(i), 1));
  take(deep, kStatic, chain);
  EXPECT_EQ(x_of(deep, "f62", "colour"), 63) << "64 frames, the first among them";
  take(deep, kStatic, {transform("f63", "f62", 1)});
  EXPECT_EQ(missing(deep, "f63"), "no transform between them in a chain of up to 64");
}

}  // namespace
}  // namespace ygslam
