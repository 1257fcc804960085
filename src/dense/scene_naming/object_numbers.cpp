#include "dense/scene_naming/object_numbers.hpp"

#include <algorithm>
#include <map>

namespace ygslam {

void number_objects(StaticScene& scene) {
  std::stable_partition(scene.objects.begin(), scene.objects.end(), [](const SceneObject& object) {
    return object.state != ObjectState::kCandidate;
  });
  std::map<SceneObjectId, SceneObjectId> numbers{{kNoSceneObject, kNoSceneObject}};
  for (SceneObject& object : scene.objects) {
    const SceneObjectId number{static_cast<std::uint16_t>(numbers.size())};
    numbers.emplace(object.id, number);
    object.id = number;
  }
  for (SurfacePoint& vertex : scene.mesh.vertices)
    vertex.label.object = numbers.at(vertex.label.object);
  for (SpaceCell& cell : scene.space.cells) cell.label.object = numbers.at(cell.label.object);
}

}  // namespace ygslam
