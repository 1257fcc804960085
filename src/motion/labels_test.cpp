#include "motion/labels.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/rng.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

std::vector<Feature> random_features(int n, double extent_px, Rng& rng) {
  std::vector<Feature> features(n);
  for (auto& f : features)
    f.uv_px = random_in_box<2>(rng, {0, 0}, {extent_px, extent_px}).cast<float>();
  return features;
}

std::vector<FlowEnd> random_ends(int n, double extent_px, Rng& rng) {
  std::vector<FlowEnd> ends;
  for (const Feature& f : random_features(n, extent_px, rng))
    ends.push_back({f.uv_px, rng.uniform() < 0.9});
  return ends;
}

TEST(FlowLinks, NearestIsTheNearestFlowEndWithinTheRadius) {
  Rng rng(3);
  const auto features = random_features(200, 80, rng);
  const auto ends = random_ends(200, 80, rng);
  const auto links = link_to_previous(features, ends, 2.0);
  for (std::size_t i = 0; i < features.size(); ++i) {
    float best = 2.0F;
    std::int32_t expected = -1;
    for (std::size_t k = 0; k < ends.size(); ++k) {
      const float d = (ends[k].uv_px - features[i].uv_px).norm();
      if (ends[k].found && d <= best) best = d, expected = static_cast<std::int32_t>(k);
    }
    EXPECT_EQ(links[i], expected);
  }
}

TEST(FlowLinks, FeaturesMayShareAnEnd) {
  std::vector<Feature> features(2);
  features[0].uv_px = {11.0F, 10.0F};
  features[1].uv_px = {10.2F, 10.0F};
  const std::vector<FlowEnd> ends{{{10.0F, 10.0F}, true}};
  EXPECT_EQ(link_to_previous(features, ends, 2.0), (std::vector<std::int32_t>{0, 0}));
}

TEST(FlowLinks, NoEndsOrNotFiniteOnesGiveNoLinks) {
  Rng rng(1);
  const auto features = random_features(10, 50, rng);
  EXPECT_EQ(link_to_previous(features, {}, 2.0), std::vector<std::int32_t>(10, -1));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<FlowEnd> ends(5, {{nan, nan}, true});
  EXPECT_EQ(link_to_previous(features, ends, 2.0), std::vector<std::int32_t>(10, -1));
  EXPECT_TRUE(link_to_previous({}, ends, 2.0).empty());
}

}  // namespace
}  // namespace ygslam
