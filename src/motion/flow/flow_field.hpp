// Where all points of the previous frame ended in the current one, for queries of the neighbours of
// a feature at its depth. There are more ends than links: a point is followed even where no feature
// is found again.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "image/image.hpp"
#include "image/point_grid.hpp"
#include "motion/labels.hpp"

namespace ygslam {

struct FlowFieldConfig {
  double radius_px = 25;      ///< of the neighbourhood
  double depth_ratio = 0.08;  ///< a larger relative difference in depth: another surface
  /// A point whose depth changed by more than this between the frames slid onto another surface.
  double slip_ratio = 0.15;
};

class FlowField {
 public:
  FlowField() : grid_(1) {}
  /// @param previous the features that were followed; ends[i] is where previous[i] ended.
  FlowField(std::span<const FlowEnd> ends, std::span<const Feature> previous,
            const DepthImage& current_depth_m, const FlowFieldConfig& config);

  /// True if the previous point was found again, on the surface it was on.
  [[nodiscard]] bool reliable(std::size_t previous) const { return reliable_[previous] != 0; }

  /// Calls visit(index of previous point, squared distance [px^2]) for every reliable end near the
  /// feature and at its depth. One without depth is beside the surface that has it (in the shadow
  /// of a near object, or too far away): such are neighbours of each other only.
  template <typename Visit>
  void neighbours(const Feature& feature, Visit&& visit) const {
    const auto limit2 = static_cast<float>(config_.radius_px * config_.radius_px);
    const bool has_depth = feature.depth_m > 0;
    grid_.near_ranges(feature.uv_px, config_.radius_px,
                      [&](std::uint32_t first, std::uint32_t last) {
                        for (std::uint32_t i = first; i < last; ++i) {
                          const End& end = sorted_[i];
                          const float d2 = (end.uv_px - feature.uv_px).squaredNorm();
                          if (d2 > limit2 || has_depth != (end.depth_m > 0)) continue;
                          if (same_depth(feature.depth_m, end.depth_m, config_.depth_ratio))
                            visit(end.point, d2);
                        }
                      });
  }

  /// The same around the end of a previous point, without itself.
  template <typename Visit>
  void neighbours_of(std::size_t previous, Visit&& visit) const {
    Feature end;
    end.uv_px = end_uv_px_[previous];
    end.depth_m = end_depth_m_[previous];
    neighbours(end, [&](std::uint32_t k, float distance2_px2) {
      if (k != previous) visit(k, distance2_px2);
    });
  }

  /// Which of two sides the feature's neighbours are on, nearer ones with more weight.
  /// @param side_of of a previous point: 0 or 1, or -1 = has no vote. @param majority share of the
  /// votes that one side must have.
  /// @return the nearest previous point of that side; -1 without a majority or without votes.
  template <typename SideOf>
  [[nodiscard]] std::int32_t majority_of_neighbours(const Feature& feature, double majority,
                                                    const SideOf& side_of) const {
    std::array<float, 2> votes{};
    std::array<float, 2> best{};
    std::array<std::int32_t, 2> nearest{-1, -1};
    neighbours(feature, [&](std::uint32_t k, float distance2_px2) {
      const int side = side_of(k);
      if (side < 0) return;
      const float weight = vote_weight(distance2_px2);
      votes[side] += weight;
      if (weight <= best[side]) return;
      best[side] = weight;
      nearest[side] = static_cast<std::int32_t>(k);
    });
    const int side = votes[1] > votes[0] ? 1 : 0;
    return votes[side] >= majority * (votes[0] + votes[1]) ? nearest[side] : -1;
  }

  /// Weight of a neighbour's vote at a squared distance [px^2].
  [[nodiscard]] static float vote_weight(float distance2_px2) {
    constexpr float kFlat_px2 = 16;  // within 4 px all count about the same
    return 1.0F / (kFlat_px2 + distance2_px2);
  }

  /// False only where both depths are known and differ by more than the ratio.
  [[nodiscard]] static bool same_depth(float a_m, float b_m, double ratio) {
    if (!(a_m > 0) || !(b_m > 0)) return true;
    return std::abs(a_m - b_m) <= ratio * std::max(a_m, b_m);
  }

 private:
  struct End {
    Eigen::Vector2f uv_px;
    float depth_m;
    std::uint32_t point;
  };

  FlowFieldConfig config_;
  PointGrid grid_;
  std::vector<End> sorted_;                 // the reliable ones in the grid's order
  std::vector<Eigen::Vector2f> end_uv_px_;  // per point; not finite where not reliable
  std::vector<float> end_depth_m_;          // in the current frame
  std::vector<std::uint8_t> reliable_;
};

}  // namespace ygslam
