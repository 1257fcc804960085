#include "dense/background/mesh_view.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ygslam {
namespace {

constexpr std::uint32_t kBunch = 64;  // triangles
constexpr int kTile_px = 8;
// A rolling shutter and a lens bend the edges of what is looked at by less than this [tangent].
constexpr float kBend = 0.05F;
constexpr float kTouching_px2 = 1e-3F;  // so far outside a pixel still belongs to a triangle

}  // namespace

/// Where the wanted pixels are.
struct MeshView::Area {
  const GreyImage& wanted;
  int left, right = -1, top, bottom = -1;  // [px], bounds
  Eigen::Vector2f low, high;               // the same as tangents
  Image<std::uint8_t> tiles;               // 1 = has a wanted pixel

  Area(const GreyImage& image, const Camera& camera)
      : wanted(image),
        left(image.width()),
        top(image.height()),
        tiles((image.width() + kTile_px - 1) / kTile_px,
              (image.height() + kTile_px - 1) / kTile_px) {
    for (int v = 0; v < image.height(); ++v) {
      for (int u = 0; u < image.width(); ++u) {
        if (image.at(u, v) == 0) continue;
        left = std::min(left, u), right = std::max(right, u);
        top = std::min(top, v), bottom = std::max(bottom, v);
        tiles.at(u / kTile_px, v / kTile_px) = 1;
      }
    }
    low = Eigen::Vector2f::Constant(1e9F), high = -low;
    for (const double u : {left, right}) {
      for (const double v : {top, bottom}) {
        const Vec3 ray = camera.unproject(camera.undistort({u, v}), 1);
        low = low.cwiseMin(ray.head<2>().cast<float>());
        high = high.cwiseMax(ray.head<2>().cast<float>());
      }
    }
    low.array() -= kBend, high.array() += kBend;
  }
  [[nodiscard]] bool empty() const { return right < left; }

  struct Box {  // [px], bounds
    int left, right, top, bottom;
  };
  /// The area's pixels between two corners of an image.
  [[nodiscard]] Box part(const Eigen::Vector2f& low_px, const Eigen::Vector2f& high_px) const {
    const auto bound = [](float value, int least, int most) {
      return static_cast<int>(
          std::clamp(value, static_cast<float>(least - 1), static_cast<float>(most + 1)));
    };
    return {std::max(left, bound(std::ceil(low_px.x()), left, right)),
            std::min(right, bound(std::floor(high_px.x()), left, right)),
            std::max(top, bound(std::ceil(low_px.y()), top, bottom)),
            std::min(bottom, bound(std::floor(high_px.y()), top, bottom))};
  }
  /// Whether no pixel of it is wanted, as far as that is told quickly.
  [[nodiscard]] bool is_unwanted(const Box& box) const {
    if (box.left > box.right || box.top > box.bottom) return true;
    const bool is_one_tile =
        box.right / kTile_px == box.left / kTile_px && box.bottom / kTile_px == box.top / kTile_px;
    return is_one_tile && tiles.at(box.left / kTile_px, box.top / kTile_px) == 0;
  }
  [[nodiscard]] bool may_show(const Eigen::Vector3f& p_camera, float radius_m) const {
    if (p_camera.z() < -radius_m) return false;
    for (int axis = 0; axis < 2; ++axis) {
      const float over = p_camera[axis] - high[axis] * p_camera.z();
      const float under = low[axis] * p_camera.z() - p_camera[axis];
      if (over > radius_m * std::hypot(1.0F, high[axis])) return false;
      if (under > radius_m * std::hypot(1.0F, low[axis])) return false;
    }
    return true;
  }
};

MeshView::MeshView(TriangleMesh mesh) : mesh_(std::move(mesh)), corners_(mesh_.vertices.size()) {
  const auto count = static_cast<std::uint32_t>(mesh_.triangles.size());
  for (std::uint32_t first = 0; first < count; first += kBunch) {
    Bunch bunch{first, std::min(first + kBunch, count), {}, 0};
    Eigen::AlignedBox3f box;
    for (std::uint32_t i = bunch.first; i < bunch.last; ++i)
      for (const std::uint32_t vertex : mesh_.triangles[i])
        box.extend(mesh_.vertices[vertex].p_world);
    bunch.middle_world = box.center();
    bunch.radius_m = 0.5F * box.diagonal().norm();
    bunches_.push_back(bunch);
  }
}

