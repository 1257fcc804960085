#include "features/corner_strength.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include "features/fast.hpp"

namespace ygslam {

float harris_strength(const std::uint8_t* pixel, int stride) {
  constexpr int kRadius = 2;
  constexpr int kWindowLanes = 8;  // columns -2 .. 2, and three without weight
  static constexpr int kWeight[kWindowLanes] = {1, 1, 1, 1, 1, 0, 0, 0};
  int uu = 0;
  int uv = 0;
  int vv = 0;
  for (int dv = -kRadius; dv <= kRadius; ++dv) {
    const std::uint8_t* const here = pixel + static_cast<std::ptrdiff_t>(dv) * stride - kRadius;
    const std::uint8_t* const above = here - stride;
    const std::uint8_t* const below = here + stride;
    for (int i = 0; i < kWindowLanes; ++i) {
      const int right = above[i + 1] + 2 * here[i + 1] + below[i + 1];
      const int left = above[i - 1] + 2 * here[i - 1] + below[i - 1];
      const int bottom = below[i - 1] + 2 * below[i] + below[i + 1];
      const int top = above[i - 1] + 2 * above[i] + above[i + 1];
      const int gu = (right - left) * kWeight[i];
      const int gv = (bottom - top) * kWeight[i];
      uu += gu * gu;
      uv += gu * gv;
      vv += gv * gv;
    }
  }
  const double trace = static_cast<double>(uu) + vv;
  const double determinant = static_cast<double>(uu) * vv - static_cast<double>(uv) * uv;
  return static_cast<float>(std::max(0.0, determinant - 0.04 * trace * trace));
}

Eigen::Vector2f corner_offset_px(const std::uint8_t* pixel, int stride) {
  constexpr float kMaxOffset_px = 0.75F;
  std::array<std::array<std::uint8_t, 3 + 31>, 3> rows;
  std::array<std::array<float, 3>, 3> s;
  for (int v = 0; v < 3; ++v) {
    fast_score_row(pixel + static_cast<std::ptrdiff_t>(v - 1) * stride, stride, -1, 2, 0,
                   rows[v].data());
    for (int u = 0; u < 3; ++u) s[v][u] = rows[v][u];
  }
  const float gu = 0.5F * (s[1][2] - s[1][0]);
  const float gv = 0.5F * (s[2][1] - s[0][1]);
  const float huu = s[1][2] + s[1][0] - 2 * s[1][1];
  const float hvv = s[2][1] + s[0][1] - 2 * s[1][1];
  const float huv = 0.25F * (s[2][2] + s[0][0] - s[0][2] - s[2][0]);
  const float determinant = huu * hvv - huv * huv;
  if (huu >= 0 || determinant <= 0) return Eigen::Vector2f::Zero();
  const Eigen::Vector2f offset_px(-(hvv * gu - huv * gv) / determinant,
                                  -(huu * gv - huv * gu) / determinant);
  return offset_px.norm() <= kMaxOffset_px ? offset_px : Eigen::Vector2f::Zero();
}

}  // namespace ygslam
