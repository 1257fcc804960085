#include "motion/labels.hpp"

#include <algorithm>
#include <limits>

#include "motion/point_grid.hpp"

namespace ygslam {
namespace {

struct Candidate {
  float distance2_px2;
  std::uint32_t current;
  std::uint32_t previous;
};

/// All (current, previous) pairs within the radius, nearest first, ties by index.
std::vector<Candidate> candidates(std::span<const Feature> current, std::span<const FlowEnd> ends,
                                  double radius_px) {
  std::vector<Eigen::Vector2f> points(ends.size());
  for (std::size_t i = 0; i < ends.size(); ++i) {
    points[i] = ends[i].found ? ends[i].uv_px
                              : Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN());
  }
  PointGrid grid(std::max(radius_px, 8.0));
  grid.build(points);
  const auto limit2 = static_cast<float>(radius_px * radius_px);
  std::vector<Candidate> pairs;
  for (std::size_t i = 0; i < current.size(); ++i) {
    grid.near(current[i].uv_px, radius_px, [&](std::uint32_t k) {
      const float d2 = (points[k] - current[i].uv_px).squaredNorm();
      if (d2 <= limit2) pairs.push_back({d2, static_cast<std::uint32_t>(i), k});
    });
  }
  std::sort(pairs.begin(), pairs.end(), [](const Candidate& a, const Candidate& b) {
    if (a.distance2_px2 != b.distance2_px2) return a.distance2_px2 < b.distance2_px2;
    return a.current != b.current ? a.current < b.current : a.previous < b.previous;
  });
  return pairs;
}

}  // namespace

FlowLinks link_flow(std::span<const Feature> current, std::span<const FlowEnd> ends,
                    double radius_px) {
  FlowLinks links;
  links.nearest.assign(current.size(), -1);
  links.unique.assign(current.size(), -1);
  std::vector<std::uint8_t> taken(ends.size(), 0);
  for (const Candidate& pair : candidates(current, ends, radius_px)) {
    const auto previous = static_cast<std::int32_t>(pair.previous);
    if (links.nearest[pair.current] < 0) links.nearest[pair.current] = previous;
    if (links.unique[pair.current] >= 0 || taken[pair.previous]) continue;
    links.unique[pair.current] = previous;
    taken[pair.previous] = 1;
  }
  return links;
}

std::vector<std::int32_t> link_to_previous(std::span<const Feature> current,
                                           std::span<const FlowEnd> ends, double radius_px) {
  return link_flow(current, ends, radius_px).unique;
}

}  // namespace ygslam
