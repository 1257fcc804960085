// Triangles and points into pixels, the nearest in front.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>

#include "image/image.hpp"
#include "scene_picture/viewpoint.hpp"

namespace ygslam {

struct RasterVertex {
  Eigen::Vector3f p_camera = Eigen::Vector3f::Zero();  ///< [m]
  Eigen::Array3f colour = Eigen::Array3f::Zero();      ///< 0 to 255
};

/// The part of a triangle where a value that is even over it is not negative (Sutherland and
/// Hodgman, CACM 1974, one plane). @param values at the corners. @return corners in `clipped`: 0, 3
/// or 4.
int clip_triangle(const std::array<RasterVertex, 3>& triangle, const std::array<float, 3>& values,
                  std::array<RasterVertex, 4>& clipped);

/// A z-buffer with 2 x 2 samples a pixel. Every sample keeps the key of what it shows.
class Raster {
 public:
  Raster(const Viewpoint& view, Rgb8 background);

  void add_triangle(const std::array<RasterVertex, 3>& triangle, std::uint16_t key);
  /// A square of this side that faces the camera, a pixel at least.
  void add_point(const RasterVertex& point, double side_m, std::uint16_t key);

  /// The mean of each pixel's samples. @param finish if given, makes a sample's colour of what was
  /// drawn there.
  [[nodiscard]] ColourImage image(const std::function<Rgb8(Rgb8)>& finish = {}) const;
  /// Of every sample; 0 where there is only background.
  [[nodiscard]] const Image<std::uint16_t>& keys() const { return keys_; }

 private:
  static constexpr int kSamples = 2;  // a pixel, along each side
  struct Corner {
    Vec2 at;                // [samples]
    double inverse_z = 0;   // [1/m]
    Eigen::Array3f colour;  // over z
  };
  [[nodiscard]] Corner project(const RasterVertex& vertex) const;
  void fill(const Corner& a, const Corner& b, const Corner& c, std::uint16_t key);
  void put(int u, int v, float inverse_z, const Eigen::Array3f& colour, std::uint16_t key);

  double focal_ = 0;  // [samples]
  Vec2 middle_;       // [samples]
  Image<float> inverse_z_;
  ColourImage samples_;
  Image<std::uint16_t> keys_;
};

}  // namespace ygslam
