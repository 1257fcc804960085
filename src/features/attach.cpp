#include "features/attach.hpp"

#include "image/depth.hpp"

namespace ygslam {
namespace {

constexpr double kCornerRadius_px = 3;  // of the circle by which FAST finds a corner, in its level
constexpr double kLeastDepth_m = 0.05;
constexpr double kFar_m = 1e6;  // where only rotation shows

void set_depth(Feature& f, const SurfaceDepth& surface) {
  f.depth_m = surface.depth_m;
  f.on_plane = surface.on_plane;
}

/// Depth of a pixel of the colour image, at the time of that pixel, where the depth image was
/// taken at another.
SurfaceDepth depth_at_time_of_colour(const Camera& camera, const DepthImage& depth_m,
                                     const RollingShutter& shutter, const Eigen::Vector2f& uv_px,
                                     const Vec2& ideal_px) {
  const float there_m = depth_at(depth_m, uv_px.x(), uv_px.y());
  if (there_m <= 0) return {};
  const double dt_s = shutter.depth_time_s(uv_px.y()) - shutter.colour_time_s(uv_px.y());
  const Vec3 then = shutter.earlier(camera.unproject(ideal_px, there_m), -dt_s);
  if (then.z() < kLeastDepth_m) return {};
  const Vec2 then_px = camera.project(then);
  const Vec2 depth_uv_px = camera.distort(then_px);
  const Eigen::Vector2f at_px = depth_uv_px.cast<float>();
  const SurfaceDepth surface = surface_depth_at(depth_m, at_px.x(), at_px.y());
  if (surface.depth_m <= 0) return surface;
  const Vec3 p_cam = camera.unproject(then_px, surface.depth_m);
  return {static_cast<float>(shutter.earlier(p_cam, dt_s).z()), surface.on_plane};
}

}  // namespace

void attach_geometry(Features& features, const Camera& camera, const DepthImage& depth_m,
                     const PyramidScales& scales) {
  for (Feature& f : features.points) {
    f.ideal_px = camera.undistort(f.uv_px.cast<double>()).cast<float>();
    set_depth(f, surface_depth_at(depth_m, f.uv_px.x(), f.uv_px.y()));
    if (f.depth_m > 0) f.depth_slope = depth_slope(depth_m, f.uv_px.x(), f.uv_px.y());
    f.on_depth_edge = f.depth_m > 0 && on_depth_edge(depth_m, f.uv_px.x(), f.uv_px.y(), f.depth_m,
                                                     kCornerRadius_px * scales.of(f.octave));
  }
}

void move_to_middle_instant(Features& features, const Camera& camera, const DepthImage& depth_m,
                            const ReadOut& read_out) {
  if (read_out.times.is_global()) return;
  const RollingShutter shutter(camera.height(), read_out);
  for (Feature& f : features.points) {
    const Vec2 seen_px = camera.undistort(f.uv_px.cast<double>());
    f.ideal_px = seen_px.cast<float>();
    set_depth(f, shutter.depth_has_own_time() && !depth_m.empty()
                     ? depth_at_time_of_colour(camera, depth_m, shutter, f.uv_px, seen_px)
                     : surface_depth_at(depth_m, f.uv_px.x(), f.uv_px.y()));
    if (!shutter.is_rolling()) continue;
    const bool has_depth = f.depth_m > 0;
    const Vec3 p_cam = camera.unproject(seen_px, has_depth ? f.depth_m : kFar_m);
    const Vec3 p_middle = shutter.to_middle(p_cam, f.uv_px.y());
    if (p_middle.z() < kLeastDepth_m) continue;
    f.ideal_px = camera.project(p_middle).cast<float>();
    if (has_depth) f.depth_m = static_cast<float>(p_middle.z());
  }
}

void move_to_other_times(Features& features, const Camera& camera, const ReadOut& was,
                         const ReadOut& now) {
  const RollingShutter before(camera.height(), was);
  const RollingShutter after(camera.height(), now);
  for (Feature& f : features.points) {
    const bool has_depth = f.depth_m > 0;
    const Vec3 p_cam = camera.unproject(f.ideal_px.cast<double>(), has_depth ? f.depth_m : kFar_m);
    const Vec3 p_middle = after.to_middle(before.to_row(p_cam, f.uv_px.y()), f.uv_px.y());
    if (p_middle.z() < kLeastDepth_m) continue;
    f.ideal_px = camera.project(p_middle).cast<float>();
    if (has_depth) f.depth_m = static_cast<float>(p_middle.z());
  }
}

}  // namespace ygslam
