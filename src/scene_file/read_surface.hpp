// Surfaces back from files.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "scene/scene.hpp"

namespace ygslam {

/// Reads PLY, binary or text: write_labelled_ply's and write_mesh_ply's, map.ply of a run, and what
/// other programs write of points (x y z; nx ny nz, red green blue, label, instance, prob where
/// there are) and of faces (vertex_indices or vertex_index; of more than three corners, fans).
/// Other properties and elements are skipped; without a label points are SemanticClass::kUnknown,
/// without colours grey. A cloud is a mesh without triangles. What was understood otherwise than
/// our own files is logged.
/// @param name for messages. @return kInput naming file and fault: fewer or more bytes than the
/// header says, a number that is not finite, a point beyond 10^9 m, a face without its vertex.
/// Never allocates more than the bytes can hold, times a small factor.
[[nodiscard]] Result<TriangleMesh> parse_surface_ply(std::string_view bytes,
                                                     const std::string& name);
[[nodiscard]] Result<TriangleMesh> read_surface_ply(const std::filesystem::path& path);

}  // namespace ygslam
