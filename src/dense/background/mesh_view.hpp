// What of a mesh stands behind chosen pixels of an image: a z-buffer for a few pixels of each
// frame.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "dense/background/frame_geometry.hpp"
#include "image/image.hpp"
#include "scene/scene.hpp"

namespace ygslam {

/// Of the wanted pixels; 0 depth where no surface that faces the camera lies behind the pixel.
struct SurfaceImage {
  DepthImage depth_m;
  ColourImage colour;  ///< of the mesh
};

/// Keeps the mesh; draw() may be called for frame after frame.
class MeshView {
 public:
  explicit MeshView(TriangleMesh mesh);

  /// @param wanted not 0: draw this pixel; of the camera's size.
  [[nodiscard]] SurfaceImage draw(const FrameGeometry& geometry, const GreyImage& wanted);

 private:
  struct Corner {
    std::uint32_t drawing = 0;  // that it was projected for
    bool in_front = false;
    Eigen::Vector2f uv_px;
    float inverse_z = 0;
  };
  struct Bunch {  // of triangles that lie together
    std::uint32_t first = 0, last = 0;
    Eigen::Vector3f middle_world;
    float radius_m = 0;
  };
  struct Area;
  const Corner& corner(std::uint32_t vertex, const FrameGeometry& geometry);
  void fill(const std::array<std::uint32_t, 3>& triangle, const FrameGeometry& geometry,
            const Area& area, SurfaceImage& image);
  /// @param shares of the triangle's corners in it.
  [[nodiscard]] Rgb8 mixed_colour(const std::array<std::uint32_t, 3>& triangle,
                                  const Eigen::Vector3f& shares) const;

  TriangleMesh mesh_;
  std::vector<Bunch> bunches_;
  std::vector<Corner> corners_;
  std::uint32_t drawing_ = 0;
};

}  // namespace ygslam
