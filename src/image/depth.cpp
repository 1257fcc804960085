#include "image/depth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <vector>

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#endif

namespace ygslam {
namespace {

constexpr float kFarthest_m = 1e9F;  // stands for "no depth seen"

/// Where no depth is known, minimum and maximum stay as they were.
void widen(DepthRange& range, float d) {
  const bool known = d > 0 && d < kFarthest_m;  // false for NaN
  range.min_m = std::min(range.min_m, known ? d : kFarthest_m);
  range.max_m = std::max(range.max_m, known ? d : 0.0F);
}

#if defined(__AVX2__)
/// Eight columns at once, of which those of the square count.
DepthRange inner_depth_range(const DepthImage& depth_m, int u, int v, int radius_px) {
  const __m256 none = _mm256_setzero_ps();
  const __m256 farthest = _mm256_set1_ps(kFarthest_m);
  const __m256i column = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
  const __m256 counts =
      _mm256_castsi256_ps(_mm256_cmpgt_epi32(_mm256_set1_epi32(2 * radius_px + 1), column));
  __m256 min_m = farthest;
  __m256 max_m = none;
  for (int y = v - radius_px; y <= v + radius_px; ++y) {
    const __m256 d = _mm256_loadu_ps(depth_m.row(y) + u - radius_px);
    const __m256 positive = _mm256_cmp_ps(d, none, _CMP_GT_OQ);
    const __m256 finite = _mm256_cmp_ps(d, farthest, _CMP_LT_OQ);
    const __m256 known = _mm256_and_ps(_mm256_and_ps(positive, finite), counts);
    min_m = _mm256_min_ps(min_m, _mm256_blendv_ps(farthest, d, known));
    max_m = _mm256_max_ps(max_m, _mm256_and_ps(d, known));
  }
  alignas(32) std::array<float, 8> low;
  alignas(32) std::array<float, 8> high;
  _mm256_store_ps(low.data(), min_m);
  _mm256_store_ps(high.data(), max_m);
  DepthRange range{kFarthest_m, 0};
  for (std::size_t k = 0; k < 8; ++k) {
    range.min_m = std::min(range.min_m, low[k]);
    range.max_m = std::max(range.max_m, high[k]);
  }
  return range.max_m > 0 ? range : DepthRange{};
}
#elif defined(__ARM_NEON)
/// Eight columns at once, of which those of the square count.
DepthRange inner_depth_range(const DepthImage& depth_m, int u, int v, int radius_px) {
  constexpr std::array<std::int32_t, 8> kColumns{0, 1, 2, 3, 4, 5, 6, 7};
  const float32x4_t none = vdupq_n_f32(0);
  const float32x4_t farthest = vdupq_n_f32(kFarthest_m);
  const int32x4_t width = vdupq_n_s32(2 * radius_px + 1);
  float32x4_t min_m = farthest;
  float32x4_t max_m = none;
  for (int y = v - radius_px; y <= v + radius_px; ++y) {
    for (const int half : {0, 4}) {
      const float32x4_t d = vld1q_f32(depth_m.row(y) + u - radius_px + half);
      const uint32x4_t counts = vcltq_s32(vld1q_s32(kColumns.data() + half), width);
      const uint32x4_t known =
          vandq_u32(vandq_u32(vcgtq_f32(d, none), vcltq_f32(d, farthest)), counts);
      min_m = vminq_f32(min_m, vbslq_f32(known, d, farthest));
      max_m = vmaxq_f32(max_m, vbslq_f32(known, d, none));
    }
  }
  const DepthRange range{vminvq_f32(min_m), vmaxvq_f32(max_m)};
  return range.max_m > 0 ? range : DepthRange{};
}
#endif

std::uint16_t swapped(std::uint16_t value) {
  return static_cast<std::uint16_t>(value << 8U | value >> 8U);
}

int middle(std::vector<int>& values) {
  const auto at = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

bool has_swapped_bytes(const Image<std::uint16_t>& raw) {
  constexpr int kRows = 40;  // looked at
  constexpr std::size_t kFewest = 500;
  constexpr int kRougher = 8;
  std::vector<int> as_read;
  std::vector<int> other;
  bool has_low_bytes = false;
  for (int v = 0; v < raw.height(); v += std::max(1, raw.height() / kRows)) {
    const std::uint16_t* row = raw.row(v);
    for (int u = 1; u < raw.width(); ++u) {
      if (row[u] == 0 || row[u - 1] == 0 || row[u] == row[u - 1]) continue;
      has_low_bytes |= (row[u] & 0xFFU) != 0;
      as_read.push_back(std::abs(row[u] - row[u - 1]));
      other.push_back(std::abs(swapped(row[u]) - swapped(row[u - 1])));
    }
  }
  // Low bytes of 0 throughout are coarse depth.
  return as_read.size() >= kFewest && has_low_bytes && kRougher * middle(other) < middle(as_read);
}

DepthImage depth_from_raw(const Image<std::uint16_t>& raw, double scale,
                          const DepthConfig& config) {
  DepthImage depth_m(raw.width(), raw.height());
  const auto to_m = static_cast<float>(1.0 / scale);
  const auto min_m = static_cast<float>(config.min_m);
  const auto max_m = static_cast<float>(config.max_m);
  std::transform(raw.begin(), raw.end(), depth_m.begin(), [&](std::uint16_t value) {
    const float d = static_cast<float>(value) * to_m;
    return d >= min_m && d <= max_m ? d : 0.0F;
  });
  return depth_m;
}

Image<std::uint16_t> raw_from_depth(const DepthImage& depth_m, double scale) {
  constexpr double kMostRaw = 65535;
  Image<std::uint16_t> raw(depth_m.width(), depth_m.height());
  for (std::size_t i = 0; i < raw.size(); ++i) {
    const double value = std::floor(static_cast<double>(depth_m.data()[i]) * scale + 0.5);
    raw.data()[i] = value > 0 && value <= kMostRaw ? static_cast<std::uint16_t>(value) : 0;
  }
  return raw;
}

DepthImage sanitized_depth(const DepthImage& depth_m, const DepthConfig& config) {
  DepthImage clean(depth_m.width(), depth_m.height());
  std::transform(depth_m.begin(), depth_m.end(), clean.begin(), [&](float d) {
    return std::isfinite(d) && d >= config.min_m && d <= config.max_m ? d : 0.0F;
  });
  return clean;
}

float depth_at(const DepthImage& depth_m, double u, double v) {
  const int u0 = static_cast<int>(std::lround(u));
  const int v0 = static_cast<int>(std::lround(v));
  if (!depth_m.contains(u0, v0)) return 0.0F;
  const float centre = depth_m.at(u0, v0);
  float nearest = centre > 0 ? centre : 1e9F;
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      if (!depth_m.contains(u0 + du, v0 + dv)) continue;
      const float d = depth_m.at(u0 + du, v0 + dv);
      if (d > 0) nearest = std::min(nearest, d);
    }
  }
  if (nearest > 1e8F) return 0.0F;
  if (centre <= 0) return nearest;
  // A step of more than 5 % is an edge: corners there belong to the surface in front.
  return centre - nearest > 0.05F * centre ? nearest : centre;
}

DepthRange depth_range(const DepthImage& depth_m, int u, int v, int radius_px) {
#if defined(__AVX2__) || defined(__ARM_NEON)
  if (radius_px >= 0 && radius_px <= 3 && u >= radius_px && v >= radius_px &&
      u - radius_px + 8 <= depth_m.width() && v + radius_px < depth_m.height())
    return inner_depth_range(depth_m, u, v, radius_px);
#endif
  DepthRange range{kFarthest_m, 0};
  for (int y = std::max(v - radius_px, 0); y <= std::min(v + radius_px, depth_m.height() - 1); ++y)
    for (int x = std::max(u - radius_px, 0); x <= std::min(u + radius_px, depth_m.width() - 1); ++x)
      widen(range, depth_m.at(x, y));
  return range.max_m > 0 ? range : DepthRange{};
}

bool on_depth_edge(const DepthImage& depth_m, double u, double v, double depth_at_m,
                   double radius_px) {
  // Six times the noise of the sum below for a Kinect (0.002 / m each); a step from 3 m to 3.3 m.
  constexpr double kStep_per_m = 0.03;
  constexpr double kDiagonal = 0.70710678;
  constexpr double kDirections[4][2] = {
      {1, 0}, {0, 1}, {kDiagonal, kDiagonal}, {kDiagonal, -kDiagonal}};
  const auto inverse_depth = [&](double du, double dv) {
    const int at_u = static_cast<int>(std::lround(u + du));
    const int at_v = static_cast<int>(std::lround(v + dv));
    const float d = depth_m.contains(at_u, at_v) ? depth_m.at(at_u, at_v) : 0.0F;
    return d > 0 ? 1.0 / d : 0.0;
  };
  return std::any_of(std::begin(kDirections), std::end(kDirections), [&](const double(&d)[2]) {
    const double ahead = inverse_depth(radius_px * d[0], radius_px * d[1]);
    const double behind = inverse_depth(-radius_px * d[0], -radius_px * d[1]);
    return ahead > 0 && behind > 0 && std::abs(ahead + behind - 2.0 / depth_at_m) > kStep_per_m;
  });
}

float plane_depth_at(const DepthImage& depth_m, double u, double v) {
  constexpr int kReach_px = 6;
  constexpr int kStep_px = 2;
  constexpr int kFewestPairs = 18;  // of 24
  // Of a Kinect's inverse depth, at any range.
  constexpr float kVariance_per_m2 = 0.002F * 0.002F;
  // Both in units of it; on a plane, 0.5 and 1.83 are expected.
  constexpr float kMostBend = 0.8F;
  constexpr float kMostStep = 2.2F;
  const int x = static_cast<int>(std::lround(u));
  const int y = static_cast<int>(std::lround(v));
  if (!depth_m.contains(x - kReach_px, y - kReach_px) ||
      !depth_m.contains(x + kReach_px, y + kReach_px))
    return 0.0F;
  float pairs = 0, sum = 0, sum_of_squares = 0;
  float squared_differences = 0, along_u = 0, along_v = 0, squares_u = 0, squares_v = 0;
  for (int dv = 0; dv <= kReach_px; dv += kStep_px) {
    for (int du = dv == 0 ? kStep_px : -kReach_px; du <= kReach_px; du += kStep_px) {
      const float before_m = depth_m.at(x - du, y - dv);
      const float after_m = depth_m.at(x + du, y + dv);
      if (!(before_m > 0 && after_m > 0)) continue;
      const float before = 1.0F / before_m;
      const float after = 1.0F / after_m;
      const float centre = 0.5F * (before + after);
      const float difference = after - before;
      const Eigen::Vector2f apart_px(2.0F * static_cast<float>(du), 2.0F * static_cast<float>(dv));
      pairs += 1;
      sum += centre;
      sum_of_squares += centre * centre;
      squared_differences += difference * difference;
      along_u += apart_px.x() * difference;
      along_v += apart_px.y() * difference;
      squares_u += apart_px.x() * apart_px.x();
      squares_v += apart_px.y() * apart_px.y();
    }
  }
  if (pairs < kFewestPairs) return 0.0F;
  const float mean = sum / pairs;
  // Where the surface bends the centres differ; at a step all are alike, but the differences do
  // not grow evenly.
  const float bend = sum_of_squares / pairs - mean * mean;
  const float slope_u = along_u / squares_u;
  const float slope_v = along_v / squares_v;
  const float step = (squared_differences - slope_u * along_u - slope_v * along_v) / pairs;
  if (bend > kMostBend * kVariance_per_m2 || step > kMostStep * kVariance_per_m2) return 0.0F;
  const float here =
      mean + slope_u * static_cast<float>(u - x) + slope_v * static_cast<float>(v - y);
  // In whole units of TUM's depth images, which maps keep in 16 bits.
  constexpr double kUnits_per_m = 5000;
  if (here <= 0) return 0.0F;
  return std::round(static_cast<float>(kUnits_per_m) / here) *
         static_cast<float>(1.0 / kUnits_per_m);
}

SurfaceDepth surface_depth_at(const DepthImage& depth_m, double u, double v) {
  if (depth_m.empty()) return {};
  const float plane_m = plane_depth_at(depth_m, u, v);
  if (plane_m > 0) return {plane_m, true};
  return {depth_at(depth_m, u, v), false};
}

Eigen::Vector2f depth_slope(const DepthImage& depth_m, double u, double v) {
  constexpr int kReach_px = 4;
  constexpr float kSameSurface = 0.1F;  // of the depth, over the whole reach
  const int x = static_cast<int>(std::lround(u));
  const int y = static_cast<int>(std::lround(v));
  const auto along = [&](int du, int dv) {
    if (!depth_m.contains(x - du, y - dv) || !depth_m.contains(x + du, y + dv)) return 0.0F;
    const float before_m = depth_m.at(x - du, y - dv);
    const float after_m = depth_m.at(x + du, y + dv);
    const bool same = before_m > 0 && after_m > 0 &&
                      std::abs(after_m - before_m) < kSameSurface * std::min(before_m, after_m);
    return same ? (after_m - before_m) / (2 * kReach_px) : 0.0F;
  };
  return {along(kReach_px, 0), along(0, kReach_px)};
}

}  // namespace ygslam
