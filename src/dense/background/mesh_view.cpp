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
  const auto bound = [](float value, int low, int high) {
    return static_cast<int>(
        std::clamp(value, static_cast<float>(low - 1), static_cast<float>(high + 1)));
  };
  const Eigen::Vector2f low = a.uv_px.cwiseMin(b.uv_px).cwiseMin(c.uv_px);
  const Eigen::Vector2f high = a.uv_px.cwiseMax(b.uv_px).cwiseMax(c.uv_px);
  const int left = std::max(area.left, bound(std::ceil(low.x()), area.left, area.right));
  const int right = std::min(area.right, bound(std::floor(high.x()), area.left, area.right));
  const int top = std::max(area.top, bound(std::ceil(low.y()), area.top, area.bottom));
  const int bottom = std::min(area.bottom, bound(std::floor(high.y()), area.top, area.bottom));
  if (left > right || top > bottom) return;
  if (right / kTile_px == left / kTile_px && bottom / kTile_px == top / kTile_px &&
      area.tiles.at(left / kTile_px, top / kTile_px) == 0)
    return;
  for (int v = top; v <= bottom; ++v) {
    for (int u = left; u <= right; ++u) {
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
      const Rgb8 ca = mesh_.vertices[triangle[0]].colour, cb = mesh_.vertices[triangle[1]].colour,
                 cc = mesh_.vertices[triangle[2]].colour;
      const auto mix = [&](std::uint8_t x, std::uint8_t y, std::uint8_t z) {
        const float sum = share_a * static_cast<float>(x) + share_b * static_cast<float>(y) +
                          share_c * static_cast<float>(z);
        return static_cast<std::uint8_t>(std::clamp(sum + 0.5F, 0.0F, 255.0F));
      };
      image.colour.at(u, v) = {mix(ca.r, cb.r, cc.r), mix(ca.g, cb.g, cc.g), mix(ca.b, cb.b, cc.b)};
    }
  }
}

}  // namespace ygslam
