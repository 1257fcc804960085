// The mesh with a node for each object, for viewers and game engines.
#pragma once

#include <filesystem>
#include <span>

#include "core/result.hpp"
#include "scene/scene.hpp"

namespace ygslam {

/// Binary glTF 2.0. A root node turns the scene's up into glTF's +Y; below it lie "background" and
/// a node for each object with its triangles (by majority of their corners' objects) and, in
/// `extras`, what objects.json says of it. Attributes: COLOR_0 (linear, as glTF demands), _CLASS,
/// _INSTANCE, _PROBABILITY. Triangles of objects that are not in the list are background.
/// @return kOutput naming the file; also beyond 4 GiB.
Status write_glb(const std::filesystem::path& path, const TriangleMesh& mesh,
                 std::span<const SceneObject> objects, const Gravity& gravity);

}  // namespace ygslam
