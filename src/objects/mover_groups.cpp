#include "objects/mover_groups.hpp"

#include <cmath>
#include <utility>

#include "objects/object_frame.hpp"

namespace ygslam {
namespace {

constexpr float kRadius_px = 25;
constexpr float kDepthRatio = 0.08F;

bool are_near(const ObjectPoint& a, const ObjectPoint& b) {
  if (!((a.uv_px - b.uv_px).squaredNorm() <= kRadius_px * kRadius_px)) return false;
  if (!(a.depth_m > 0) || !(b.depth_m > 0)) return true;
  return std::abs(a.depth_m - b.depth_m) <= kDepthRatio * std::max(a.depth_m, b.depth_m);
}

}  // namespace

std::vector<std::vector<std::uint32_t>> connected_groups(std::span<const ObjectPoint> points,
                                                         std::span<const std::uint32_t> members) {
  std::vector<std::uint32_t> left(members.begin(), members.end());
  std::vector<std::vector<std::uint32_t>> groups;
  while (!left.empty()) {
    std::vector<std::uint32_t> group{left.back()};
    left.pop_back();
    for (std::size_t next = 0; next < group.size(); ++next) {
      const ObjectPoint& from = points[group[next]];
      std::erase_if(left, [&](std::uint32_t i) {
        if (!are_near(from, points[i])) return false;
        group.push_back(i);
        return true;
      });
    }
    groups.push_back(std::move(group));
  }
  return groups;
}

}  // namespace ygslam
