// Small worlds with exact truth for the tests of this folder: points seen by a moving camera, and
// rendered frames of a textured wall with a textured board moving in front of it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/rng.hpp"
#include "geometry/camera.hpp"
#include "geometry/epipolar.hpp"
#include "geometry/geometry_testing.hpp"
#include "geometry/random_vector.hpp"
#include "image/depth.hpp"
#include "image/rgbd_frame.hpp"
#include "motion/labels.hpp"
#include "segment/segmenter.hpp"

namespace ygslam::motion_test {

inline const Camera& small_camera() {
  static const Camera camera = geometry_test::test_camera(260, 320, 240);
  return camera;
}

/// Matches of static points and of a cube with its own motion, between two frames.
struct PointWorld {
  std::vector<PointPair> flow;
  std::vector<std::uint8_t> moving;
};

struct PointWorldConfig {
  int static_points = 300;
  int cube_points = 60;
  Vec3 cube_step_m = Vec3::Zero();  // in the current camera's frame
  double noise_px = 0.2;
  SE3 T_current_previous = SE3(so3_exp({0.01, 0.015, 0.005}), Vec3(0.04, 0.01, 0.02));
};

inline PointWorld make_point_world(const PointWorldConfig& config, Rng& rng) {
  const Camera& camera = small_camera();
  PointWorld world;
  const auto add = [&](const Vec3& p_previous, const Vec3& step, std::uint8_t moving) {
    const Vec3 p_current = config.T_current_previous * p_previous + step;
    PointPair pair{camera.project(p_previous), camera.project(p_current)};
    // Noise bounded at 3 sigma, so that "below the threshold" holds for every point.
    const auto noise = [&] { return config.noise_px * std::clamp(rng.normal(), -3.0, 3.0); };
    pair.p2_px += drawn_vector<Vec2>(noise);
    world.flow.push_back(pair);
    world.moving.push_back(moving);
  };
  for (int i = 0; i < config.static_points; ++i) {
    const double depth_m = rng.uniform(1, 5);
    add(camera.unproject({rng.uniform(0, 319), rng.uniform(0, 239)}, depth_m), Vec3::Zero(), 0);
  }
  for (int i = 0; i < config.cube_points; ++i)
    add(random_in_box<3>(rng, {-0.4, -0.4, 1.5}, {0.4, 0.4, 2}), config.cube_step_m, 1);
  return world;
}

/// Smooth noise in [0, 255] with structure from 2 to 16 cells, the same for the same seed.
inline double texture(double x, double y, std::uint32_t seed) {
  const auto lattice = [&](int i, int j, std::uint32_t octave) {
    std::uint32_t h = seed * 2654435761U + octave * 40503U +
                      static_cast<std::uint32_t>(i) * 73856093U +
                      static_cast<std::uint32_t>(j) * 19349663U;
    h ^= h >> 16, h *= 0x7feb352dU, h ^= h >> 15, h *= 0x846ca68bU, h ^= h >> 16;
    return static_cast<double>(h & 0xffffU) / 65535.0;
  };
  double sum = 0;
  double scale = 1;
  double total = 0;
  for (std::uint32_t octave = 0; octave < 3; ++octave) {
    const double u = x / scale / 2;
    const double v = y / scale / 2;
    const int i = static_cast<int>(std::floor(u));
    const int j = static_cast<int>(std::floor(v));
    const auto smooth = [](double t) { return t * t * (3 - 2 * t); };
    const double a = smooth(u - i);
    const double b = smooth(v - j);
    sum += scale * std::lerp(std::lerp(lattice(i, j, octave), lattice(i + 1, j, octave), a),
                             std::lerp(lattice(i, j + 1, octave), lattice(i + 1, j + 1, octave), a),
                             b);
    total += scale;
    scale *= 2;
  }
  return 255.0 * sum / total;
}

/// A wall 4 m ahead that slants away to one side, a panel in its left part at 2.5 m, and a board in
/// front of it.
struct Scene {
  Camera camera = small_camera();
  SE3 T_camera_world;
  double slant = 0.6;  // of the wall, metres per metre
  Vec3 board_centre_m = Vec3(0, 0, 2);
  double board_half_m = 0.35;  // 0 = no board
};

struct Rendered {
  std::shared_ptr<const RgbdFrame> frame;
  GreyImage board;  // 1 on the board
};

inline Rendered render(const Scene& scene, std::uint32_t frame_id) {
  const Camera& camera = scene.camera;
  auto frame = std::make_shared<RgbdFrame>();
  frame->id = FrameId{frame_id};
  frame->stamp = Timestamp{static_cast<std::int64_t>(frame_id) * 33'333'333};
  frame->grey = GreyImage(camera.width(), camera.height());
  frame->depth_m = DepthImage(camera.width(), camera.height());
  Rendered out{nullptr, GreyImage(camera.width(), camera.height())};
  const SE3 T_world_camera = scene.T_camera_world.inverse();
  constexpr double kTexel_m = 0.012;
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const Vec3 ray_cam = camera.unproject(Vec2(u, v), 1.0);
      const Vec3 ray = T_world_camera.R() * ray_cam;
      const Vec3& origin = T_world_camera.t();
      const auto hit = [&](double z) { return (z - origin.z()) / ray.z(); };
      double depth =
          (4.0 - origin.z() + scene.slant * origin.x()) / (ray.z() - scene.slant * ray.x());
      std::uint32_t seed = 1;
      if (const double d = hit(2.5); (origin + d * ray).x() < -0.6) depth = d, seed = 2;
      Vec3 p = origin + depth * ray;
      if (const double d = hit(scene.board_centre_m.z()); scene.board_half_m > 0) {
        const Vec3 q = origin + d * ray - scene.board_centre_m;
        if (std::max(std::abs(q.x()), std::abs(q.y())) < scene.board_half_m)
          depth = d, seed = 3, p = q, out.board.at(u, v) = 1;
      }
      frame->depth_m.at(u, v) = static_cast<float>(depth);  // rays have z = 1
      frame->grey.at(u, v) =
          static_cast<std::uint8_t>(texture(p.x() / kTexel_m + 500, p.y() / kTexel_m + 500, seed));
    }
  }
  out.frame = std::move(frame);
  return out;
}

