// Frames that something fixed to the camera had misled, placed again without it.
#include "tracking/retracker.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tracking/point_test_world.hpp"

namespace ygslam {
namespace {

using map_test::World;
using tracking_test::features_of;
using tracking_test::PointScene;
using tracking_test::pose_error;

constexpr int kFrames = 20;           // that were misled
constexpr int kLeftColumns_px = 250;  // what is masked
constexpr int kMostWait = 15;         // frames, until the first are placed again

class RetrackerTest : public ::testing::Test {
 protected:
  /// The camera goes from the place of one keyframe to that of the next.
  static SE3 true_pose(int i) {
    const SE3 T_moved = World::pose(6) * World::pose(5).inverse();
    return SE3::exp(T_moved.log() * (static_cast<double>(i) / kFrames)) * World::pose(5);
  }
  /// What is fixed to the camera keeps its pixels and was taken for the world, which the labels
  /// then say moves. @param T_believed where the tracker took the camera to be.
  TrackedFrame frame(int i, const SE3& T_believed) {
    const auto seen = scene_.world.see(true_pose(i), static_cast<std::uint32_t>(100 + i));
    auto features = std::make_shared<Features>(*seen.features);
    TrackedFrame frame{features_of(seen), {}, {}, {}, {}};
    for (std::size_t k = 0; k < seen.point.size(); ++k) {
      const auto point = static_cast<std::size_t>(seen.point[k]);
      frame.landmarks.push_back(scene_.truth.landmark[point]);
      Feature& feature = features->points[k];
      frame.seen.static_weight[k] = feature.uv_px.x() < kLeftColumns_px ? 1 : 0;
      if (feature.uv_px.x() >= kLeftColumns_px) continue;
      const Vec3 p_first = true_pose(0) * scene_.world.points()[point].p_world;
      feature.ideal_px = scene_.world.camera().project(p_first).cast<float>();
    }
    if (i == blind_)
      for (Feature& feature : features->points) feature.uv_px.x() = 1;
    frame.seen.grid = FeatureGrid(*features, scene_.world.camera().ideal_bounds());
    frame.seen.features = std::move(features);
    frame.pose = {kReference, T_believed * scene_.view.pose_of(kReference)->inverse()};
    return frame;
  }
  [[nodiscard]] PixelMaskPtr mask() const {
    auto mask =
        std::make_shared<GreyImage>(scene_.world.camera().width(), scene_.world.camera().height());
    for (int v = 0; v < mask->height(); ++v) std::fill_n(mask->row(v), masked_columns_, 255);
    return mask;
  }
  /// Frames that were all believed to stand where the first did, then the mask, with frames of the
  /// true place.
  void see_all() {
    for (int i = 0; i < kFrames; ++i) {
      retracker_.add(frame(i, true_pose(0)), nullptr);
      EXPECT_TRUE(retracker_.step(scene_.view, true, rng_).empty()) << "nothing is known yet";
    }
    for (int i = 0; i < kMostWait + kFrames; ++i) {
      retracker_.add(frame(kFrames, true_pose(kFrames)), i == 0 ? mask() : nullptr);
      for (const RetrackedFrame& again : retracker_.step(scene_.view, is_sure_, rng_))
        again_[again.frame] = again.pose;
    }
  }
  [[nodiscard]] bool is_placed_again(int i) const { return again_.contains(id(i)); }
  [[nodiscard]] static FrameId id(int i) { return FrameId{static_cast<std::uint32_t>(100 + i)}; }
  [[nodiscard]] double error_m(const KeyframeRelativePose& pose, int i) const {
    return pose_error(pose.T_camera_reference * *scene_.view.pose_of(pose.reference), true_pose(i));
  }

  static constexpr KeyframeId kReference{5};
  PointScene scene_{1};
  Retracker retracker_{scene_.estimator, 30};
  Rng rng_{1};
  bool is_sure_ = true;
  int blind_ = -1;  // a frame that shows nothing but what is masked
  int masked_columns_ = kLeftColumns_px;
  std::map<FrameId, KeyframeRelativePose> again_;
};

TEST_F(RetrackerTest, MisledFramesAreFoundWhereTheyWere) {
  see_all();
  for (int i = 0; i < kFrames; ++i) {
    ASSERT_TRUE(is_placed_again(i)) << i;
    EXPECT_LT(error_m(again_.at(id(i)), i), 0.003) << i;
  }
  EXPECT_GT(pose_error(true_pose(0), true_pose(kFrames)), 0.02) << "the camera moved";
}

TEST_F(RetrackerTest, NothingIsPlacedByACameraThatIsNotSure) {
  is_sure_ = false;
  see_all();
  EXPECT_TRUE(again_.empty());
}

TEST_F(RetrackerTest, AFrameThatShowsNothingElseEndsIt) {
  blind_ = 8;
  see_all();
  for (int i = 0; i < kFrames; ++i) EXPECT_EQ(is_placed_again(i), i > blind_) << i;
}

TEST_F(RetrackerTest, AMaskTooSmallToMisleadChangesNothing) {
  masked_columns_ = 2;
  see_all();
  EXPECT_TRUE(again_.empty());
}

}  // namespace
}  // namespace ygslam
