// Surfaces with labels as files of points and triangles. All are written atomically and in pieces;
// every number in them must be finite.
#pragma once

#include <filesystem>
#include <span>

#include "core/result.hpp"
#include "scene/scene.hpp"

namespace ygslam {

/// Binary little-endian PLY: x y z nx ny nz (float), red green blue (uchar), label instance
/// (uint16: SemanticClass and SceneObjectId), prob (float); a comment names each class in it.
/// @return kOutput naming the file.
Status write_labelled_ply(const std::filesystem::path& path, std::span<const SurfacePoint> points);

/// The same points, and triangles as lists vertex_indices (uchar, int).
/// @return kOutput naming the file; also beyond 2^31 vertices.
Status write_mesh_ply(const std::filesystem::path& path, const TriangleMesh& mesh);

/// Binary PCD 0.7: x y z rgb (float) label (uint32), which is pcl::PointXYZRGBL.
/// @return kOutput naming the file.
Status write_pcd(const std::filesystem::path& path, std::span<const SurfacePoint> points);

}  // namespace ygslam