/// The strongest corner of every 8x8 cell (smaller eigenvalue of the gradient matrix; Shi and
/// Tomasi 1994), so that points repeat from frame to frame.
inline FeaturesPtr detect(const RgbdFrame& frame, const Camera& camera) {
  constexpr int kCell = 8;
  auto features = std::make_shared<Features>();
  const auto strength = [&](int u, int v) {
    double xx = 0;
    double xy = 0;
    double yy = 0;
    for (int dv = -2; dv <= 2; ++dv) {
      for (int du = -2; du <= 2; ++du) {
        const double gx = frame.grey.at(u + du + 1, v + dv) - frame.grey.at(u + du - 1, v + dv);
        const double gy = frame.grey.at(u + du, v + dv + 1) - frame.grey.at(u + du, v + dv - 1);
        xx += gx * gx, xy += gx * gy, yy += gy * gy;
      }
    }
    return 0.5 * (xx + yy - std::hypot(xx - yy, 2 * xy));
  };
  for (int v0 = kCell; v0 + 2 * kCell <= camera.height(); v0 += kCell) {
    for (int u0 = kCell; u0 + 2 * kCell <= camera.width(); u0 += kCell) {
      Feature best;
      for (int v = v0; v < v0 + kCell; ++v) {
        for (int u = u0; u < u0 + kCell; ++u) {
          const auto s = static_cast<float>(strength(u, v));
          if (s > best.response) best.response = s, best.uv_px = Eigen::Vector2f(u, v);
        }
      }
      if (best.response < 1000) continue;
      best.ideal_px = camera.undistort(best.uv_px.cast<double>()).cast<float>();
      best.depth_m = depth_at(frame.depth_m, best.uv_px.x(), best.uv_px.y());
      features->points.push_back(best);
    }
  }
  features->descriptors.resize(features->points.size());
  return features;
}

inline SegmentationPtr board_mask(const Rendered& rendered) {
  auto masks = std::make_shared<Segmentation>();
  masks->frame = rendered.frame->id;
  masks->stamp = rendered.frame->stamp;
  masks->instances.push_back({0, 0.9F, 0, 0, 1, 1});
  masks->ids = rendered.board;
  return masks;
}

}  // namespace ygslam::motion_test
