// Finds the features near an ideal pixel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "features/feature.hpp"
#include "image/point_grid.hpp"

namespace ygslam {

/// A square grid over ideal_px. Keeps its own copy of the positions, so that it may outlive the
/// features. Features beyond the bounds are found too.
class FeatureGrid {
 public:
  FeatureGrid() = default;
  /// @param bounds {min_x, min_y, ...} of ideal pixels, as of Camera::ideal_bounds().
  FeatureGrid(const Features& features, const std::array<double, 4>& bounds);

  [[nodiscard]] std::size_t size() const { return entries_.size(); }

  /// Calls visitor(index) for each feature with |ideal_px - centre_px| <= radius_px and an octave
  /// in [min_octave, max_octave]; in an order that depends on the features only. No allocation.
  /// A centre or radius that is not finite finds nothing.
  template <typename Visitor>
  void visit(const Eigen::Vector2f& centre_px, float radius_px, int min_octave, int max_octave,
             Visitor&& visitor) const {
    if (!(radius_px >= 0 && radius_px <= kMaxRadius_px)) return;
    const float limit = radius_px * radius_px;
    cells_.near_ranges(centre_px, radius_px, [&](std::uint32_t first, std::uint32_t last) {
      for (std::uint32_t i = first; i < last; ++i) {
        const Entry& e = entries_[i];
        const float dx = e.x_px - centre_px.x();
        const float dy = e.y_px - centre_px.y();
        if (dx * dx + dy * dy <= limit && e.octave >= min_octave && e.octave <= max_octave) {
          visitor(e.index);
        }
      }
    });
  }

  /// The same into a list that is cleared first and keeps its memory.
  void in_radius(const Eigen::Vector2f& centre_px, float radius_px, int min_octave, int max_octave,
                 std::vector<std::uint32_t>& found) const;

 private:
  static constexpr float kMaxRadius_px = 1e6F;
  struct Entry {
    float x_px, y_px;
    std::uint32_t index;
    std::int32_t octave;
  };
  PointGrid cells_{16};
  std::vector<Entry> entries_;  // in the order of cells_
};

}  // namespace ygslam
