// What is written and drawn on pictures of the scene.
#pragma once

#include <span>
#include <string>

#include "scene_picture/scene_picture.hpp"

namespace ygslam {

/// The picture with its legend in a column at the right; without a legend the picture as it is.
/// What does not fit is counted in the last line.
[[nodiscard]] ColourImage with_legend(const ScenePicture& picture);

/// Draws the edges of the boxes and the names of all objects but absent ones and candidates, in the
/// colours of their classes or of themselves; nothing hides them.
void draw_boxes(ColourImage& image, std::span<const SceneObject> objects, const Viewpoint& view,
                PictureColour by = PictureColour::kObject);
/// The corners of the boxes that draw_boxes draws, in the world.
[[nodiscard]] std::vector<Vec3> box_corners(std::span<const SceneObject> objects);

/// Draws a line through positions in the world [m], as a camera's path; nothing hides it.
void draw_path(ColourImage& image, std::span<const Vec3> path_world, const Viewpoint& view,
               Rgb8 colour);

struct CaptionedImage {
  const ColourImage* image;  ///< not null
  std::string caption;
};
/// Pictures side by side, each under its caption; smaller ones lie on white.
[[nodiscard]] ColourImage side_by_side(std::span<const CaptionedImage> pictures);

}  // namespace ygslam
