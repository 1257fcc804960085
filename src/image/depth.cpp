#include "image/depth.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace ygslam {

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

}  // namespace ygslam
