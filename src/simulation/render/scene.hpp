// What a world consists of when it is ready to be rendered: materials, things, people, light.
// The world frame has z up, metres; the floor lies at z = 0.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "simulation/surface/materials.hpp"

namespace ygslam::sim {

/// The pose of a moving thing at any time: a pure function, so that frames can be made in any
/// order.
using RigidMotion = std::function<SE3(double t_s)>;

/// The shape of something that deforms, at any time.
class DeformingBody {
 public:
  virtual ~DeformingBody() = default;
  /// Triangles and texture coordinates; they never change. Points and normals are left empty.
  [[nodiscard]] virtual const Mesh& topology() const = 0;
  /// Vertex positions [m] and smooth normals in the world at a time.
  virtual void shape_at(double t_s, std::vector<Vec3f>& p_world,
                        std::vector<Vec3f>& normals) const = 0;
  /// The pose of the body's root (pelvis) in the world.
  [[nodiscard]] virtual SE3 T_world_root(double t_s) const = 0;
};

/// Something that moves, or may: it has its own id in the truth masks.
struct Mover {
  std::string name;
  std::string class_name;        ///< "person", "chair", "box", ...
  std::uint8_t instance_id = 0;  ///< 1..255
  Mesh mesh;                     ///< frame of the thing; unused for a body
  RigidMotion T_world_object;    ///< empty for a body
  std::shared_ptr<const DeformingBody> body;

  [[nodiscard]] bool is_body() const { return body != nullptr; }
  [[nodiscard]] SE3 pose_at(double t_s) const {
    return is_body() ? body->T_world_root(t_s) : T_world_object(t_s);
  }
};

/// A thing of a class that people give names to, or a part of the room.
struct NamedThing {
  std::uint8_t id = 0;     ///< in View::things
  std::string class_name;  ///< COCO's, or "floor", "wall", "ceiling"
  bool is_group = false;   ///< several that touch
  std::size_t object = 0;  ///< 0: it is of the fixed scene; i + 1: of mover i
  NamedPart part;          ///< of the object's mesh; a body is one whole
};

/// A rectangular lamp that shines downwards from the ceiling.
struct AreaLight {
  Vec3f centre = Vec3f::Zero();  ///< [m]
  float half_x_m = 0.6F;
  float half_y_m = 0.3F;
  float power = 1;  ///< illuminance at 1 m below, in units of full white
};

/// Inside it only its own lights count: walls keep the others out.
struct LightZone {
  Eigen::Vector2f low = Eigen::Vector2f::Zero();
  Eigen::Vector2f high = Eigen::Vector2f::Zero();
  std::vector<std::uint16_t> lights;
};

struct Scene {
  MaterialLibrary materials;
  Mesh fixed;  ///< everything that never moves, in the world frame
  std::vector<Mover> movers;
  std::vector<AreaLight> lights;
  std::vector<LightZone> zones;
  float ambient = 0.38F;
  std::vector<NamedThing> things;  ///< in ascending order of ids; all floors have one id, and so on
  /// Id of the thing that each triangle belongs to, 0 = none; of the fixed scene, then each mover.
  std::vector<std::vector<std::uint8_t>> thing_ids;
};

}  // namespace ygslam::sim
