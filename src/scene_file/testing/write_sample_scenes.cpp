// write_sample_scenes FOLDER: sample scenes in every format, each in a folder of its own beside
// truth.json, the scene as it lies in memory, for readers of other makers to compare with.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "io/testing/temp_folder.hpp"
#include "scene/testing/sample_scene.hpp"
#include "scene_file/export_scene.hpp"
#include "scene_file/objects_file.hpp"

namespace ygslam {
namespace {

using Json = nlohmann::json;
using testing::sample_scene;
using testing::SampleScene;

Json point_json(const SurfacePoint& point) {
  return {point.p_world.x(),
          point.p_world.y(),
          point.p_world.z(),
          point.normal_world.x(),
          point.normal_world.y(),
          point.normal_world.z(),
          point.colour.r,
          point.colour.g,
          point.colour.b,
          static_cast<int>(point.label.semantic_class),
          static_cast<int>(point.label.object),
          point.label.probability};
}

Json cell_json(const SpaceCell& cell) {
  return {cell.index.x(),
          cell.index.y(),
          cell.index.z(),
          static_cast<int>(cell.state),
          cell.log_odds,
          cell.colour.r,
          cell.colour.g,
          cell.colour.b,
          static_cast<int>(cell.label.semantic_class),
          static_cast<int>(cell.label.object),
          cell.label.probability};
}

Json vector_json(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

// The scene as it lies in memory.
Json scene_json(const SampleScene& scene) {
  Json json = {
      {"cell_m", scene.space.cell_m},     {"up_world", vector_json(scene.gravity.up_world)},
      {"floor_m", scene.gravity.floor_m}, {"cloud", Json::array()},
      {"vertices", Json::array()},        {"triangles", scene.mesh.triangles},
      {"cells", Json::array()},           {"objects", Json::array()}};
  for (const SurfacePoint& point : scene.cloud) json["cloud"].push_back(point_json(point));
  for (const SurfacePoint& point : scene.mesh.vertices)
    json["vertices"].push_back(point_json(point));
  for (const SpaceCell& cell : scene.space.cells) json["cells"].push_back(cell_json(cell));
  for (const SceneObject& object : scene.objects) {
    const Mat3& R = object.box.T_world_box.R();
    json["objects"].push_back(
        {{"id", static_cast<int>(object.id)},
         {"label", static_cast<int>(object.semantic_class)},
         {"state", object_state_name(object.state)},
         {"centre_m", vector_json(object.box.T_world_box.t())},
         {"axes", {vector_json(R.col(0)), vector_json(R.col(1)), vector_json(R.col(2))}},
         {"size_m", vector_json(object.box.size_m)}});
  }
  return json;
}

Status write_samples(const std::filesystem::path& folder) {
  SampleScene empty;
  empty.gravity.up_world = Vec3(0, -1, 0);
  for (const auto& [name, scene] :
       {std::pair{"level", sample_scene(Vec3(0, 0, 1))},
        std::pair{"camera", sample_scene(Vec3(0, -1, 0))},
        std::pair{"tilted", sample_scene(Vec3(0.1, -1, 0.2))}, std::pair{"empty", empty}}) {
    const std::filesystem::path out = folder / name;
    testing::write(out / "truth.json", scene_json(scene).dump());
    Status written = export_scene(
        out, {scene.cloud, scene.mesh, scene.space, scene.objects, scene.gravity, GridOptions{}});
    if (!written.ok()) return written;
  }
  return Ok{};
}

}  // namespace
}  // namespace ygslam

int main(int count, char** arguments) {
  if (count != 2) return 2;
  const ygslam::Status written = ygslam::write_samples(arguments[1]);
  if (!written.ok()) std::fprintf(stderr, "error: %s\n", written.error().message.c_str());
  return written.ok() ? 0 : 1;
}
