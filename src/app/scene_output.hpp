// Writes a scene for other programs.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "scene/scene.hpp"

namespace ygslam {

/// All files of docs/exports.md; warns of a scene without content. @return kOutput.
[[nodiscard]] Status write_scene(const std::filesystem::path& folder, const StaticScene& scene);

}  // namespace ygslam
