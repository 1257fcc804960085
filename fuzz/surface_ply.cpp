#include <cmath>

#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "scene_file/read_surface.hpp"
#include "scene_picture/scene_picture.hpp"

namespace ygslam::fuzz {

/// What is accepted is finite, every triangle has its corners, and it can be drawn.
void surface_ply(std::string_view bytes) {
  const auto mesh = parse_surface_ply(bytes, "mesh.ply");
  if (!mesh.ok()) return;
  for (const SurfacePoint& point : mesh->vertices) {
    CHECK(point.p_world.allFinite() && point.normal_world.allFinite());
    CHECK(std::isfinite(point.label.probability));
  }
  for (const auto& triangle : mesh->triangles)
    for (const std::uint32_t corner : triangle) CHECK(corner < mesh->vertices.size());
  Overview options;
  options.width = 32;
  options.height = 24;
  const Viewpoint view = overview(mesh->vertices, Gravity{}, options);
  for (const PictureColour colour : {PictureColour::kClass, PictureColour::kHeight}) {
    PictureStyle style;
    style.colour = colour;
    (void)draw_points(mesh->vertices, view, Gravity{}, style);
    style.cut_above_m = 1;
    (void)draw_mesh(*mesh, view, Gravity{}, style);
  }
}

}  // namespace ygslam::fuzz
