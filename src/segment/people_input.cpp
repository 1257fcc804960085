#include "segment/people_input.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace ygslam {
namespace {

constexpr float kSameSurface = 1.05F;  // times the nearest depth: no farther is on its surface
constexpr float kSteepest = 0.06F;     // of the depth: the most that neighbours may differ by
constexpr float kLogMiddle = 4.4F;     // -log of a usual size of a cell [m]
constexpr float kFar_m = 1e9F;

}  // namespace

PeopleGrid make_people_grid(int image_width, int image_height) {
  PeopleGrid grid;
  grid.scale = std::max({1.0, static_cast<double>(image_width) / kPeopleColumns,
                         static_cast<double>(image_height) / kPeopleRows});
  const auto inside = [&](int cells, int size) {
    int n = 0;
    while (n < cells && static_cast<int>((n + 1) * grid.scale) <= size) ++n;
    return n;
  };
  grid.columns = inside(kPeopleColumns, image_width);
  grid.rows = inside(kPeopleRows, image_height);
  return grid;
}

PeopleInput::PeopleInput(const CameraConfig& camera)
    : grid_(make_people_grid(camera.width, camera.height)),
      fx_(static_cast<float>(camera.fx / grid_.scale)),
      depth_m_(kPeopleColumns, kPeopleRows) {
  const auto fy = static_cast<float>(camera.fy / grid_.scale);
  const auto cx = static_cast<float>((camera.cx + 0.5) / grid_.scale - 0.5);
  const auto cy = static_cast<float>((camera.cy + 0.5) / grid_.scale - 0.5);
  for (int i = 0; i <= kPeopleColumns; ++i) edges_.push_back(static_cast<int>(i * grid_.scale));
  for (int i = 0; i < kPeopleColumns; ++i) x_.push_back((static_cast<float>(i) - cx) / fx_);
  for (int i = 0; i < kPeopleRows; ++i) y_.push_back((static_cast<float>(i) - cy) / fy);
  const auto width = static_cast<std::size_t>(edges_[grid_.columns]);
  for (auto* line : {&nearest_m_, &limit_m_, &sum_m_}) line->resize(width);
  count_.resize(width);
}

void PeopleInput::fill(const DepthImage& depth_m, float* planes) {
  std::fill_n(planes, kPeopleChannels * kPeopleCells, 0.0F);
  for (int row = 0; row < grid_.rows; ++row) reduce_depth(depth_m, row);
  write_depth(planes);
  for (int row = 1; row + 1 < kPeopleRows; ++row) write_normals(row, planes);
}

/// Calls look(column, its first pixel, how many). Of VGA images each has four, which the compiler
/// is told: a loop over so few costs more than what it does.
template <typename Look>
void PeopleInput::for_cells(const Look& look) const {
  constexpr std::integral_constant<int, 4> kUsual;
  if (grid_.scale == kUsual) {
    for (int column = 0; column < grid_.columns; ++column) look(column, kUsual * column, kUsual);
  } else {
    for (int column = 0; column < grid_.columns; ++column)
      look(column, edges_[column], pixels(column));
  }
}

/// The depth of a cell is that of its nearest surface, 0 where less than a quarter of it was
/// measured.
void PeopleInput::reduce_depth(const DepthImage& depth_m, int row) {
  const std::size_t width = nearest_m_.size();
  float* __restrict nearest = nearest_m_.data();
  float* __restrict sum = sum_m_.data();
  float* __restrict limits = limit_m_.data();
  int* __restrict count = count_.data();
  std::fill_n(nearest, width, kFar_m);
  std::fill_n(count, width, 0);
  for (int v = edges_[row]; v < edges_[row + 1]; ++v) {
    const float* in = depth_m.row(v);
    for (std::size_t u = 0; u < width; ++u) {
      const float z = in[u] > 0 ? in[u] : kFar_m;
      nearest[u] = z < nearest[u] ? z : nearest[u];
      count[u] += in[u] > 0 ? 1 : 0;
    }
  }
  for_cells([&](int /*column*/, int begin, auto size) {
    float least = nearest[begin];
    int measured = count[begin];
    for (int i = 1; i < size; ++i) {
      least = std::min(least, nearest[begin + i]);
      measured += count[begin + i];
    }
    // Too few: nothing is on a surface nearer than the camera.
    const float limit = 4 * measured >= pixels(row) * size ? kSameSurface * least : -1.0F;
    for (int i = 0; i < size; ++i) limits[begin + i] = limit;
  });
  std::fill_n(sum, width, 0.0F);
  std::fill_n(count, width, 0);
  for (int v = edges_[row]; v < edges_[row + 1]; ++v) {
    const float* in = depth_m.row(v);
    for (std::size_t u = 0; u < width; ++u) {
      const float z = in[u] > 0 ? in[u] : kFar_m;  // beyond every limit
      sum[u] += z <= limits[u] ? z : 0.0F;
      count[u] += z <= limits[u] ? 1 : 0;
    }
  }
  float* const depth = depth_m_.row(row);
  for_cells([&](int column, int begin, auto size) {
    float total = 0;
    int on_it = 0;
    for (int i = 0; i < size; ++i) {
      total += sum[begin + i];
      on_it += count[begin + i];
    }
    depth[column] = on_it > 0 ? total / static_cast<float>(on_it) : 0.0F;
  });
}

void PeopleInput::write_depth(float* planes) const {
  const float* z = depth_m_.data();
  for (int i = 0; i < kPeopleCells; ++i) {
    if (z[i] <= 0) continue;
    planes[i] = std::log(z[i] / fx_) + kLogMiddle;
    planes[kPeopleCells + i] = 1.0F;
  }
}

void PeopleInput::write_normals(int row, float* planes) const {
  const float* middle = depth_m_.row(row);
  const float* above = depth_m_.row(row - 1);
  const float* below = depth_m_.row(row + 1);
  float* out = planes + 2 * kPeopleCells + row * kPeopleColumns;
  for (int u = 1; u + 1 < kPeopleColumns; ++u) {
    const float left = middle[u - 1];
    const float right = middle[u + 1];
    const float a_z = right - left;
    const float b_z = below[u] - above[u];
    const float steepest = kSteepest * middle[u];
    if (!(std::min({middle[u], left, right, above[u], below[u]}) > 0 && std::abs(a_z) < steepest &&
          std::abs(b_z) < steepest))
      continue;
    const float a_x = x_[u + 1] * right - x_[u - 1] * left;
    const float a_y = y_[row] * a_z;
    const float b_x = x_[u] * b_z;
    const float b_y = y_[row + 1] * below[u] - y_[row - 1] * above[u];
    const float n_x = a_z * b_y - a_y * b_z;
    const float n_y = a_x * b_z - a_z * b_x;
    const float n_z = a_y * b_x - a_x * b_y;
    const float length = std::sqrt(n_x * n_x + n_y * n_y + n_z * n_z);
    if (length <= 0) continue;
    out[u] = n_x / length;
    out[kPeopleCells + u] = n_y / length;
    out[2 * kPeopleCells + u] = n_z / length;
  }
}

}  // namespace ygslam
