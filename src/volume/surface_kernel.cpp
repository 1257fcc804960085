#include "volume/surface_kernel.hpp"

#include <bit>
#include <cmath>
#ifdef __AVX2__
#include <immintrin.h>
#endif

#include "core/check.hpp"

namespace ygslam {
namespace {

constexpr float kNearest_m = 0.05F;  // in front of the lens
constexpr auto kDepthUnit_m = static_cast<float>(DepthView::kUnit_m);

std::uint64_t spread_colour(std::uint32_t appearance) {
  const std::uint64_t c = appearance;
  return (c & 0xffU) | ((c & 0xff00U) << 13) | ((c & 0xff0000U) << 26);
}

}  // namespace

SurfaceProjection::SurfaceProjection(const PreparedView& prepared, const SE3& T_world_camera,
                                     const SurfaceConfig& config, const DepthNoise& depth_noise,
                                     double quantum_m)
    : view(&prepared),
      T_camera_world(T_world_camera.inverse()),
      noise(depth_noise),
      voxel_m(config.voxel_m) {
  const Pinhole& camera = prepared.camera();
  const Vec3 focal(camera.fx, camera.fy, 1);
  const Mat3 steps = focal.asDiagonal() * T_camera_world.R() * config.voxel_m;
  step_x = steps.col(0).cast<float>();
  step_y = steps.col(1).cast<float>();
  step_z = steps.col(2).cast<float>();
  centre_u = static_cast<float>(camera.cx + 0.5);
  centre_v = static_cast<float>(camera.cy + 0.5);
  truncation_m = static_cast<float>(config.truncation_voxels * config.voxel_m);
  truncation_sigmas = static_cast<float>(config.truncation_sigmas);
  per_quantum = static_cast<float>(1 / quantum_m);
}

Eigen::Vector3f SurfaceProjection::origin(BlockKey key) const {
  const Vec3 voxel = (block_of(key) * kBlockSide).cast<double>() + Vec3::Constant(0.5);
  const Vec3 p_camera = T_camera_world * (voxel_m * voxel);
  const Pinhole& camera = view->camera();
  return Vec3(camera.fx * p_camera.x(), camera.fy * p_camera.y(), p_camera.z()).cast<float>();
}

namespace {

/// Eight voxels that lie one after the other in a brick: two rows of four along x.
struct EightVoxels {
  std::size_t brick = 0;
  int first = 0;    // voxel in the brick
  int x, y, z = 0;  // of the first voxel in the block
};
constexpr EightVoxels eight_voxels(int group) {
  const int brick = group / 8;
  const int in_brick = group % 8;
  return {static_cast<std::size_t>(brick), 8 * in_brick, 4 * (brick & 1),
          4 * (brick >> 1 & 1) + 2 * (in_brick % 2), 4 * (brick >> 2) + in_brick / 2};
}
/// Of a lane's voxel in the block.
constexpr int block_offset(const EightVoxels& eight, int lane) {
  return cell_offset(eight.x + lane % 4, eight.y + lane / 4, eight.z);
}

// Every product that goes into a sum stands in a statement of its own, so that no compiler fuses
// the two into one rounding where another does not.
Eigen::Vector3f start_of(const SurfaceProjection& p, const Eigen::Vector3f& origin,
                         const EightVoxels& eight) {
  Eigen::Vector3f start;
  for (int axis = 0; axis < 3; ++axis) {
    const float along_x = static_cast<float>(eight.x) * p.step_x[axis];
    const float along_y = static_cast<float>(eight.y) * p.step_y[axis];
    const float along_z = static_cast<float>(eight.z) * p.step_z[axis];
    start[axis] = ((origin[axis] + along_x) + along_y) + along_z;
  }
  return start;
}

SurfaceBrick& brick_for(int sign, std::size_t place, BrickPool& pool, SurfaceBlock& block) {
  SurfaceBrick*& brick = block.bricks[place];
  if (brick == nullptr) {
    CHECK(sign > 0, "a view taken back that was never added");
    brick = pool.obtain();
  }
  return *brick;
}

/// Gives back the bricks in which nothing is left. @return whether anything was contributed.
bool settle(int sign, const std::array<std::uint32_t, 8>& voxels, BrickPool& pool,
            SurfaceBlock& block) {
  std::uint32_t all = 0;
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    all += voxels[i];
    CHECK(sign > 0 || block.contributions[i] >= voxels[i],
          "a view taken back that was never added");
    block.contributions[i] += sign > 0 ? voxels[i] : 0U - voxels[i];
    if (voxels[i] == 0 || block.contributions[i] != 0) continue;
    pool.release(block.bricks[i]);
    block.bricks[i] = nullptr;
  }
  return all != 0;
}

}  // namespace

