#include "volume/space_kernel.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace ygslam {
namespace {

constexpr float kNearestCell_m = 0.05F;  // in front of the lens
constexpr auto kPyramidUnit_m = static_cast<float>(DepthView::kUnit_m);
constexpr float kPerTile = 1.0F / DepthPyramid::kTile_px;
constexpr int kWidest_tiles = (1 << DepthPyramid::kLevels) - 1;

}  // namespace

SpaceProjection::SpaceProjection(const PreparedView& prepared, const SE3& T_world_camera,
                                 const SpaceConfig& config, const DepthNoise& depth_noise)
    : view(&prepared),
      T_camera_world(T_world_camera.inverse()),
      noise(depth_noise),
      cell_m(config.cell_m) {
  const Pinhole& camera = prepared.camera();
  const Vec3 scale(camera.fx * kPerTile, camera.fy * kPerTile, 1);
  const Mat3 steps = scale.asDiagonal() * T_camera_world.R() * config.cell_m;
  step_x = steps.col(0).cast<float>();
  step_y = steps.col(1).cast<float>();
  step_z = steps.col(2).cast<float>();
  centre_tile_u = static_cast<float>((camera.cx + 0.5) * kPerTile);
  centre_tile_v = static_cast<float>((camera.cy + 0.5) * kPerTile);
  half_size_tile_m =
      static_cast<float>(0.5 * config.cell_m * std::max(camera.fx, camera.fy) * kPerTile);
  half_depth_m = static_cast<float>(0.5 * steps.row(2).cwiseAbs().sum());
  margin_m = static_cast<float>(config.margin_cells * config.cell_m);
  margin_sigmas = static_cast<float>(config.margin_sigmas);
}

Eigen::Vector3f SpaceProjection::origin(BlockKey key) const {
  const Vec3 cell = (block_of(key) * kBlockSide).cast<double>() + Vec3::Constant(0.5);
  const Vec3 p_camera = T_camera_world * (cell_m * cell);
  const Pinhole& camera = view->camera();
  return Vec3(camera.fx * kPerTile * p_camera.x(), camera.fy * kPerTile * p_camera.y(),
              p_camera.z())
      .cast<float>();
}

CellMask cells_seen_through_plain(const SpaceProjection& projection, BlockKey key) {
  const SpaceProjection& p = projection;
  const DepthPyramid& nearest = p.view->nearest();
  const auto columns = static_cast<float>(nearest.columns());
  const auto rows = static_cast<float>(nearest.rows());
  const float farthest_m = p.view->farthest_m();
  const Eigen::Vector3f origin = p.origin(key);
  CellMask through;
  for (int offset = 0; offset < kBlockCells; ++offset) {
    float at[3];
    for (int axis = 0; axis < 3; ++axis) {
      const float along_x = static_cast<float>(offset % 8) * p.step_x[axis];
      const int y = offset / 8 % 8, z = offset / 64;
      const float along_y = static_cast<float>(y) * p.step_y[axis];
      const float along_z = static_cast<float>(z) * p.step_z[axis];
      const float row = (origin[axis] + along_y) + along_z;
      at[axis] = row + along_x;
    }
    const float z = at[2];
    if (!(z > kNearestCell_m && z + p.half_depth_m < farthest_m)) continue;
    const float inverse_z = 1.0F / z;
    const float half = p.half_size_tile_m * inverse_z;
    const float x = at[0] * inverse_z;
    const float y = at[1] * inverse_z;
    const float u = x + p.centre_tile_u;
    const float v = y + p.centre_tile_v;
    const float left = u - half, right = u + half, top = v - half, bottom = v + half;
    if (!(left >= 0 && top >= 0 && right < columns && bottom < rows)) continue;
    const int x0 = static_cast<int>(left), x1 = static_cast<int>(right);
    const int y0 = static_cast<int>(top), y1 = static_cast<int>(bottom);
    const int size = std::min(x1 - x0, y1 - y0) + 1;
    if (size > kWidest_tiles) continue;
    const int level = static_cast<int>(std::bit_width(static_cast<unsigned>(size))) - 1;
    const int square = 1 << level;
    const std::uint16_t* plane = nearest.planes() + level * nearest.plane_size();
    const auto depth_at = [&](int column, int row) {
      return plane[row * nearest.columns() + column];
    };
    const int low = x1 - square + 1, high = y1 - square + 1;
    const std::uint16_t depth = std::min(std::min(depth_at(x0, y0), depth_at(low, y0)),
                                         std::min(depth_at(x0, high), depth_at(low, high)));
    if (depth == DepthPyramid::kNone) continue;
    const float depth_m = static_cast<float>(depth) * kPyramidUnit_m;
    const float noise_m = p.margin_sigmas * p.noise.sigma_m(depth_m);
    const float behind_m = (z + p.half_depth_m) + std::max(p.margin_m, noise_m);
    if (!(depth_m > behind_m)) continue;
    std::uint8_t& bits = through.rows[static_cast<std::size_t>(offset / kBlockSide)];
    bits = static_cast<std::uint8_t>(bits | (1U << (offset % kBlockSide)));
  }
  return through;
}

