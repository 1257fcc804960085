#include "eval/dynamic_score.hpp"

#include <cmath>

#include "core/check.hpp"

namespace ygslam {
namespace {

double share(std::size_t part, std::size_t rest) {
  return part + rest == 0 ? 1.0 : static_cast<double>(part) / static_cast<double>(part + rest);
}

/// Another instance, or none, within kEdge_px of a pixel.
bool at_edge(const GreyImage& ids, int u, int v) {
  const std::uint8_t own = ids.at(u, v);
  for (int dv = -kEdge_px; dv <= kEdge_px; ++dv) {
    for (int du = -kEdge_px; du <= kEdge_px; ++du) {
      if (du * du + dv * dv > kEdge_px * kEdge_px || !ids.contains(u + du, v + dv)) continue;
      if (ids.at(u + du, v + dv) != own) return true;
    }
  }
  return false;
}

}  // namespace

double PointCounts::recall() const { return share(found, missed); }
double PointCounts::precision() const { return share(found, false_alarms); }

PointCounts& PointCounts::operator+=(const PointCounts& other) {
  found += other.found;
  missed += other.missed;
  false_alarms += other.false_alarms;
  standing += other.standing;
  left_out += other.left_out;
  return *this;
}

PointCounts count_points(std::span<const JudgedPoint> points, const DynamicTruth& truth) {
  CHECK(truth.moving.empty() || truth.moving.same_size(truth.ids));
  PointCounts counts;
  for (const JudgedPoint& point : points) {
    const int u = static_cast<int>(std::lround(point.uv_px.x()));
    const int v = static_cast<int>(std::lround(point.uv_px.y()));
    if (!truth.ids.contains(u, v)) {
      ++counts.left_out;
      continue;
    }
    const bool movable = truth.ids.at(u, v) > 0;
    const bool moves = truth.moving.empty() ? movable : truth.moving.at(u, v) > 0;
    if ((movable && !moves) || at_edge(truth.ids, u, v)) {
      ++counts.left_out;
    } else if (moves) {
      ++(point.dynamic ? counts.found : counts.missed);
    } else {
      ++(point.dynamic ? counts.false_alarms : counts.standing);
    }
  }
  return counts;
}

double MaskOverlap::iou() const { return share(both, either - both); }

MaskOverlap& MaskOverlap::operator+=(const MaskOverlap& other) {
  both += other.both;
  either += other.either;
  return *this;
}

MaskOverlap overlap(const GreyImage& a, const GreyImage& b) {
  CHECK(a.same_size(b));
  MaskOverlap result;
  for (int v = 0; v < a.height(); ++v) {
    for (int u = 0; u < a.width(); ++u) {
      const bool in_a = a.at(u, v) > 0;
      const bool in_b = b.at(u, v) > 0;
      result.both += in_a && in_b ? 1 : 0;
      result.either += in_a || in_b ? 1 : 0;
    }
  }
  return result;
}

}  // namespace ygslam
