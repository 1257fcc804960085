// What the people network is shown of a frame's depth: training/prepare.py once more, held to the
// same answers (training/prepared.json).
#pragma once

#include <vector>

#include "geometry/camera.hpp"
#include "image/image.hpp"

namespace ygslam {

inline constexpr int kPeopleColumns = 160, kPeopleRows = 120;  ///< of the network's grid [cells]
inline constexpr int kPeopleCells = kPeopleColumns * kPeopleRows;
/// Size of a cell; measured; normal x, y, z.
inline constexpr int kPeopleChannels = 5;

/// Where an image lies on the grid: its upper left corner on the grid's, as large as it fits in,
/// never enlarged.
struct PeopleGrid {
  double scale = 1;           ///< pixels along a cell's side
  int columns = 0, rows = 0;  ///< cells that lie inside the image
};
[[nodiscard]] PeopleGrid make_people_grid(int image_width, int image_height);

/// Calls look(neighbour) for those of the four neighbours that lie in the grid.
template <typename Look>
void for_neighbours(int cell, const PeopleGrid& grid, const Look& look) {
  const int column = cell % kPeopleColumns;
  const int row = cell / kPeopleColumns;
  if (column > 0) look(cell - 1);
  if (column + 1 < grid.columns) look(cell + 1);
  if (row > 0) look(cell - kPeopleColumns);
  if (row + 1 < grid.rows) look(cell + kPeopleColumns);
}

class PeopleInput {
 public:
  explicit PeopleInput(const CameraConfig& camera);

  /// @param depth_m of the camera's size. @param planes kPeopleChannels x kPeopleRows x
  /// kPeopleColumns, all written; cells outside the image are not measured.
  void fill(const DepthImage& depth_m, float* planes);

  [[nodiscard]] const PeopleGrid& grid() const { return grid_; }
  [[nodiscard]] float focal_cells() const { return fx_; }
  /// Of the cells of the frame that was filled in last: the nearest surface of each [m], 0 = none.
  [[nodiscard]] const DepthImage& depth_m() const { return depth_m_; }

 private:
  template <typename Look>
  void for_cells(const Look& look) const;
  void reduce_depth(const DepthImage& depth_m, int row);
  void write_depth(float* planes) const;
  void write_normals(int row, float* planes) const;
  [[nodiscard]] int pixels(int row_or_column) const {
    return edges_[row_or_column + 1] - edges_[row_or_column];
  }

  PeopleGrid grid_;
  float fx_ = 0;
  std::vector<int> edges_;    // first pixel of each row or column of cells, and one more
  std::vector<float> x_, y_;  // of the ray through each column, each row, at depth 1
  DepthImage depth_m_;
  // Of one row of cells, by pixel column.
  std::vector<float> nearest_m_, limit_m_, sum_m_;
  std::vector<int> count_;
};

}  // namespace ygslam
