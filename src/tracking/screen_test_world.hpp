// A room with a screen in it, as points and depth: what is on the screen moves in its plane while
// the camera moves otherwise, or stands.
#pragma once

#include <memory>
#include <vector>

#include "core/rng.hpp"
#include "geometry/geometry_testing.hpp"
#include "geometry/random_vector.hpp"
#include "image/depth.hpp"
#include "tracking/screen_finder.hpp"

namespace ygslam::tracking_test {

inline constexpr double kScreenAway_m = 1.5;  // away, 1.2 x 0.7 m
inline constexpr double kBackWall_m = 3.5;    // with a pillar that stands 0.5 m out of it

inline bool is_on_screen(const Vec3& p_world) {
  return std::abs(p_world.x()) < 0.6 && std::abs(p_world.y()) < 0.35;
}

/// The nearest surface on a ray of the world.
inline Vec3 surface_on_ray(const Vec3& origin, const Vec3& direction) {
  Vec3 on_screen = origin + direction * ((kScreenAway_m - origin.z()) / direction.z());
  if (is_on_screen(on_screen)) return on_screen;
  Vec3 on_pillar = origin + direction * ((kBackWall_m - 0.5 - origin.z()) / direction.z());
  if (on_pillar.x() > 0.9 && on_pillar.x() < 1.5) return on_pillar;
  Vec3 on_floor = origin + direction * ((1.0 - origin.y()) / direction.y());
  if (direction.y() > 0 && on_floor.z() < kBackWall_m) return on_floor;
  return origin + direction * ((kBackWall_m - origin.z()) / direction.z());
}

class ScreenRoom {
 public:
  /// @return the depth image from a camera, with a Kinect's noise.
  [[nodiscard]] FramePtr see(const SE3& T_world_camera, std::uint64_t seed) const {
    Rng rng(seed);
    auto frame = std::make_shared<RgbdFrame>();
    frame->depth_m = DepthImage(camera_.width(), camera_.height());
    for (int v = 0; v < camera_.height(); ++v)
      for (int u = 0; u < camera_.width(); ++u) {
        const Vec3 ray = T_world_camera.R() * camera_.unproject(Vec2(u, v), 1);
        const double z = (T_world_camera.inverse() * surface_on_ray(T_world_camera.t(), ray)).z();
        frame->depth_m.at(u, v) = static_cast<float>(rng.normal(z, kinect_depth_sigma_m(z)));
      }
    return frame;
  }

  struct View {
    FrameFeatures seen;
    std::vector<ScreenFinder::Point> points;
  };
  /// @param moved_m how far what the screen shows has moved since its points were mapped.
  [[nodiscard]] View points(const SE3& T_world_camera, const Vec3& moved_m) const {
    View view;
    view.seen.frame = see(T_world_camera, 2);
    Rng rng(7);
    auto features = std::make_shared<Features>();
    while (features->size() < 500) {
      const Vec2 px =
          random_in_box<2>(rng, {5, 5}, {camera_.width() - 5.0, camera_.height() - 5.0});
      const Vec3 p_world =
          surface_on_ray(T_world_camera.t(), T_world_camera.R() * camera_.unproject(px, 1));
      const bool on_screen = std::abs(p_world.z() - kScreenAway_m) < 1e-6 && is_on_screen(p_world);
      Feature f;
      f.uv_px = f.ideal_px = (px + random_normals<2>(rng, 0.15)).cast<float>();
      f.depth_m = depth_at(view.seen.frame->depth_m, px.x(), px.y());
      features->points.push_back(f);
      features->descriptors.emplace_back();
      const auto index = static_cast<std::uint32_t>(features->size() - 1);
      view.points.push_back({index, on_screen ? Vec3(p_world - moved_m) : p_world, true});
    }
    view.seen.features = std::move(features);
    return view;
  }
  [[nodiscard]] const Camera& camera() const { return camera_; }
  /// Of a camera at the origin.
  void show_first_frame(ScreenFinder& finder) const {
    FrameFeatures first;
    first.frame = see(SE3(), 1);
    finder.remember(first, SE3());
  }

  /// The pose by all points, as tracking has it, and what the finder says of it.
  struct Answer {
    SE3 T_camera_world;
    ScreenFinder::Output out;
  };
  [[nodiscard]] Answer ask(const SE3& T_world_camera, const Vec3& moved_m) const {
    const View view = points(T_world_camera, moved_m);
    const PyramidScales scales(8, 1.2);
    std::vector<PoseObservation> all;
    for (const auto& point : view.points)
      all.push_back(
          {point.p_world, observation_of(view.seen.features->points[point.feature], 1, {}, 1)});
    const auto pose = solve_pose(camera_, T_world_camera.inverse(), all, {});
    CHECK(pose, "points agree");
    ScreenFinder finder(camera_, scales, {});
    show_first_frame(finder);
    const ScreenFinder::Place place{view.seen, pose->T_camera_world,
                                    pose->T_camera_world.inverse()};
    return {pose->T_camera_world, finder.step(place, 0, [&] { return view.points; })};
  }

 private:
  Camera camera_ = geometry_test::test_camera(260, 320, 240);
};

inline const SE3 kCameraMoved(so3_exp(Vec3(0.002, -0.004, 0.001)), Vec3(0.02, 0.01, 0.015));

}  // namespace ygslam::tracking_test
