// Finds the features near an ideal pixel.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "features/feature.hpp"

namespace ygslam {

/// A square grid over ideal_px. Keeps its own copy of the positions, so that it may outlive the
/// features. Features beyond the bounds are found too.
class FeatureGrid {
 public:
  FeatureGrid() = default;
  /// @param bounds {min_x, min_y, max_x, max_y} of ideal pixels, as of Camera::ideal_bounds().
  FeatureGrid(const Features& features, const std::array<double, 4>& bounds,
              double cell_size_px = 16);

  [[nodiscard]] std::size_t size() const { return entries_.size(); }

  /// Calls visitor(index) for each feature with |ideal_px - centre_px| <= radius_px and an octave
  /// in [min_octave, max_octave]; in an order that depends on the features only. No allocation.
  /// A centre or radius that is not finite finds nothing.
  template <typename Visitor>
  void visit(const Eigen::Vector2f& centre_px, float radius_px, int min_octave, int max_octave,
             Visitor&& visitor) const {
    if (entries_.empty() || !centre_px.allFinite() || !(radius_px >= 0) ||
        radius_px > kMaxRadius_px)
      return;
    const int left = column(centre_px.x() - radius_px);
    const int right = column(centre_px.x() + radius_px);
    const int bottom = row(centre_px.y() + radius_px);
    const float limit = radius_px * radius_px;
    for (int r = row(centre_px.y() - radius_px); r <= bottom; ++r) {
      const std::size_t line = static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_);
      const std::uint32_t end = begins_[line + static_cast<std::size_t>(right) + 1];
      for (std::uint32_t i = begins_[line + static_cast<std::size_t>(left)]; i < end; ++i) {
        const Entry& e = entries_[i];
        const float dx = e.x_px - centre_px.x();
        const float dy = e.y_px - centre_px.y();
        if (dx * dx + dy * dy <= limit && e.octave >= min_octave && e.octave <= max_octave) {
          visitor(e.index);
        }
      }
    }
  }

  /// The same into a list that is cleared first and keeps its memory.
  void in_radius(const Eigen::Vector2f& centre_px, float radius_px, int min_octave, int max_octave,
                 std::vector<std::uint32_t>& found) const;
  [[nodiscard]] std::vector<std::uint32_t> in_radius(const Eigen::Vector2f& centre_px,
                                                     float radius_px, int min_octave = 0,
                                                     int max_octave = 255) const;

 private:
  static constexpr float kMaxRadius_px = 1e6F;
  struct Entry {
    float x_px, y_px;
    std::uint32_t index;
    std::int32_t octave;
  };
  [[nodiscard]] int column(float x_px) const { return cell(x_px - min_x_px_, columns_); }
  [[nodiscard]] int row(float y_px) const { return cell(y_px - min_y_px_, rows_); }
  [[nodiscard]] int cell(float offset_px, int count) const {
    return static_cast<int>(std::clamp(offset_px * per_px_, 0.0F, static_cast<float>(count - 1)));
  }

  float min_x_px_ = 0, min_y_px_ = 0;
  float per_px_ = 1;  // cells per pixel
  int columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> begins_;  // first entry of each cell, row by row, and the end
  std::vector<Entry> entries_;         // by cell, within a cell by index
};

}  // namespace ygslam