bool fuse_block_plain(const SurfaceProjection& projection, BlockKey key, int sign, BrickPool& pool,
                      SurfaceBlock& block) {
  const SurfaceProjection& p = projection;
  const PreparedView& view = *p.view;
  const auto width = static_cast<float>(view.camera().width);
  const auto height = static_cast<float>(view.camera().height);
  const Eigen::Vector3f origin = p.origin(key);
  std::array<std::uint32_t, 8> voxels{};
  for (int step = 0; step < kBlockCells; ++step) {
    const EightVoxels eight = eight_voxels(step / 8);
    const int lane = step % 8;
    const Eigen::Vector3f start = start_of(p, origin, eight);
    float at[3];
    for (int axis = 0; axis < 3; ++axis) {
      const float along_x = static_cast<float>(lane % 4) * p.step_x[axis];
      const int y = lane / 4;
      const float along_y = static_cast<float>(y) * p.step_y[axis];
      at[axis] = start[axis] + (along_x + along_y);
    }
    const float z = at[2];
    if (!(z > kNearest_m)) continue;
    const float inverse_z = 1.0F / z;
    const float x_px = at[0] * inverse_z;
    const float y_px = at[1] * inverse_z;
    const float u = x_px + p.centre_u;
    const float v = y_px + p.centre_v;
    if (!(u >= 0 && v >= 0 && u < width && v < height)) continue;
    const int pixel = static_cast<int>(v) * view.camera().width + static_cast<int>(u);
    const std::uint32_t geometry = view.geometry()[pixel];
    const int weight = static_cast<int>(geometry >> 24);
    if (weight == 0) continue;
    const float depth_m = static_cast<float>(geometry & 0xffffU) * kDepthUnit_m;
    const float slope = static_cast<float>((geometry >> 16) & 0xffU) * PreparedView::kSlopeUnit;
    const float along_ray_m = depth_m - z;
    const float distance_m = along_ray_m * slope;
    const float noise_m = p.truncation_sigmas * p.noise.sigma_m(depth_m);
    const float band_m = std::max(p.truncation_m, noise_m);
    if (!(std::abs(distance_m) <= band_m)) continue;
    if (!(std::abs(along_ray_m) <= kLongestReach * band_m)) continue;
    const int distance = static_cast<int>(std::nearbyint(distance_m * p.per_quantum));
    const std::uint32_t appearance = view.appearance()[pixel];
    SurfaceBrick& brick = brick_for(sign, eight.brick, pool, block);
    const auto i = static_cast<std::size_t>(eight.first + lane);
    brick.weighted_distance[i] += sign * weight * distance;
    brick.weight[i] = static_cast<std::uint16_t>(brick.weight[i] + sign * weight);
    brick.views[i] = static_cast<std::uint16_t>(brick.views[i] + sign);
    const std::uint64_t colour = spread_colour(appearance);
    brick.colour[i] += sign > 0 ? colour : ~colour + 1;
    if (const std::uint32_t object = appearance >> 24; object != 0)
      block.vote(view.objects()[object - 1], block_offset(eight, lane), sign);
    ++voxels[eight.brick];
  }
  return settle(sign, voxels, pool, block);
}

