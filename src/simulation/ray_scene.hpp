// The scene as ray-tracing structures, at one moment and the moment before (Embree inside).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "simulation/scene.hpp"

namespace ygslam::sim {

/// What a ray meets: object 0 is the fixed scene, 1 + i mover i.
struct RayHit {
  static constexpr std::uint16_t kNothing = 0xffff;
  float distance = 0;  ///< in lengths of the ray's direction
  std::uint32_t triangle = 0;
  float u = 0, v = 0;  ///< barycentric coordinates of corners 1 and 2
  std::uint16_t object = kNothing;
};

/// A surface at a hit.
struct SurfacePoint {
  Vec3f normal = Vec3f::UnitZ();  ///< world, smooth, on the geometric side
  Vec2f uv = Vec2f::Zero();
  MaterialId material = 0;
};

enum class RayTarget { kAll, kFixedOnly };
inline constexpr int kPacket = 16;

struct RayPacket {
  std::array<Vec3f, kPacket> origin;
  std::array<Vec3f, kPacket> direction;
  std::array<float, kPacket> reach;  ///< in lengths of the direction
  std::array<bool, kPacket> active{};
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

  using Hits = std::array<RayHit, kPacket>;
  using Flags = std::array<bool, kPacket>;
  /// Nearest hits of rays that lie close together. Safe to call from several threads.
  /// @param on_fixed if given: the nearest hits on the fixed scene alone.
  void intersect(const RayPacket& rays, RayTarget target, Hits& hits, Hits* on_fixed) const;
  /// Whether the fixed scene lies within reach, and whether a mover does; the second is asked only
  /// of rays in `ask_movers` that the fixed scene leaves through.
  void occluded(const RayPacket& rays, const Flags& ask_movers, Flags& by_fixed,
                Flags& by_mover) const;

  [[nodiscard]] SurfacePoint surface(const RayHit& hit) const;
  /// Where the surface point was at before_s. @param p_world where it is now.
  [[nodiscard]] Vec3f point_before(const RayHit& hit, const Vec3f& p_world) const;
  [[nodiscard]] const Scene& scene() const { return scene_; }

 private:
  struct Embree;
  struct MoverState;
  void update_mover(std::size_t i, double t_s, double before_s);

  const Scene& scene_;
  std::unique_ptr<Embree> embree_;
  std::vector<MoverState> movers_;
};

}  // namespace ygslam::sim
