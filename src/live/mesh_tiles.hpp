// A mesh as markers, tile by tile: a cube of 1 m of the world is a list of triangles, or one for
// each class in it. Of a mesh that grows those tiles are told anew that look different by now.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "bag/ros_messages.hpp"
#include "scene/mesh_clustering.hpp"

namespace ygslam {

inline constexpr int kTile_m = 1;

/// So coarse that it has at most most_triangles, with a whole number of cells along a tile.
/// @param finest_cell_m a lower limit; where a world grows the last result's, so that it does not
/// flicker between two.
[[nodiscard]] ClusteredMesh reduced_mesh(const TriangleMesh& mesh, double finest_cell_m,
                                         std::size_t most_triangles);

struct MeshTile {
  std::uint32_t number = 0;  ///< the same for the same place, from 1
  /// Add what is there, by namespace and number, and delete what was there before and is not now.
  /// Whoever missed an earlier message of the tile is up to date with the newest.
  std::vector<ros::Marker> markers;
};

class MeshTiles {
 public:
  enum class Colours {
    kSeen,    ///< the camera's: one marker in "mesh", a colour for each corner
    kClasses  ///< a marker for each class, its name the namespace, in the class's colour
  };
  explicit MeshTiles(Colours colours) : colours_(colours) {}

  /// The tiles that look different from when they were last told.
  [[nodiscard]] std::vector<MeshTile> changed(const ClusteredMesh& mesh, ros::Time stamp);
  /// Whoever listens forgets all: so do we.
  void clear() { told_.clear(); }

 private:
  struct Look {
    std::vector<SurfacePoint> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
  };
  using Place = std::array<int, 3>;
  struct Told {
    std::uint32_t number = 0;
    Look look;
    std::set<SemanticClass> classes;  // that were ever there
  };
  [[nodiscard]] static std::map<Place, Look> looks(const ClusteredMesh& mesh);
  [[nodiscard]] bool is_same(const Look& a, const Look& b, double cell_m) const;
  [[nodiscard]] std::vector<ros::Marker> markers(Told& told, ros::Time stamp) const;

  Colours colours_;
  std::map<Place, Told> told_;
};

}  // namespace ygslam
