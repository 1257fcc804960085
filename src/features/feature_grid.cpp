#include "features/feature_grid.hpp"

#include <cmath>

#include "core/check.hpp"

namespace ygslam {

FeatureGrid::FeatureGrid(const Features& features, const std::array<double, 4>& bounds,
                         double cell_size_px)
    : min_x_px_(static_cast<float>(bounds[0])),
      min_y_px_(static_cast<float>(bounds[1])),
      per_px_(static_cast<float>(1.0 / cell_size_px)) {
  CHECK(cell_size_px > 0 && bounds[2] >= bounds[0] && bounds[3] >= bounds[1]);
  columns_ = static_cast<int>((bounds[2] - bounds[0]) / cell_size_px) + 1;
  rows_ = static_cast<int>((bounds[3] - bounds[1]) / cell_size_px) + 1;
  const auto cells = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  begins_.assign(cells + 1, 0);

  std::vector<std::size_t> cell_of;
  cell_of.reserve(features.size());
  for (const Feature& f : features.points) {
    CHECK(f.ideal_px.allFinite());
    const auto r = static_cast<std::size_t>(row(f.ideal_px.y()));
    cell_of.push_back(r * static_cast<std::size_t>(columns_) +
                      static_cast<std::size_t>(column(f.ideal_px.x())));
    ++begins_[cell_of.back() + 1];
  }
  for (std::size_t c = 0; c < cells; ++c) begins_[c + 1] += begins_[c];

  std::vector<std::uint32_t> next(begins_.begin(), begins_.end() - 1);
  entries_.resize(features.size());
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Feature& f = features.points[i];
    entries_[next[cell_of[i]]++] = {f.ideal_px.x(), f.ideal_px.y(), static_cast<std::uint32_t>(i),
                                    f.octave};
  }
}

void FeatureGrid::in_radius(const Eigen::Vector2f& centre_px, float radius_px, int min_octave,
                            int max_octave, std::vector<std::uint32_t>& found) const {
  found.clear();
  visit(centre_px, radius_px, min_octave, max_octave,
        [&](std::uint32_t index) { found.push_back(index); });
}

std::vector<std::uint32_t> FeatureGrid::in_radius(const Eigen::Vector2f& centre_px, float radius_px,
                                                  int min_octave, int max_octave) const {
  std::vector<std::uint32_t> found;
  in_radius(centre_px, radius_px, min_octave, max_octave, found);
  return found;
}

}  // namespace ygslam
