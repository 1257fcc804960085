// Points of an image sorted into square cells, for neighbour queries.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace ygslam {

/// Neighbours come cell by cell in index order: the same input gives the same order.
class PointGrid {
 public:
  /// @param cell_px side of a cell, > 0.
  explicit PointGrid(double cell_px) : inverse_cell_(static_cast<float>(1.0 / cell_px)) {}

  /// Sorts the points in; those that are not finite are left out.
  /// @param corner from which cells are counted; from farther up and left where points lie there.
  void build(std::span<const Eigen::Vector2f> points,
             const Eigen::Vector2f& corner = Eigen::Vector2f::Constant(1e9F)) {
    min_ = corner;
    Eigen::Vector2f max = Eigen::Vector2f::Constant(-1e9F);
    for (const auto& p : points) {
      if (!usable(p)) continue;
      min_ = min_.cwiseMin(p);
      max = max.cwiseMax(p);
    }
    const bool any = max.x() >= min_.x();
    columns_ = any ? cell(max.x() - min_.x()) + 1 : 0;
    rows_ = any ? cell(max.y() - min_.y()) + 1 : 0;
    begin_.assign(static_cast<std::size_t>(columns_) * rows_ + 1, 0);
    for (const auto& p : points)
      if (usable(p)) ++begin_[cell_of(p) + 1];
    for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
    order_.resize(begin_.back());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t i = 0; i < points.size(); ++i)
      if (usable(points[i])) order_[next[cell_of(points[i])]++] = static_cast<std::uint32_t>(i);
  }

  /// Calls visit(index) for every point in the cells that a circle of radius_px about p touches
  /// (a superset of the circle).
  template <typename Visit>
  void near(const Eigen::Vector2f& p, double radius_px, Visit&& visit) const {
    near_ranges(p, radius_px, [&](std::uint32_t first, std::uint32_t last) {
      for (std::uint32_t k = first; k < last; ++k) visit(order_[k]);
    });
  }

  /// The same as ranges [first, last) of order(), for callers that keep their data in that order.
  template <typename Visit>
  void near_ranges(const Eigen::Vector2f& p, double radius_px, Visit&& visit) const {
    if (columns_ == 0 || !usable(p)) return;
    const auto r = static_cast<float>(radius_px);
    const int c0 = std::max(cell(p.x() - r - min_.x()), 0);
    const int c1 = std::min(cell(p.x() + r - min_.x()), columns_ - 1);
    const int r0 = std::max(cell(p.y() - r - min_.y()), 0);
    const int r1 = std::min(cell(p.y() + r - min_.y()), rows_ - 1);
    if (c0 > c1) return;
    for (int row = r0; row <= r1; ++row) {
      const std::size_t c = static_cast<std::size_t>(row) * columns_;
      visit(begin_[c + c0], begin_[c + c1 + 1]);
    }
  }

  /// Point indices, cell by cell.
  [[nodiscard]] std::span<const std::uint32_t> order() const { return order_; }

 private:
  static bool usable(const Eigen::Vector2f& p) {
    return p.allFinite() && p.cwiseAbs().maxCoeff() < 1e5F;
  }
  [[nodiscard]] int cell(float offset_px) const {
    return static_cast<int>(std::floor(offset_px * inverse_cell_));
  }
  [[nodiscard]] std::size_t cell_of(const Eigen::Vector2f& p) const {
    return static_cast<std::size_t>(cell(p.y() - min_.y())) * columns_ + cell(p.x() - min_.x());
  }

  float inverse_cell_;
  Eigen::Vector2f min_ = Eigen::Vector2f::Zero();
  int columns_ = 0;
  int rows_ = 0;
  std::vector<std::uint32_t> begin_;  // per cell: first entry in order_
  std::vector<std::uint32_t> order_;  // point indices, cell by cell
};

}  // namespace ygslam
