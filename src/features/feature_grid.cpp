#include "features/feature_grid.hpp"

#include "core/check.hpp"

namespace ygslam {

FeatureGrid::FeatureGrid(const Features& features, const std::array<double, 4>& bounds) {
  std::vector<Eigen::Vector2f> points;
  points.reserve(features.size());
  for (const Feature& f : features.points) {
    CHECK(f.ideal_px.allFinite());
    points.push_back(f.ideal_px);
  }
  cells_.build(points, Eigen::Vector2d(bounds[0], bounds[1]).cast<float>());
  entries_.reserve(points.size());
  for (const std::uint32_t i : cells_.order()) {
    entries_.push_back({points[i].x(), points[i].y(), i, features.points[i].octave});
  }
}

void FeatureGrid::in_radius(const Eigen::Vector2f& centre_px, float radius_px, int min_octave,
                            int max_octave, std::vector<std::uint32_t>& found) const {
  found.clear();
  visit(centre_px, radius_px, min_octave, max_octave,
        [&](std::uint32_t index) { found.push_back(index); });
}

}  // namespace ygslam
