// The scene as ray-tracing structures, at one moment and the moment before (Embree inside).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "simulation/render/scene.hpp"
#include "simulation/simd_lanes.hpp"

namespace ygslam::sim {

/// What rays meet, side by side.
struct Hits16 {
  static constexpr std::int32_t kNothing = -1;
  Ints16 object;      ///< 0 the fixed scene, 1 + i mover i
  Ints16 triangle;    ///< of that object
  Floats16 distance;  ///< in lengths of the ray's direction
  Floats16 u, v;      ///< barycentric coordinates of corners 1 and 2
};

/// The surfaces at hits; of those that met nothing, something harmless.
struct Surfaces16 {
  Vectors16 normal;  ///< unit, world, smooth, on the geometric side
  Floats16 u, v;     ///< texture coordinates
  Ints16 material;
};

struct RayPacket {
  Vectors16 origin, direction;
  Floats16 reach;  ///< in lengths of the direction
  Ints16 active;   ///< -1 for a ray, 0 for none
};

class RayScene {
 public:
  /// The scene must outlive this.
  explicit RayScene(const Scene& scene);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// Puts everything where it is at t_s, and remembers where it was at before_s.
  void set_time(double t_s, double before_s, int threads);

  /// Nearest hits of rays that lie close together. Safe to call from several threads.
  /// @param on_fixed if given: the nearest hits on the fixed scene alone, found in the same way
  /// whether there are movers or not.
  void intersect(const RayPacket& rays, Hits16& hits, Hits16* on_fixed) const;
  /// The same without the movers.
  void intersect_fixed(const RayPacket& rays, Hits16& hits) const;
  /// Whether the fixed scene (the movers) lies within reach: -1 or 0; 0 for rays not active.
  void blocked_by_fixed(const RayPacket& rays, Ints16& blocked) const;
  void blocked_by_movers(const RayPacket& rays, Ints16& blocked) const;

  void surfaces(const Hits16& hits, Surfaces16& surfaces) const;
  /// Where the surface point of a lane was at before_s. @param p_world where it is now.
  [[nodiscard]] Vec3f point_before(const Hits16& hits, int lane, const Vec3f& p_world) const;
  [[nodiscard]] const Scene& scene() const { return scene_; }

 private:
  struct Embree;
  struct MoverState;
  /// Corners of a triangle, ready to be mixed: normal, texture coordinates, and the material in
  /// the bits of one number.
  struct alignas(32) Corners {
    float a[8], b[8], c[8];
  };
  static std::vector<Corners> corners_of(const Mesh& mesh);
  void move_mover(std::size_t i, double t_s, double before_s);

  const Scene& scene_;
  std::unique_ptr<Embree> embree_;
  std::vector<MoverState> movers_;
  std::vector<Corners> fixed_corners_;
};

}  // namespace ygslam::sim
