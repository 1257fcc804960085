// A recording painted in milliseconds, for tests of threads and messages: any frames that can be
// tracked will do there, and no renderer has to be built. Two walls of chequers at different
// depths, an exact camera path, and a panel that wanders across.
#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <span>

#include "core/rng.hpp"
#include "geometry/geometry_testing.hpp"
#include "system/testing/trial.hpp"

namespace ygslam::system_test {

struct PaintedOptions {
  double seconds = 1;
  double fps = 20;
  bool mover = false;  ///< with id 1 in the masks
};

/// Upright rectangles that face the first camera; of each only the nearest is seen.
struct Panel {
  double depth_m = 0;
  double left_m = 0, right_m = 0;
  std::uint64_t seed = 0;
};

/// Grey of a point of a panel: squares of 7 cm, each halved by a diagonal, so that corners abound.
inline std::uint8_t painted_grey(const Panel& panel, double x_m, double y_m) {
  constexpr double kSquare_m = 0.07;
  const double x = x_m / kSquare_m, y = y_m / kSquare_m;
  const auto column = static_cast<std::int64_t>(std::floor(x));
  const auto row = static_cast<std::int64_t>(std::floor(y));
  const bool upper = (x - std::floor(x)) + (y - std::floor(y)) < 1;
  Rng rng(panel.seed * 1000003 +
          static_cast<std::uint64_t>(column * 8191 + row * 2 + (upper ? 1 : 0)));
  return static_cast<std::uint8_t>(40 + rng.below(176));
}

inline SE3 painted_pose(double t_s) {
  const double phase = 2 * std::numbers::pi * t_s / 4;
  const Vec3 angle(0.02 * std::sin(phase), 0.03 * std::sin(1.3 * phase),
                   0.02 * std::sin(0.7 * phase));
  return SE3::exp((Vec6() << Vec3(0.12 * std::sin(phase), 0.08 * (1 - std::cos(phase)),
                                  0.05 * std::sin(0.5 * phase)),
                   angle)
                      .finished());
}

/// What the camera sees at T_world_camera: colour, grey and depth of the frame, the mover's id in
/// `ids`.
inline void paint(const Camera& camera, const SE3& T_world_camera,
                  std::span<const Panel> nearest_first, bool mover, RgbdFrame& frame,
                  GreyImage& ids) {
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const Vec3 ray_world = T_world_camera.R() * camera.unproject(Vec2(u, v), 1);
      for (const Panel& panel : nearest_first) {
        const double depth_m = (panel.depth_m - T_world_camera.t().z()) / ray_world.z();
        const Vec3 p_world = T_world_camera.t() + depth_m * ray_world;
        if (p_world.x() < panel.left_m || p_world.x() > panel.right_m) continue;
        const bool moves = mover && &panel == nearest_first.data();
        const std::uint8_t grey = painted_grey(panel, p_world.x() - panel.left_m, p_world.y());
        frame.grey.at(u, v) = grey;
        frame.colour.at(u, v) = {grey, grey, grey};
        frame.depth_m.at(u, v) = static_cast<float>(depth_m);
        ids.at(u, v) = moves ? 1 : 0;
        break;
      }
    }
  }
}

inline Recording painted_recording(const PaintedOptions& options) {
  CameraConfig all_rows_at_once = geometry_test::test_camera(250, 320, 240).config();
  all_rows_at_once.shutter_known = true;
  Recording recording{Camera(all_rows_at_once), {}, {}, {}};
  const int width = recording.camera.width(), height = recording.camera.height();
  const auto count = static_cast<std::uint32_t>(std::lround(options.seconds * options.fps));
  for (std::uint32_t i = 0; i < count; ++i) {
    const double t_s = i / options.fps;
    std::vector<Panel> panels = {{1.8, -9, -0.3, 1}, {2.6, -9, 9, 2}};
    if (options.mover) panels.insert(panels.begin(), {1.2, 0.1 + 0.4 * t_s, 0.4 + 0.4 * t_s, 3});
    auto frame = std::make_shared<RgbdFrame>();
    frame->id = FrameId{i};
    frame->stamp.ns = 1'000'000'000 + std::llround(1e9 * t_s);
    frame->colour = ColourImage(width, height);
    frame->grey = GreyImage(width, height);
    frame->depth_m = DepthImage(width, height);
    GreyImage ids(width, height);
    const SE3 T_world_camera = painted_pose(t_s);
    paint(recording.camera, T_world_camera, panels, options.mover, *frame, ids);
    recording.truth.push_back({frame->stamp, T_world_camera});
    recording.frames.push_back(std::move(frame));
    recording.ids.push_back(std::move(ids));
  }
  return recording;
}

}  // namespace ygslam::system_test
