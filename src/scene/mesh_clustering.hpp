// A mesh with fewer triangles, for who looks at it from afar or over a thin line.
#pragma once

#include <vector>

#include "scene/scene.hpp"

namespace ygslam {

struct ClusteredMesh {
  double cell_m = 0;
  TriangleMesh mesh;                   ///< one vertex for each cell that has any
  std::vector<Eigen::Vector3i> cells;  ///< of the vertices, in ascending order of (z, y, x)
};

/// All vertices of a cell become one: their mean, with the class that most of them have. Triangles
/// with two corners in one cell vanish. Vertex clustering, Rossignac & Borrel 1993.
/// @param cell_m > 0; the same cells lie at the same places whatever the mesh.
[[nodiscard]] ClusteredMesh clustered_mesh(const TriangleMesh& mesh, double cell_m);

/// Without the triangles of pieces that hang together with less surface than this; the vertices
/// stay.
[[nodiscard]] ClusteredMesh without_specks(ClusteredMesh mesh, double least_m2);

}  // namespace ygslam
