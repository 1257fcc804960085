#include "motion/flow/flow_field.hpp"

#include <limits>

#include "image/depth.hpp"

namespace ygslam {
namespace {

constexpr double kCellsPerRadius = 2;

}  // namespace

FlowField::FlowField(std::span<const FlowEnd> ends, std::span<const Feature> previous,
                     const DepthImage& current_depth_m, const FlowFieldConfig& config)
    : config_(config),
      grid_(config.radius_px / kCellsPerRadius),
      end_uv_px_(ends.size(), Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN())),
      end_depth_m_(ends.size(), 0.0F),
      reliable_(ends.size(), 0) {
  CHECK(ends.size() == previous.size());
  for (std::size_t i = 0; i < ends.size(); ++i) {
    if (!ends[i].found || !ends[i].uv_px.allFinite()) continue;
    const float depth_m = depth_at(current_depth_m, ends[i].uv_px.x(), ends[i].uv_px.y());
    // Depth that appears or vanishes is a change of surface too.
    if ((previous[i].depth_m > 0) != (depth_m > 0)) continue;
    if (!same_depth(previous[i].depth_m, depth_m, config.slip_ratio)) continue;
    end_uv_px_[i] = ends[i].uv_px;
    end_depth_m_[i] = depth_m;
    reliable_[i] = 1;
  }
  grid_.build(end_uv_px_);
  sorted_.reserve(grid_.order().size());
  for (const std::uint32_t i : grid_.order())
    sorted_.push_back({end_uv_px_[i], end_depth_m_[i], i});
}

}  // namespace ygslam
