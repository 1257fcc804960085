// Features that go on from frame to frame, by views of a painted wall.
#include "tracking/feature_follower.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "tracking/tracking_test_world.hpp"

namespace ygslam {
namespace {

using tracking_test::few_features;
using tracking_test::PaintedWall;

/// Looks at a frame as the tracker does, without a pose.
class FeatureFollowerTest : public ::testing::Test {
 protected:
  FrameFeatures look(const PaintedWall::View& view, const PixelMaskPtr& mask = nullptr) {
    const FramePtr frame = wall_.see(number_++, view);
    FrameFlow flow = classifier_.follow(*frame, std::nullopt);
    auto seen = follower_->step({frame, flow, mask});
    if (!seen) {
      seen = extract_features(orb_, camera_, frame, mask);
      follower_->start(*seen->features);
    }
    auto evidence = classifier_.observe(*frame, seen->features, std::move(flow),
                                        seen->followed_from, {}, std::nullopt);
    const PointLabels labels = classifier_.classify(evidence);
    classifier_.remember(std::move(evidence), labels.label);
    return *std::move(seen);
  }
  static DynamicConfig geometry() {
    DynamicConfig config;
    config.mode = DynamicMode::kGeometry;
    return config;
  }

  Camera camera_{PaintedWall::camera()};
  PaintedWall wall_{7};
  OrbExtractor orb_{few_features()};
  PointClassifier classifier_{geometry(), camera_, 0};
  std::optional<FeatureFollower> follower_{std::in_place, FollowConfig{3}, camera_, orb_.scales()};
  int number_ = 0;
};

TEST_F(FeatureFollowerTest, GoOnWithTheirPointsForSoManyFrames) {
  constexpr int kPerFrame_px = 2;
  FrameFeatures last = look({});
  EXPECT_FALSE(last.is_followed());
  const std::size_t found = last.features->size();
  for (int i = 1; i <= 3; ++i) {
    FrameFeatures now = look({.left_px = i * kPerFrame_px});
    ASSERT_TRUE(now.is_followed()) << i;
    EXPECT_GT(now.features->size(), 0.85 * static_cast<double>(found));
    EXPECT_EQ(now.grid.size(), now.features->size());
    int right = 0;
    for (std::size_t k = 0; k < now.features->size(); ++k) {
      const auto before = static_cast<std::size_t>(now.followed_from[k]);
      const Eigen::Vector2f shift_px =
          now.features->points[k].uv_px - last.features->points[before].uv_px;
      right += (shift_px - Eigen::Vector2f(-kPerFrame_px, 0)).norm() < 0.3F ? 1 : 0;
      EXPECT_EQ(now.features->descriptors[k], last.features->descriptors[before]);
      EXPECT_EQ(now.features->points[k].octave, last.features->points[before].octave);
      EXPECT_NEAR(now.features->points[k].depth_m, PaintedWall::kDistance_m, 1e-3);
    }
    EXPECT_GT(right, 0.9 * static_cast<double>(now.features->size())) << i;
    last = std::move(now);
  }
  EXPECT_FALSE(look({.left_px = 4 * kPerFrame_px}).is_followed()) << "a fourth one";
  EXPECT_TRUE(look({.left_px = 5 * kPerFrame_px}).is_followed());
}

TEST_F(FeatureFollowerTest, AreLookedForOnDemand) {
  (void)look({});
  ASSERT_TRUE(look({}).is_followed());
  follower_->renew();
  EXPECT_FALSE(look({}).is_followed());
  EXPECT_TRUE(look({}).is_followed());
}

TEST_F(FeatureFollowerTest, AreLookedForWhereTheyThinOut) {
  (void)look({});
  EXPECT_FALSE(look({.painted_px = PaintedWall::kWidth_px / 2}).is_followed());
}

TEST_F(FeatureFollowerTest, NoneGoOnToWhatIsMasked) {
  (void)look({});
  auto mask = std::make_shared<GreyImage>(PaintedWall::kWidth_px, PaintedWall::kHeight_px);
  constexpr int kMasked_px = 40;
  for (int v = 0; v < PaintedWall::kHeight_px; ++v)
    std::fill_n(mask->row(v), kMasked_px, std::uint8_t{255});
  const FrameFeatures seen = look({}, mask);
  ASSERT_TRUE(seen.is_followed());
  for (const Feature& f : seen.features->points) EXPECT_GT(f.uv_px.x(), kMasked_px - 1);
}

TEST_F(FeatureFollowerTest, WithoutFramesToFollowNothingGoesOn) {
  follower_.emplace(FollowConfig{}, camera_, orb_.scales());
  (void)look({});
  EXPECT_FALSE(look({}).is_followed());
}

}  // namespace
}  // namespace ygslam
