#include "dense/view_intake.hpp"

#include <gtest/gtest.h>

#include "dense/scene_naming/object_test_world.hpp"

namespace ygslam {
namespace {

using object_test::kChair;
using object_test::kScreen;

class ViewIntake : public ::testing::Test {
 protected:
  ViewIntake()
      : frame_(object_test::keyframe_of(object_test::two_boxes(), camera_, 0,
                                        object_test::view_pose(3),
                                        {{kChair, 0.8F}, {kScreen, 0.6F}})) {
    frame_.movers = GreyImage(camera_.width(), camera_.height());
  }
  [[nodiscard]] IncomingView taken_in() const { return incoming_view(frame_, config_, camera_); }
  [[nodiscard]] bool shows(std::size_t pixel, std::uint8_t number) const {
    return frame_.things.begin()[pixel] == number;
  }
  /// Marks every other pixel of a detection as moving.
  void let_move(std::uint8_t number) {
    for (std::size_t i = 0; i < frame_.movers.size(); i += 2)
      if (shows(i, number)) frame_.movers.begin()[i] = 255;
  }

  Camera camera_ = object_test::room_camera();
  DenseMapConfig config_;
  DenseFrame frame_;
};

TEST_F(ViewIntake, EveryDetectionIsAnObservationWithItsSurface) {
  const IncomingView view = taken_in();
  ASSERT_EQ(view.observations.size(), 2U);
  EXPECT_EQ(view.observations[0].detection.semantic_class, kChair);
  EXPECT_EQ(view.observations[1].detection.semantic_class, kScreen);
  for (const ObjectObservation& observation : view.observations) {
    EXPECT_GT(observation.p_camera.size(), 100U);
    EXPECT_FALSE(observation.is_moving);
  }
  for (std::size_t i = 0; i < view.images.object.size(); ++i) {
    const std::uint8_t object = view.images.object.begin()[i];
    if (!DepthView::is_object(object)) continue;
    const auto number = static_cast<std::uint8_t>(view.images.objects[object - 1U]);
    ASSERT_TRUE(shows(i, number));
  }
}

TEST_F(ViewIntake, MoversAreExcludedWithAMargin) {
  frame_.movers.at(20, 30) = 255;
  const IncomingView view = taken_in();
  for (int v = 0; v < camera_.height(); ++v) {
    for (int u = 0; u < camera_.width(); ++u) {
      const bool near = std::max(std::abs(u - 20), std::abs(v - 30)) <= config_.margin_px;
      ASSERT_EQ(view.images.object.at(u, v) == DepthView::kExcluded, near) << u << ' ' << v;
    }
  }
}

TEST_F(ViewIntake, AnObjectThatMovesIsObservedButAddsNoSurface) {
  let_move(1);
  const IncomingView view = taken_in();
  EXPECT_TRUE(view.observations[0].is_moving);
  EXPECT_FALSE(view.observations[0].p_camera.empty()) << "where it is now is known";
  EXPECT_FALSE(view.observations[1].is_moving);
  int kept = 0;
  for (std::size_t i = 0; i < view.images.object.size(); ++i) {
    const std::uint8_t object = view.images.object.begin()[i];
    if (shows(i, 1)) {
      ASSERT_EQ(object, DepthView::kExcluded);
    }
    kept += shows(i, 2) && DepthView::is_object(object) ? 1 : 0;
  }
  EXPECT_GT(kept, 500) << "the other stays, though it is near";
}

TEST_F(ViewIntake, PointsThatStandOutvoteMarkedPixels) {
  let_move(1);
  frame_.motion_votes = {{1, 3}, {0, 0}};
  EXPECT_FALSE(taken_in().observations[0].is_moving);
  frame_.motion_votes = {{3, 1}, {0, 0}};
  EXPECT_TRUE(taken_in().observations[0].is_moving);
}

TEST_F(ViewIntake, WithoutMasksAllIsRoom) {
  frame_.things = {};
  frame_.detections = {};
  const IncomingView view = taken_in();
  EXPECT_TRUE(view.observations.empty());
  EXPECT_TRUE(view.images.objects.empty());
  for (const std::uint8_t object : view.images.object) ASSERT_EQ(object, DepthView::kNothing);
}

TEST_F(ViewIntake, TheSameFrameGivesTheSameView) {
  frame_.edge_px = 2;
  let_move(2);
  const IncomingView a = taken_in(), b = taken_in();
  EXPECT_TRUE(std::equal(a.images.depth.begin(), a.images.depth.end(), b.images.depth.begin()));
  EXPECT_TRUE(std::equal(a.images.object.begin(), a.images.object.end(), b.images.object.begin()));
  EXPECT_EQ(a.images.objects, b.images.objects);
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_EQ(a.observations[i].p_camera, b.observations[i].p_camera);
}

}  // namespace
}  // namespace ygslam