SurfaceImage MeshView::draw(const FrameGeometry& geometry, const GreyImage& wanted) {
  const Camera& camera = geometry.camera();
  SurfaceImage image{DepthImage(camera.width(), camera.height()),
                     ColourImage(camera.width(), camera.height())};
  const Area area(wanted, camera);
  if (area.empty()) return image;
  ++drawing_;
  const SE3 T_camera_world = geometry.T_world_camera().inverse();
  const Eigen::Matrix3f R = T_camera_world.R().cast<float>();
  const Eigen::Vector3f t = T_camera_world.t().cast<float>();
  for (const Bunch& bunch : bunches_) {
    if (!area.may_show(R * bunch.middle_world + t, bunch.radius_m)) continue;
    for (std::uint32_t i = bunch.first; i < bunch.last; ++i)
      fill(mesh_.triangles[i], geometry, area, image);
  }
  return image;
}

const MeshView::Corner& MeshView::corner(std::uint32_t vertex, const FrameGeometry& geometry) {
  Corner& corner = corners_[vertex];
  if (std::exchange(corner.drawing, drawing_) == drawing_) return corner;
  const auto seen = geometry.project(mesh_.vertices[vertex].p_world);
  corner.in_front = seen.has_value();
  if (seen) {
    corner.uv_px = seen->uv_px;
    corner.inverse_z = 1 / seen->z_m;
  }
  return corner;
}

void MeshView::fill(const std::array<std::uint32_t, 3>& triangle, const FrameGeometry& geometry,
                    const Area& area, SurfaceImage& image) {
  const Corner& a = corner(triangle[0], geometry);
  const Corner& b = corner(triangle[1], geometry);
  const Corner& c = corner(triangle[2], geometry);
  if (!a.in_front || !b.in_front || !c.in_front) return;
  const Eigen::Vector2f ab = b.uv_px - a.uv_px, ac = c.uv_px - a.uv_px;
  // Counter-clockwise from outside is clockwise in an image whose v points down.
  const float doubled_area = ac.x() * ab.y() - ac.y() * ab.x();
  if (!(doubled_area > 0)) return;
  const Area::Box box = area.part(a.uv_px.cwiseMin(b.uv_px).cwiseMin(c.uv_px),
                                  a.uv_px.cwiseMax(b.uv_px).cwiseMax(c.uv_px));
  if (area.is_unwanted(box)) return;
  for (int v = box.top; v <= box.bottom; ++v) {
    for (int u = box.left; u <= box.right; ++u) {
      if (area.wanted.at(u, v) == 0) continue;
      const Eigen::Vector2f p =
          Eigen::Vector2f(static_cast<float>(u), static_cast<float>(v)) - a.uv_px;
      const float area_b = ac.x() * p.y() - ac.y() * p.x();
      const float area_c = p.x() * ab.y() - p.y() * ab.x();
      if (area_b < -kTouching_px2 || area_c < -kTouching_px2 ||
          doubled_area - area_b - area_c < -kTouching_px2)
        continue;
      const float share_b = area_b / doubled_area, share_c = area_c / doubled_area;
      const float share_a = 1 - share_b - share_c;
      // What is even over the image is 1/z.
      const float inverse_z = share_a * a.inverse_z + share_b * b.inverse_z + share_c * c.inverse_z;
      if (!(inverse_z > 0)) continue;
      const float depth_m = 1 / inverse_z;
      float& nearest_m = image.depth_m.at(u, v);
      if (nearest_m != 0 && nearest_m <= depth_m) continue;
      nearest_m = depth_m;
      image.colour.at(u, v) = mixed_colour(triangle, {share_a, share_b, share_c});
    }
  }
}

Rgb8 MeshView::mixed_colour(const std::array<std::uint32_t, 3>& triangle,
                            const Eigen::Vector3f& shares) const {
  const Rgb8 a = mesh_.vertices[triangle[0]].colour, b = mesh_.vertices[triangle[1]].colour,
             c = mesh_.vertices[triangle[2]].colour;
  const auto mix = [&](std::uint8_t x, std::uint8_t y, std::uint8_t z) {
    const float sum = shares[0] * static_cast<float>(x) + shares[1] * static_cast<float>(y) +
                      shares[2] * static_cast<float>(z);
    return static_cast<std::uint8_t>(std::clamp(sum + 0.5F, 0.0F, 255.0F));
  };
  return {mix(a.r, b.r, c.r), mix(a.g, b.g, c.g), mix(a.b, b.b, c.b)};
}

}  // namespace ygslam
