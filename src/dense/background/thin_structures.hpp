// What views saw before the mesh: the legs of chairs, the arms of lamps, too thin for voxels.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dense/background/mesh_view.hpp"
#include "dense/dense_map.hpp"

namespace ygslam {

class ThinStructures {
 public:
  /// @param mesh of the map whose views these are.
  ThinStructures(const std::vector<DenseMap::PlacedView>& views, MeshView& mesh);

  /// Draws them where they stand before the surface. @param wanted not 0: draw this pixel.
  void draw(const FrameGeometry& geometry, const GreyImage& wanted, SurfaceImage& surface) const;
  [[nodiscard]] std::size_t size() const { return points_.size(); }

 private:
  std::vector<ColouredPoint> points_;
};

}  // namespace ygslam
