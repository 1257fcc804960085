#include "tracking/depth_agreement.hpp"

#include <cmath>

#include "geometry/small_systems.hpp"
#include "image/depth.hpp"

namespace ygslam {
namespace {

constexpr double kGate_sigma = 3.0;  // sigmas from which a sample counts as off
constexpr double kNearestSample_m = 0.1;
constexpr double kPixelSigma_px =
    0.5;  // depth edges and slopes are where colour is within this [px]
constexpr double kFreeDirections = 1.0;  // of directions that depth does not determine

}  // namespace

DepthSamples::DepthSamples(const Camera& camera, const DepthImage& depth_m, int columns) {
  const int step = std::max(1, depth_m.width() / columns);
  for (int v = step / 2; v < depth_m.height(); v += step) {
    for (int u = step / 2; u < depth_m.width(); u += step) {
      const float d = depth_m.at(u, v);
      if (d > 0) p_camera_.push_back(camera.unproject(camera.undistort(Vec2(u, v)), d));
    }
  }
}

double DepthAgreement::possible_gain() const {
  const Mat6 damped = information + kFreeDirections * Mat6::Identity();
  return gradient.dot(SymmetricSystem6(damped).solve(gradient));
}

DepthAgreement compare_depth(const Camera& camera, const DepthSamples& before,
                             const DepthImage& current_depth_m, const SE3& T_current_before) {
  DepthAgreement result;
  for (const Vec3& p_before : before.points()) {
    const Vec3 p = T_current_before * p_before;
    if (p.z() < kNearestSample_m) continue;
    const Vec2 ideal_px = camera.project(p);
    if (!camera.sees(ideal_px)) continue;
    const Vec2 uv_px = camera.distort(ideal_px);
    const int u = static_cast<int>(std::lround(uv_px.x()));
    const int v = static_cast<int>(std::lround(uv_px.y()));
    if (!current_depth_m.contains(u, v)) continue;
    const double seen_m = current_depth_m.at(u, v);
    if (!(seen_m > 0)) continue;
    const Vec2 slope = depth_slope(current_depth_m, u, v).cast<double>();
    const double there_m = seen_m + slope.dot(uv_px - Vec2(u, v));
    const double noise_m = kinect_depth_sigma_m(p.z());
    const double sigma_m =
        std::sqrt(2 * noise_m * noise_m + kPixelSigma_px * kPixelSigma_px * slope.squaredNorm());
    const double r = (p.z() - there_m) / sigma_m;
    ++result.samples;
    if (std::abs(r) > kGate_sigma) {
      ++result.off;
      result.cost += kGate_sigma * kGate_sigma;
      continue;
    }
    result.cost += r * r;
    // Of depth minus the surface's depth at the pixel that the point moves to.
    const double iz = 1.0 / p.z();
    Vec3 normal(-slope.x() * camera.fx() * iz, -slope.y() * camera.fy() * iz, 1);
    normal.z() -= normal.x() * p.x() * iz + normal.y() * p.y() * iz;
    Vec6 j;
    j << normal, p.cross(normal);
    j /= sigma_m;
    result.information.noalias() += j * j.transpose();
    result.gradient += r * j;
  }
  return result;
}

}  // namespace ygslam