#ifdef __AVX2__
CellMask cells_seen_through(const SpaceProjection& projection, BlockKey key) {
  const SpaceProjection& p = projection;
  const DepthPyramid& nearest = p.view->nearest();
  const Eigen::Vector3f origin = p.origin(key);
  const __m256 lane = _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7);
  const __m256 along_x = _mm256_mul_ps(lane, _mm256_set1_ps(p.step_x.x()));
  const __m256 along_y = _mm256_mul_ps(lane, _mm256_set1_ps(p.step_x.y()));
  const __m256 along_z = _mm256_mul_ps(lane, _mm256_set1_ps(p.step_x.z()));
  const __m256 zero = _mm256_setzero_ps();
  const __m256i one = _mm256_set1_epi32(1);
  const __m256 columns = _mm256_set1_ps(static_cast<float>(nearest.columns()));
  const __m256 rows = _mm256_set1_ps(static_cast<float>(nearest.rows()));
  const __m256i stride = _mm256_set1_epi32(nearest.columns());
  const __m256i none = _mm256_set1_epi32(DepthPyramid::kNone);
  const auto* planes = reinterpret_cast<const int*>(nearest.planes());
  CellMask through;
  for (std::size_t row = 0; row < through.rows.size(); ++row) {
    float start[3];
    for (int axis = 0; axis < 3; ++axis) {
      const int layer = row / 8;
      const float row_y = static_cast<float>(row % 8) * p.step_y[axis];
      const float row_z = static_cast<float>(layer) * p.step_z[axis];
      start[axis] = (origin[axis] + row_y) + row_z;
    }
    const __m256 z = _mm256_add_ps(_mm256_set1_ps(start[2]), along_z);
    const __m256 back = _mm256_add_ps(z, _mm256_set1_ps(p.half_depth_m));
    __m256 in =
        _mm256_and_ps(_mm256_cmp_ps(z, _mm256_set1_ps(kNearestCell_m), _CMP_GT_OQ),
                      _mm256_cmp_ps(back, _mm256_set1_ps(p.view->farthest_m()), _CMP_LT_OQ));
    if (_mm256_testz_ps(in, in)) continue;
    const __m256 inverse_z = _mm256_div_ps(_mm256_set1_ps(1.0F), z);
    const __m256 half = _mm256_mul_ps(_mm256_set1_ps(p.half_size_tile_m), inverse_z);
    const __m256 x = _mm256_mul_ps(_mm256_add_ps(_mm256_set1_ps(start[0]), along_x), inverse_z);
    const __m256 y = _mm256_mul_ps(_mm256_add_ps(_mm256_set1_ps(start[1]), along_y), inverse_z);
    const __m256 u = _mm256_add_ps(x, _mm256_set1_ps(p.centre_tile_u));
    const __m256 v = _mm256_add_ps(y, _mm256_set1_ps(p.centre_tile_v));
    const __m256 left = _mm256_sub_ps(u, half), right = _mm256_add_ps(u, half);
    const __m256 top = _mm256_sub_ps(v, half), bottom = _mm256_add_ps(v, half);
    in = _mm256_and_ps(in, _mm256_and_ps(_mm256_cmp_ps(left, zero, _CMP_GE_OQ),
                                         _mm256_cmp_ps(right, columns, _CMP_LT_OQ)));
    in = _mm256_and_ps(in, _mm256_and_ps(_mm256_cmp_ps(top, zero, _CMP_GE_OQ),
                                         _mm256_cmp_ps(bottom, rows, _CMP_LT_OQ)));
    if (_mm256_testz_ps(in, in)) continue;
    const __m256i x0 = _mm256_cvttps_epi32(left), x1 = _mm256_cvttps_epi32(right);
    const __m256i y0 = _mm256_cvttps_epi32(top), y1 = _mm256_cvttps_epi32(bottom);
    const __m256i size =
        _mm256_add_epi32(_mm256_min_epi32(_mm256_sub_epi32(x1, x0), _mm256_sub_epi32(y1, y0)), one);
    __m256i mask = _mm256_andnot_si256(_mm256_cmpgt_epi32(size, _mm256_set1_epi32(kWidest_tiles)),
                                       _mm256_castps_si256(in));
    // The exponent of a whole number as float is the place of its highest bit.
    const __m256i level =
        _mm256_sub_epi32(_mm256_srli_epi32(_mm256_castps_si256(_mm256_cvtepi32_ps(size)), 23),
                         _mm256_set1_epi32(127));
    const __m256i square = _mm256_sllv_epi32(one, level);
    const __m256i low = _mm256_sub_epi32(_mm256_add_epi32(x1, one), square);
    const __m256i high = _mm256_sub_epi32(_mm256_add_epi32(y1, one), square);
    const __m256i plane = _mm256_mullo_epi32(level, _mm256_set1_epi32(nearest.plane_size()));
    const auto depth_at = [&](__m256i column, __m256i line) {
      const __m256i place =
          _mm256_add_epi32(plane, _mm256_add_epi32(_mm256_mullo_epi32(line, stride), column));
      return _mm256_and_si256(_mm256_i32gather_epi32(planes, _mm256_and_si256(mask, place), 2),
                              none);
    };
    const __m256i depth =
        _mm256_min_epi32(_mm256_min_epi32(depth_at(x0, y0), depth_at(low, y0)),
                         _mm256_min_epi32(depth_at(x0, high), depth_at(low, high)));
    mask = _mm256_andnot_si256(_mm256_cmpeq_epi32(depth, none), mask);
    const __m256 depth_m = _mm256_mul_ps(_mm256_cvtepi32_ps(depth), _mm256_set1_ps(kPyramidUnit_m));
    const __m256 beyond_m = _mm256_sub_ps(depth_m, _mm256_set1_ps(p.noise.from_m));
    const __m256 growth_m =
        _mm256_mul_ps(_mm256_set1_ps(p.noise.factor_per_m), _mm256_mul_ps(beyond_m, beyond_m));
    const __m256 noise_m = _mm256_mul_ps(_mm256_set1_ps(p.margin_sigmas),
                                         _mm256_add_ps(_mm256_set1_ps(p.noise.base_m), growth_m));
    const __m256 behind_m = _mm256_add_ps(back, _mm256_max_ps(_mm256_set1_ps(p.margin_m), noise_m));
    const __m256 seen =
        _mm256_and_ps(_mm256_castsi256_ps(mask), _mm256_cmp_ps(depth_m, behind_m, _CMP_GT_OQ));
    through.rows[row] = static_cast<std::uint8_t>(_mm256_movemask_ps(seen));
  }
  return through;
}
#else
CellMask cells_seen_through(const SpaceProjection& projection, BlockKey key) {
  return cells_seen_through_plain(projection, key);
}
#endif

}  // namespace ygslam
