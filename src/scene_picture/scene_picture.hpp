// Pictures of the scene, drawn without a display.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "scene_picture/viewpoint.hpp"

namespace ygslam {

enum class PictureColour { kSurface, kClass, kObject, kHeight };

struct PictureStyle {
  PictureColour colour = PictureColour::kSurface;
  /// What lies higher over the floor is left out; where this is finite the ceiling is, too.
  double cut_above_m = std::numeric_limits<double>::infinity();
  bool shows_backs = false;  ///< else surfaces seen from behind are left out: one looks into rooms
  double point_m = 0.02;     ///< side of a drawn point
  Rgb8 background{255, 255, 255};
};

/// What a colour of the picture stands for.
struct LegendEntry {
  std::string name;
  Rgb8 colour;
  double share = 0;  ///< of the picture's area
};

struct ScenePicture {
  ColourImage image;
  PictureColour colour = PictureColour::kSurface;
  /// Classes or objects in sight, the largest first; for heights the lowest and the highest. Empty
  /// for PictureColour::kSurface.
  std::vector<LegendEntry> legend;
};

/// @param objects names for the legend; may be empty.
[[nodiscard]] ScenePicture draw_mesh(const TriangleMesh& mesh, const Viewpoint& view,
                                     const Gravity& gravity, const PictureStyle& style = {},
                                     std::span<const SceneObject> objects = {});
[[nodiscard]] ScenePicture draw_points(std::span<const SurfacePoint> points, const Viewpoint& view,
                                       const Gravity& gravity, const PictureStyle& style = {},
                                       std::span<const SceneObject> objects = {});

/// From blue (0) over green to yellow (1).
[[nodiscard]] Rgb8 height_colour(double share);

}  // namespace ygslam