#ifdef __AVX2__
namespace {

template <bool kAdd>
__m256i plus32(__m256i sum, __m256i x) {
  return kAdd ? _mm256_add_epi32(sum, x) : _mm256_sub_epi32(sum, x);
}
template <bool kAdd>
void accumulate16(std::uint16_t* sums, __m256i x) {
  auto* at = reinterpret_cast<__m128i*>(sums);
  const __m128i packed =
      _mm_packus_epi32(_mm256_castsi256_si128(x), _mm256_extracti128_si256(x, 1));
  const __m128i sum = _mm_load_si128(at);
  _mm_store_si128(at, kAdd ? _mm_add_epi16(sum, packed) : _mm_sub_epi16(sum, packed));
}
template <bool kAdd>
void accumulate_colour(std::uint64_t* sums, __m128i appearance) {
  const __m256i wide = _mm256_cvtepu32_epi64(appearance);
  const __m256i red = _mm256_and_si256(wide, _mm256_set1_epi64x(0xff));
  const __m256i green = _mm256_slli_epi64(_mm256_and_si256(wide, _mm256_set1_epi64x(0xff00)), 13);
  const __m256i blue = _mm256_slli_epi64(_mm256_and_si256(wide, _mm256_set1_epi64x(0xff0000)), 26);
  const __m256i colour = _mm256_or_si256(red, _mm256_or_si256(green, blue));
  auto* at = reinterpret_cast<__m256i*>(sums);
  const __m256i sum = _mm256_load_si256(at);
  _mm256_store_si256(at, kAdd ? _mm256_add_epi64(sum, colour) : _mm256_sub_epi64(sum, colour));
}

template <bool kAdd>
bool fuse_block_avx2(const SurfaceProjection& p, BlockKey key, BrickPool& pool,
                     SurfaceBlock& block) {
  const PreparedView& view = *p.view;
  const Eigen::Vector3f origin = p.origin(key);
  const __m256 lane_x = _mm256_setr_ps(0, 1, 2, 3, 0, 1, 2, 3);
  const __m256 lane_y = _mm256_setr_ps(0, 0, 0, 0, 1, 1, 1, 1);
  const auto across = [&](int axis) {
    return _mm256_add_ps(_mm256_mul_ps(lane_x, _mm256_set1_ps(p.step_x[axis])),
                         _mm256_mul_ps(lane_y, _mm256_set1_ps(p.step_y[axis])));
  };
  const __m256 across_x = across(0), across_y = across(1), across_z = across(2);
  const __m256 zero = _mm256_setzero_ps();
  const __m256 width = _mm256_set1_ps(static_cast<float>(view.camera().width));
  const __m256 height = _mm256_set1_ps(static_cast<float>(view.camera().height));
  const __m256i stride = _mm256_set1_epi32(view.camera().width);
  const __m256 sign_bit = _mm256_set1_ps(-0.0F);
  std::array<std::uint32_t, 8> voxels{};
  for (int group = 0; group < kBlockCells / 8; ++group) {
    const EightVoxels eight = eight_voxels(group);
    const Eigen::Vector3f start = start_of(p, origin, eight);
    const __m256 z = _mm256_add_ps(_mm256_set1_ps(start[2]), across_z);
    const __m256 inverse_z = _mm256_div_ps(_mm256_set1_ps(1.0F), z);
    const __m256 x_px = _mm256_mul_ps(_mm256_add_ps(_mm256_set1_ps(start[0]), across_x), inverse_z);
    const __m256 y_px = _mm256_mul_ps(_mm256_add_ps(_mm256_set1_ps(start[1]), across_y), inverse_z);
    const __m256 u = _mm256_add_ps(x_px, _mm256_set1_ps(p.centre_u));
    const __m256 v = _mm256_add_ps(y_px, _mm256_set1_ps(p.centre_v));
    __m256 in = _mm256_cmp_ps(z, _mm256_set1_ps(kNearest_m), _CMP_GT_OQ);
    in = _mm256_and_ps(
        in, _mm256_and_ps(_mm256_cmp_ps(u, zero, _CMP_GE_OQ), _mm256_cmp_ps(u, width, _CMP_LT_OQ)));
    in = _mm256_and_ps(in, _mm256_and_ps(_mm256_cmp_ps(v, zero, _CMP_GE_OQ),
                                         _mm256_cmp_ps(v, height, _CMP_LT_OQ)));
    if (_mm256_testz_ps(in, in)) continue;
    const __m256i pixel =
        _mm256_and_si256(_mm256_castps_si256(in),
                         _mm256_add_epi32(_mm256_mullo_epi32(_mm256_cvttps_epi32(v), stride),
                                          _mm256_cvttps_epi32(u)));
    const __m256i geometry =
        _mm256_i32gather_epi32(reinterpret_cast<const int*>(view.geometry()), pixel, 4);
    const __m256i weight = _mm256_srli_epi32(geometry, 24);
    const __m256 depth_m =
        _mm256_mul_ps(_mm256_cvtepi32_ps(_mm256_and_si256(geometry, _mm256_set1_epi32(0xffff))),
                      _mm256_set1_ps(kDepthUnit_m));
    const __m256 slope =
        _mm256_mul_ps(_mm256_cvtepi32_ps(_mm256_and_si256(_mm256_srli_epi32(geometry, 16),
                                                          _mm256_set1_epi32(0xff))),
                      _mm256_set1_ps(PreparedView::kSlopeUnit));
    const __m256 along_ray_m = _mm256_sub_ps(depth_m, z);
    const __m256 distance_m = _mm256_mul_ps(along_ray_m, slope);
    const __m256 beyond_m = _mm256_sub_ps(depth_m, _mm256_set1_ps(p.noise.from_m));
    const __m256 growth_m =
        _mm256_mul_ps(_mm256_set1_ps(p.noise.factor_per_m), _mm256_mul_ps(beyond_m, beyond_m));
    const __m256 noise_m = _mm256_mul_ps(_mm256_set1_ps(p.truncation_sigmas),
                                         _mm256_add_ps(_mm256_set1_ps(p.noise.base_m), growth_m));
    const __m256 band_m = _mm256_max_ps(_mm256_set1_ps(p.truncation_m), noise_m);
    in = _mm256_and_ps(in,
                       _mm256_cmp_ps(_mm256_andnot_ps(sign_bit, distance_m), band_m, _CMP_LE_OQ));
    const __m256 reach_m = _mm256_mul_ps(_mm256_set1_ps(kLongestReach), band_m);
    in = _mm256_and_ps(in,
                       _mm256_cmp_ps(_mm256_andnot_ps(sign_bit, along_ray_m), reach_m, _CMP_LE_OQ));
    const __m256i mask = _mm256_and_si256(_mm256_castps_si256(in),
                                          _mm256_cmpgt_epi32(weight, _mm256_setzero_si256()));
    const int lanes = _mm256_movemask_ps(_mm256_castsi256_ps(mask));
    if (lanes == 0) continue;
    voxels[eight.brick] += static_cast<std::uint32_t>(std::popcount(static_cast<unsigned>(lanes)));

    SurfaceBrick& brick = brick_for(kAdd ? 1 : -1, eight.brick, pool, block);
    const auto first = static_cast<std::size_t>(eight.first);
    const __m256i distance =
        _mm256_cvtps_epi32(_mm256_mul_ps(distance_m, _mm256_set1_ps(p.per_quantum)));
    const __m256i counted = _mm256_and_si256(mask, weight);
    auto* distances = reinterpret_cast<__m256i*>(brick.weighted_distance.data() + first);
    _mm256_store_si256(distances, plus32<kAdd>(_mm256_load_si256(distances),
                                               _mm256_mullo_epi32(counted, distance)));
    accumulate16<kAdd>(brick.weight.data() + first, counted);
    accumulate16<kAdd>(brick.views.data() + first, _mm256_srli_epi32(mask, 31));
    const __m256i appearance = _mm256_and_si256(
        mask, _mm256_i32gather_epi32(reinterpret_cast<const int*>(view.appearance()), pixel, 4));
    accumulate_colour<kAdd>(brick.colour.data() + first, _mm256_castsi256_si128(appearance));
    accumulate_colour<kAdd>(brick.colour.data() + first + 4,
                            _mm256_extracti128_si256(appearance, 1));
    const __m256i objects = _mm256_srli_epi32(appearance, 24);
    if (_mm256_testz_si256(objects, objects)) continue;
    alignas(32) std::uint32_t object[kBlockSide];
    _mm256_store_si256(reinterpret_cast<__m256i*>(object), objects);
    for (int k = 0; k < 8; ++k)
      if (object[k] != 0)
        block.vote(view.objects()[object[k] - 1], block_offset(eight, k), kAdd ? 1 : -1);
  }
  return settle(kAdd ? 1 : -1, voxels, pool, block);
}

}  // namespace

bool fuse_block(const SurfaceProjection& projection, BlockKey key, int sign, BrickPool& pool,
                SurfaceBlock& block) {
  return sign > 0 ? fuse_block_avx2<true>(projection, key, pool, block)
                  : fuse_block_avx2<false>(projection, key, pool, block);
}
#else
bool fuse_block(const SurfaceProjection& projection, BlockKey key, int sign, BrickPool& pool,
                SurfaceBlock& block) {
  return fuse_block_plain(projection, key, sign, pool, block);
}
#endif

}  // namespace ygslam
