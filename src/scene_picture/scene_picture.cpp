#include "scene_picture/scene_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "scene/class_colour.hpp"
#include "scene/floor_frame.hpp"
#include "scene_picture/raster.hpp"

namespace ygslam {
namespace {

// Heights over the floor that colours stretch over [m].
struct HeightRange {
  double low_m = 0, high_m = 1;
};

HeightRange height_range(std::span<const SurfacePoint> points, const Vec3& up, double floor_m,
                         double cut_above_m) {
  std::vector<double> heights;
  const std::size_t step = points.size() / 100'000 + 1;
  for (std::size_t i = 0; i < points.size(); i += step) {
    const double height = points[i].p_world.cast<double>().dot(up) - floor_m;
    heights.push_back(std::min(height, cut_above_m));
  }
  if (heights.empty()) return {};
  std::sort(heights.begin(), heights.end());
  const std::size_t strays = heights.size() / 200;
  const double low = heights[strays], high = heights[heights.size() - 1 - strays];
  return {low, std::max(high, low + 0.01)};
}

class Painter {
 public:
  Painter(std::span<const SurfacePoint> points, const Viewpoint& view, const Gravity& gravity,
          const PictureStyle& style)
      : raster_(view, style.background),
        style_(style),
        R_camera_world_(view.T_camera_world.R().cast<float>()),
        t_camera_world_(view.T_camera_world.t().cast<float>()),
        up_(gravity.up_world.normalized().cast<float>()),
        floor_m_(gravity.floor_m),
        range_(height_range(points, up_.cast<double>(), floor_m_, style.cut_above_m)) {
    // Light from behind the camera's shoulder, a little from above.
    const Eigen::Vector3f back = -R_camera_world_.row(2).transpose();
    const Eigen::Vector3f left = -R_camera_world_.row(0).transpose();
    light_ = (back + 0.4F * left + 0.5F * up_).normalized();
  }

  // @param normal_world where the point has none of its own; need not be of unit length.
  [[nodiscard]] RasterVertex vertex(const SurfacePoint& point,
                                    const Eigen::Vector3f& normal_world) const {
    const bool has_normal = !point.normal_world.isZero();
    const float light = shade(has_normal ? point.normal_world : normal_world);
    RasterVertex vertex{R_camera_world_ * point.p_world + t_camera_world_, {}};
    if (style_.colour == PictureColour::kHeight) {
      vertex.colour = Eigen::Array3f(height_share(point), light, 0) * 255;  // see finish()
    } else {
      const Rgb8 c = colour_of(point);
      vertex.colour = Eigen::Array3f(c.r, c.g, c.b) * light;
    }
    return vertex;
  }

  void add_triangle(const std::array<const SurfacePoint*, 3>& corners) {
    const Eigen::Vector3f& p_world = corners[0]->p_world;
    const Eigen::Vector3f normal_world =
        (corners[1]->p_world - p_world).cross(corners[2]->p_world - p_world);
    const Eigen::Vector3f p_camera = R_camera_world_ * p_world + t_camera_world_;
    if (!style_.shows_backs && (R_camera_world_ * normal_world).dot(p_camera) >= 0) return;
    std::array<RasterVertex, 3> triangle;
    std::array<float, 3> under_cut_m{};
    for (std::size_t i = 0; i < 3; ++i) {
      if (is_cut_ceiling(*corners[i])) return;
      triangle[i] = vertex(*corners[i], normal_world);
      under_cut_m[i] = static_cast<float>(style_.cut_above_m - height_of(*corners[i]));
    }
    const bool agree = key_of(*corners[1]) == key_of(*corners[2]);
    const std::uint16_t key = key_of(*corners[agree ? 1 : 0]);
    if (!std::isfinite(style_.cut_above_m)) return raster_.add_triangle(triangle, key);
    std::array<RasterVertex, 4> part;
    const int count = clip_triangle(triangle, under_cut_m, part);
    if (count >= 3) raster_.add_triangle({part[0], part[1], part[2]}, key);
    if (count == 4) raster_.add_triangle({part[0], part[2], part[3]}, key);
  }

  void add_point(const SurfacePoint& point) {
    if (is_cut_ceiling(point) || height_of(point) > style_.cut_above_m) return;
    const RasterVertex drawn = vertex(point, Eigen::Vector3f::Zero());
    const Eigen::Vector3f normal_camera = R_camera_world_ * point.normal_world;
    if (!style_.shows_backs && normal_camera.dot(drawn.p_camera) > 0) return;
    raster_.add_point(drawn, style_.point_m, key_of(point));
  }

  [[nodiscard]] ScenePicture picture(std::span<const SceneObject> objects) const {
    const bool by_height = style_.colour == PictureColour::kHeight;
    ScenePicture picture{by_height ? raster_.image(finish) : raster_.image(), style_.colour, {}};
    if (by_height) {
      for (const double height_m : {range_.low_m, range_.high_m}) {
        std::array<char, 32> text{};
        std::snprintf(text.data(), text.size(), "%.2f m", height_m);
        picture.legend.push_back({text.data(), height_colour(height_m == range_.high_m), 0});
      }
    } else if (style_.colour != PictureColour::kSurface) {
      picture.legend = legend_of_keys(objects);
    }
    return picture;
  }

