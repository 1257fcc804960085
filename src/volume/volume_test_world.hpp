// An analytic room for the tests: a box seen from inside, with spheres and smaller boxes in it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "core/rng.hpp"
#include "volume/volume.hpp"

namespace ygslam::volume_test {

struct Sphere {
  Vec3 middle;
  double radius_m = 0;
  SceneObjectId object = kNoSceneObject;
  Rgb8 colour{200, 40, 40};
  bool excluded = false;  ///< a mover
};
struct Cuboid {
  Vec3 low, high;
  SceneObjectId object = kNoSceneObject;
  Rgb8 colour{40, 200, 40};
  bool excluded = false;
};

struct Seen {
  double distance_m = std::numeric_limits<double>::infinity();  ///< along the ray
  SceneObjectId object = kNoSceneObject;
  Rgb8 colour;
  bool excluded = false;
};

struct World {
  Vec3 low = Vec3(-1.5, -1.2, -1.5), high = Vec3(1.5, 1.2, 1.5);  ///< of the room
  std::vector<Sphere> spheres;
  std::vector<Cuboid> cuboids;

  [[nodiscard]] Seen look(const Vec3& from, const Vec3& ray) const {
    Seen seen;
    const auto take = [&](double distance_m, SceneObjectId object, Rgb8 colour, bool excluded) {
      if (distance_m > 1e-6 && distance_m < seen.distance_m)
        seen = {distance_m, object, colour, excluded};
    };
    take(slabs(from, ray, low, high).second, kNoSceneObject, {180, 180, 160}, false);
    for (const Cuboid& c : cuboids) {
      const auto [in, out] = slabs(from, ray, c.low, c.high);
      if (in <= out) take(in, c.object, c.colour, c.excluded);
    }
    for (const Sphere& s : spheres) {
      const Vec3 to = from - s.middle;
      const double b = to.dot(ray) / ray.squaredNorm();
      const double c = (to.squaredNorm() - s.radius_m * s.radius_m) / ray.squaredNorm();
      if (b * b >= c) take(-b - std::sqrt(b * b - c), s.object, s.colour, s.excluded);
    }
    return seen;
  }

  /// Distance of a point in the room from the nearest surface, > 0 in free space.
  [[nodiscard]] double distance_m(const Vec3& p) const {
    double distance = std::min((p - low).minCoeff(), (high - p).minCoeff());
    for (const Sphere& s : spheres)
      distance = std::min(distance, (p - s.middle).norm() - s.radius_m);
    for (const Cuboid& c : cuboids) {
      const Vec3 outside = (c.low - p).cwiseMax(p - c.high);
      const double far = outside.cwiseMax(0).norm();
      distance = std::min(distance, far > 0 ? far : outside.maxCoeff());
    }
    return distance;
  }

 private:
  static std::pair<double, double> slabs(const Vec3& from, const Vec3& ray, const Vec3& low,
                                         const Vec3& high) {
    double in = -std::numeric_limits<double>::infinity(), out = -in;
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (low[axis] - from[axis]) / ray[axis];
      const double b = (high[axis] - from[axis]) / ray[axis];
      in = std::max(in, std::min(a, b));
      out = std::min(out, std::max(a, b));
    }
    return {in, out};
  }
};

inline Pinhole small_camera() { return {140, 140, 79.5, 59.5, 160, 120}; }

/// @param noise_seed of a Kinect's depth noise; none: exact depth.
inline DepthView render(const World& world, const SE3& T_world_camera,
                        std::optional<std::uint64_t> noise_seed = {},
                        const Pinhole& camera = small_camera()) {
  DepthView view;
  view.camera = camera;
  view.depth = Image<std::uint16_t>(camera.width, camera.height);
  view.colour = ColourImage(camera.width, camera.height);
  view.object = Image<std::uint8_t>(camera.width, camera.height);
  Rng rng(noise_seed.value_or(0));
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Vec3 ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1);
      const Seen seen = world.look(T_world_camera.t(), T_world_camera.R() * ray);
      double depth_m = seen.distance_m;
      if (noise_seed) {
        const double beyond = depth_m - 0.4;
        depth_m += rng.normal() * (0.0012 + 0.0019 * beyond * beyond);
      }
      view.depth.at(u, v) = static_cast<std::uint16_t>(std::lround(depth_m / DepthView::kUnit_m));
      view.colour.at(u, v) = seen.colour;
      if (seen.excluded) {
        view.object.at(u, v) = DepthView::kExcluded;
      } else if (seen.object != kNoSceneObject) {
        const auto found = std::find(view.objects.begin(), view.objects.end(), seen.object);
        view.object.at(u, v) = static_cast<std::uint8_t>(found - view.objects.begin() + 1);
        if (found == view.objects.end()) view.objects.push_back(seen.object);
      }
    }
  }
  return view;
}

/// A camera at `from` that looks at `to`, y down.
inline SE3 look_at(const Vec3& from, const Vec3& to, const Vec3& down = Vec3(0, 1, 0)) {
  const Vec3 z = (to - from).normalized();
  const Vec3 x = down.cross(z).normalized();
  Mat3 R;
  R << x, z.cross(x), z;
  return {R, from};
}

/// The object most of a triangle's corners show; where all differ, the first's.
inline SceneObjectId majority(const TriangleMesh& mesh,
                              const std::array<std::uint32_t, 3>& triangle) {
  const SceneObjectId a = mesh.vertices[triangle[0]].label.object;
  const SceneObjectId b = mesh.vertices[triangle[1]].label.object;
  const SceneObjectId c = mesh.vertices[triangle[2]].label.object;
  return b == c ? b : a;
}

/// The triangles most of whose corners show the object (kNoSceneObject: none), with their vertices.
inline TriangleMesh object_mesh(const TriangleMesh& mesh, SceneObjectId object) {
  constexpr std::uint32_t kUnnumbered = 0xffffffffU;
  std::vector<std::uint32_t> number(mesh.vertices.size(), kUnnumbered);
  TriangleMesh part;
  for (std::array<std::uint32_t, 3> triangle : mesh.triangles) {
    if (majority(mesh, triangle) != object) continue;
    for (std::uint32_t& corner : triangle) {
      if (number[corner] == kUnnumbered) {
        number[corner] = static_cast<std::uint32_t>(part.vertices.size());
        part.vertices.push_back(mesh.vertices[corner]);
      }
      corner = number[corner];
    }
    part.triangles.push_back(triangle);
  }
  return part;
}

}  // namespace ygslam::volume_test
