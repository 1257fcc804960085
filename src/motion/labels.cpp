#include "motion/labels.hpp"

#include <algorithm>
#include <limits>

#include "image/point_grid.hpp"

namespace ygslam {

std::vector<std::int32_t> link_to_previous(std::span<const Feature> current,
                                           std::span<const FlowEnd> ends, double radius_px) {
  std::vector<Eigen::Vector2f> points(ends.size());
  for (std::size_t i = 0; i < ends.size(); ++i) {
    points[i] = ends[i].found ? ends[i].uv_px
                              : Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN());
  }
  PointGrid grid(std::max(radius_px, 8.0));
  grid.build(points);
  std::vector<std::int32_t> links(current.size(), -1);
  for (std::size_t i = 0; i < current.size(); ++i) {
    auto nearest2 = static_cast<float>(radius_px * radius_px);
    grid.near(current[i].uv_px, radius_px, [&](std::uint32_t k) {
      const float d2 = (points[k] - current[i].uv_px).squaredNorm();
      const auto candidate = static_cast<std::int32_t>(k);
      if (d2 > nearest2 || (d2 == nearest2 && links[i] >= 0 && links[i] < candidate)) return;
      nearest2 = d2;
      links[i] = candidate;
    });
  }
  return links;
}

}  // namespace ygslam
