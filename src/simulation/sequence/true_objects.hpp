// The truth about the things of a world: which there are, and where each stood, when.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/time.hpp"
#include "geometry/camera.hpp"
#include "image/image.hpp"
#include "simulation/render/scene.hpp"

namespace ygslam::sim {

/// Fills Scene::things and Scene::thing_ids: first the fixed scene's, then those of things that
/// move, then people, so that leaving movers out changes no id. What comes after the 255th is none.
void number_things(Scene& scene);

/// The upright box around a thing. @param T_world_object its mesh's pose.
struct ThingBox {
  Vec3 centre = Vec3::Zero(), size_m = Vec3::Zero();
  double yaw_rad = 0;
};
[[nodiscard]] ThingBox box_of(const Mesh& mesh, const NamedPart& part, const SE3& T_world_object);

/// From a frame to the first in which it was over.
struct ShownSpan {
  Timestamp from, until;
  bool is_open = true;  ///< not over yet
};

/// A time at which a thing stood still.
struct ThingPlace {
  Timestamp from, until;  ///< first and last frame
  SE3 T_world_object;
  int frames = 0;  ///< that showed it
  /// When a third of its surface that faces the camera could be seen: of it there, and of what is
  /// behind it since it left.
  std::vector<ShownSpan> shown, shown_empty;
};

/// What a frame showed, without noise.
struct TrueView {
  const GreyImage& things;  ///< as in SimulatedFrame
  const DepthImage& depth_m;
  const Camera& camera;
  SE3 T_world_camera;
};

/// Watches where things stand, frame by frame.
class TrueObjects {
 public:
  void add(const Scene& scene, double t_s, Timestamp stamp, const TrueView& view);
  /// true_objects.json: all things but people and parts of the room; beside them what moves and has
  /// no name, as a door.
  [[nodiscard]] std::string json(const Scene& scene) const;

 private:
  std::map<std::uint8_t, std::vector<ThingPlace>> places_;
  std::map<std::size_t, std::vector<ThingPlace>> nameless_;  // by their place in Scene::movers
};

/// What Scene::things are called, as instances.json has it.
[[nodiscard]] std::string thing_names_json(const Scene& scene);

}  // namespace ygslam::sim
