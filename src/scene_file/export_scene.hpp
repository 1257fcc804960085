// All files of a scene at once.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include "core/result.hpp"
#include "scene_file/occupancy_grid.hpp"

namespace ygslam {

/// What there is to write; everything must outlive the call.
struct SceneContent {
  std::span<const SurfacePoint> cloud;
  const TriangleMesh& mesh;
  const SpaceCells& space;
  std::span<const SceneObject> objects;
  Gravity gravity;
  GridOptions grid;
};

struct SceneFileKind {
  std::string_view name;   ///< "ply", for the command line
  std::string_view files;  ///< "cloud.ply"; several are separated by a space
  std::string_view what;   ///< half a sentence for help
  Status (*write)(const std::filesystem::path& folder, const SceneContent& scene);
};
[[nodiscard]] std::span<const SceneFileKind> scene_file_kinds();

/// Writes every kind into the folder, which must exist. An empty scene gives empty, valid files.
/// @return kOutput naming the first file that could not be written; those before it are there.
Status export_scene(const std::filesystem::path& folder, const SceneContent& scene);

}  // namespace ygslam
