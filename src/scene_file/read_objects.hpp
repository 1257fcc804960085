// The things of a scene, back from objects.json.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "scene/scene.hpp"

namespace ygslam {

struct SceneObjects {
  std::vector<SceneObject> objects;
  Gravity gravity;
};

/// Reads what write_objects writes. @param name for messages. @return kInput naming file and fault.
[[nodiscard]] Result<SceneObjects> parse_objects(std::string_view text, const std::string& name);
[[nodiscard]] Result<SceneObjects> read_objects(const std::filesystem::path& path);

}  // namespace ygslam
