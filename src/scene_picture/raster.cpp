#include "scene_picture/raster.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

constexpr float kNear_m = 0.05F;

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

int clip_triangle(const std::array<RasterVertex, 3>& triangle, const std::array<float, 3>& values,
                  std::array<RasterVertex, 4>& clipped) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t next = (i + 1) % 3;
    const RasterVertex& from = triangle[i];
    const RasterVertex& to = triangle[next];
    if (values[i] >= 0) clipped[count++] = from;
    if ((values[i] >= 0) == (values[next] >= 0)) continue;
    const float share = values[i] / (values[i] - values[next]);
    clipped[count++] = {from.p_camera + share * (to.p_camera - from.p_camera),
                        from.colour + share * (to.colour - from.colour)};
  }
  return count < 3 ? 0 : static_cast<int>(count);
}

Raster::Raster(const Viewpoint& view, Rgb8 background)
    : focal_(view.focal_px * kSamples),
      middle_(view.width * kSamples / 2.0 - 0.5, view.height * kSamples / 2.0 - 0.5),
      inverse_z_(view.width * kSamples, view.height * kSamples),
      samples_(view.width * kSamples, view.height * kSamples, background),
      keys_(view.width * kSamples, view.height * kSamples) {}

Raster::Corner Raster::project(const RasterVertex& vertex) const {
  const Vec3 p = vertex.p_camera.cast<double>();
  const double inverse_z = 1 / p.z();
  return {focal_ * inverse_z * p.head<2>() + middle_, inverse_z,
          vertex.colour * static_cast<float>(inverse_z)};
}

void Raster::put(int u, int v, float inverse_z, const Eigen::Array3f& colour, std::uint16_t key) {
  if (inverse_z <= inverse_z_.at(u, v)) return;
  inverse_z_.at(u, v) = inverse_z;
  const auto byte = [](float value) {
    return static_cast<std::uint8_t>(std::clamp(value, 0.0F, 255.0F) + 0.5F);
  };
  samples_.at(u, v) = {byte(colour[0]), byte(colour[1]), byte(colour[2])};
  keys_.at(u, v) = key;
}

void Raster::add_triangle(const std::array<RasterVertex, 3>& triangle, std::uint16_t key) {
  std::array<RasterVertex, 4> clipped;
  const int corners =
      clip_triangle(triangle,
                    {triangle[0].p_camera.z() - kNear_m, triangle[1].p_camera.z() - kNear_m,
                     triangle[2].p_camera.z() - kNear_m},
                    clipped);
  if (corners == 0) return;
  const Corner first = project(clipped[0]), third = project(clipped[2]);
  fill(first, project(clipped[1]), third, key);
  if (corners == 4) fill(first, third, project(clipped[3]), key);
}

void Raster::fill(const Corner& a, const Corner& b, const Corner& c, std::uint16_t key) {
  const double area = cross(b.at - a.at, c.at - a.at);
  if (area == 0 || !std::isfinite(area)) return;
  const Vec2 low = a.at.cwiseMin(b.at).cwiseMin(c.at), high = a.at.cwiseMax(b.at).cwiseMax(c.at);
  const auto inside = [](double value, int size) {
    return static_cast<int>(std::clamp(value, -1.0, static_cast<double>(size)));
  };
  const int left = std::max(0, inside(std::ceil(low.x()), samples_.width()));
  const int right = std::min(samples_.width() - 1, inside(high.x(), samples_.width()));
  const int top = std::max(0, inside(std::ceil(low.y()), samples_.height()));
  const int bottom = std::min(samples_.height() - 1, inside(high.y(), samples_.height()));
  for (int v = top; v <= bottom; ++v) {
    for (int u = left; u <= right; ++u) {
      const Vec2 p(u, v);
      const double share_b = cross(p - a.at, c.at - a.at) / area;
      const double share_c = cross(b.at - a.at, p - a.at) / area;
      const double share_a = 1 - share_b - share_c;
      if (share_a < 0 || share_b < 0 || share_c < 0) continue;
      // What lies evenly in the picture is 1/z and colour/z.
      const double inverse_z =
          share_a * a.inverse_z + share_b * b.inverse_z + share_c * c.inverse_z;
      const Eigen::Array3f colour = static_cast<float>(share_a) * a.colour +
                                    static_cast<float>(share_b) * b.colour +
                                    static_cast<float>(share_c) * c.colour;
      put(u, v, static_cast<float>(inverse_z), colour / static_cast<float>(inverse_z), key);
    }
  }
}

void Raster::add_point(const RasterVertex& point, double side_m, std::uint16_t key) {
  if (point.p_camera.z() < kNear_m) return;
  const Corner corner = project(point);
  const double half = std::max<double>(kSamples, side_m * focal_ * corner.inverse_z) / 2;
  if (!((corner.at.array().abs() - half) < 1e6).all()) return;  // far outside
  const int left = std::max(0, static_cast<int>(std::ceil(corner.at.x() - half)));
  const int top = std::max(0, static_cast<int>(std::ceil(corner.at.y() - half)));
  for (int v = top; v < std::min<double>(corner.at.y() + half, samples_.height()); ++v) {
    for (int u = left; u < std::min<double>(corner.at.x() + half, samples_.width()); ++u)
      put(u, v, static_cast<float>(corner.inverse_z), point.colour, key);
  }
}

ColourImage Raster::image(const std::function<Rgb8(Rgb8)>& finish) const {
  ColourImage image(samples_.width() / kSamples, samples_.height() / kSamples);
  for (int v = 0; v < image.height(); ++v) {
    for (int u = 0; u < image.width(); ++u) {
      Eigen::Array3i sum = Eigen::Array3i::Constant(kSamples * kSamples / 2);
      for (int i = 0; i < kSamples * kSamples; ++i) {
        const int x = u * kSamples + i % kSamples, y = v * kSamples + i / kSamples;
        const bool drawn = keys_.at(x, y) != 0;
        const Rgb8 sample = finish && drawn ? finish(samples_.at(x, y)) : samples_.at(x, y);
        sum += Eigen::Array3i(sample.r, sample.g, sample.b);
      }
      sum /= kSamples * kSamples;
      image.at(u, v) = {static_cast<std::uint8_t>(sum[0]), static_cast<std::uint8_t>(sum[1]),
                        static_cast<std::uint8_t>(sum[2])};
    }
  }
  return image;
}

}  // namespace ygslam
