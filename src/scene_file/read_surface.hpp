// Surfaces back from files.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "scene/scene.hpp"

namespace ygslam {

/// Reads binary little-endian PLY: write_labelled_ply's and write_mesh_ply's, map.ply of a run, and
/// what other programs write of points (x y z; nx ny nz, red green blue, label, instance, prob
/// where there are) and of faces (vertex_indices or vertex_index; of more than three corners,
/// fans). Other properties are skipped; without a label points are SemanticClass::kUnknown. A cloud
/// is a mesh without triangles.
/// @param name for messages. @return kInput naming file and fault: another format, fewer or more
/// bytes than the header says, a number that is not finite, a point beyond 10^9 m, a face without
/// its vertex. Never
/// allocates more than the bytes can hold.
[[nodiscard]] Result<TriangleMesh> parse_surface_ply(std::string_view bytes,
                                                     const std::string& name);
[[nodiscard]] Result<TriangleMesh> read_surface_ply(const std::filesystem::path& path);

}  // namespace ygslam