 private:
  [[nodiscard]] bool is_cut_ceiling(const SurfacePoint& point) const {
    return std::isfinite(style_.cut_above_m) &&
           point.label.semantic_class == SemanticClass::kCeiling;
  }

  [[nodiscard]] double height_of(const SurfacePoint& point) const {
    return static_cast<double>(point.p_world.dot(up_)) - floor_m_;
  }

  [[nodiscard]] float height_share(const SurfacePoint& point) const {
    const double share = (height_of(point) - range_.low_m) / (range_.high_m - range_.low_m);
    return static_cast<float>(share);
  }

  // Between the corners of a large triangle it is the height that changes evenly, not the colour.
  static Rgb8 finish(Rgb8 share_and_light) {
    const Rgb8 c = height_colour(share_and_light.r / 255.0);
    const auto lit = [&](std::uint8_t value) {
      return static_cast<std::uint8_t>(value * share_and_light.g / 255);
    };
    return {lit(c.r), lit(c.g), lit(c.b)};
  }

  [[nodiscard]] Rgb8 colour_of(const SurfacePoint& point) const {
    if (style_.colour == PictureColour::kClass) return class_colour(point.label.semantic_class);
    if (style_.colour == PictureColour::kObject) return object_colour(point.label.object);
    return point.colour;
  }

  // Colours of a camera have light and shadow in them already.
  [[nodiscard]] float shade(const Eigen::Vector3f& normal_world) const {
    const float depth = style_.colour == PictureColour::kSurface ? 0.25F : 0.55F;
    const float length = normal_world.norm();
    const float facing = length > 0 ? std::abs(normal_world.dot(light_)) / length : 0.7F;
    return 1 - depth * (1 - facing);
  }

  // What the legend counts; never 0.
  [[nodiscard]] std::uint16_t key_of(const SurfacePoint& point) const {
    const int number = style_.colour == PictureColour::kObject
                           ? static_cast<int>(point.label.object)
                           : static_cast<int>(point.label.semantic_class);
    return static_cast<std::uint16_t>(std::min(number, 65534) + 1);
  }

  [[nodiscard]] LegendEntry entry_of(std::uint16_t number,
                                     std::span<const SceneObject> objects) const {
    if (style_.colour == PictureColour::kClass) {
      const auto semantic_class = static_cast<SemanticClass>(number);
      return {semantic_class_name(semantic_class), class_colour(semantic_class), 0};
    }
    const SceneObjectId id{number};
    if (id == kNoSceneObject) return {"no object", object_colour(id), 0};
    const auto object = std::find_if(objects.begin(), objects.end(),
                                     [&](const SceneObject& o) { return o.id == id; });
    const std::string name =
        object == objects.end() ? "object" : semantic_class_name(object->semantic_class);
    return {name + " " + std::to_string(number), object_colour(id), 0};
  }

  [[nodiscard]] std::vector<LegendEntry> legend_of_keys(
      std::span<const SceneObject> objects) const {
    std::vector<int> counts(65536);
    for (const std::uint16_t key : raster_.keys()) ++counts[key];
    std::vector<LegendEntry> legend;
    for (std::size_t key = 1; key < counts.size(); ++key) {
      if (counts[key] == 0) continue;
      legend.push_back(entry_of(static_cast<std::uint16_t>(key - 1), objects));
      legend.back().share = counts[key] / static_cast<double>(raster_.keys().size());
    }
    std::stable_sort(legend.begin(), legend.end(),
                     [](const auto& a, const auto& b) { return a.share > b.share; });
    return legend;
  }

  Raster raster_;
  PictureStyle style_;
  Eigen::Matrix3f R_camera_world_;
  Eigen::Vector3f t_camera_world_;
  Eigen::Vector3f up_, light_;
  double floor_m_;
  HeightRange range_;
};

}  // namespace

ScenePicture draw_mesh(const TriangleMesh& mesh, const Viewpoint& view, const Gravity& gravity,
                       const PictureStyle& style, std::span<const SceneObject> objects) {
  Painter painter(mesh.vertices, view, gravity, style);
  for (const auto& triangle : mesh.triangles) {
    std::array<const SurfacePoint*, 3> corners{};
    for (std::size_t i = 0; i < 3; ++i) {
      CHECK(triangle[i] < mesh.vertices.size(), "a triangle without its vertex");
      corners[i] = &mesh.vertices[triangle[i]];
    }
    painter.add_triangle(corners);
  }
  return painter.picture(objects);
}

ScenePicture draw_points(std::span<const SurfacePoint> points, const Viewpoint& view,
                         const Gravity& gravity, const PictureStyle& style,
                         std::span<const SceneObject> objects) {
  Painter painter(points, view, gravity, style);
  for (const SurfacePoint& point : points) painter.add_point(point);
  return painter.picture(objects);
}

// Stops of Matplotlib's viridis.
Rgb8 height_colour(double share) {
  constexpr std::array<std::array<double, 3>, 5> kStops{
      {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
  const double at = std::clamp(share, 0.0, 1.0) * (kStops.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const double part = at - static_cast<double>(below);
  const auto channel = [&](std::size_t i) {
    return static_cast<std::uint8_t>(
        std::lround(kStops[below][i] + part * (kStops[below + 1][i] - kStops[below][i])));
  };
  return {channel(0), channel(1), channel(2)};
}

}  // namespace ygslam
