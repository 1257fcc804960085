// Where two objects meet, or an object and what it stands on, voxels are too coarse to tell which
// vertex of a mesh is of which: there each vertex asks the pixels that show it.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "geometry/se3.hpp"
#include "scene/scene.hpp"
#include "volume/depth_view.hpp"
#include "volume/prepared_view.hpp"

namespace ygslam {

/// Labels of a mesh anew where different ones meet: by a vote of the pixels that show a vertex.
class EdgeLabels {
 public:
  /// @param mesh with objects' numbers: of its vertices those are asked about that have one of
  /// another number beside them, or beside one next to them.
  /// @param preparation which depth is believed.
  EdgeLabels(const TriangleMesh& mesh, const PreparationConfig& preparation);

  [[nodiscard]] bool empty() const { return vertices_.empty(); }
  /// Counts what the pixels at their places show, where the depth is theirs.
  void add_votes(const DepthView& view, const SE3& T_world_camera);
  /// Gives each the number that most votes are for, the lowest of several, none only if more are
  /// for that; what nobody saw stays as it was. The rule of SurfaceBlock::label().
  void write_labels(TriangleMesh& mesh) const;

 private:
  struct Vertex {
    std::uint32_t index = 0;  // in the mesh
    Vec3 p_world = Vec3::Zero();
    int votes_for_none = 0;
    std::vector<std::pair<SceneObjectId, int>> votes;  // ascending
  };
  NoiseModel noise_;
  double max_depth_m_;
  std::vector<Vertex> vertices_;
};

}  // namespace ygslam
