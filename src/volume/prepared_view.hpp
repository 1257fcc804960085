// A depth view as the fusion reads it: every pixel with its noise, slope and weight in two words.
#pragma once

#include <cstdint>
#include <vector>

#include "volume/depth_pyramid.hpp"
#include "volume/depth_view.hpp"

namespace ygslam {

/// Standard deviation of a depth [m]: base_m + factor_per_m (depth - from_m)^2. The default is the
/// axial noise of a Kinect (Nguyen, Izadi, Lovell 2012); a stereo camera has base 0, from 0 and
/// factor sigma_disparity / (focal length x baseline).
struct DepthNoise {
  double base_m = 0.0012;
  double factor_per_m = 0.0019;
  double from_m = 0.4;
};

struct NoiseModel {
  float base_m, factor_per_m, from_m;

  explicit NoiseModel(const DepthNoise& noise)
      : base_m(static_cast<float>(noise.base_m)),
        factor_per_m(static_cast<float>(noise.factor_per_m)),
        from_m(static_cast<float>(noise.from_m)) {}
  [[nodiscard]] float sigma_m(float depth_m) const {
    const float beyond_m = depth_m - from_m;
    const float square = beyond_m * beyond_m;
    const float growth_m = factor_per_m * square;
    return base_m + growth_m;
  }
};

struct PreparationConfig {
  DepthNoise noise;
  double max_depth_m = 4.5;     ///< farther depth makes no surface; it still carves up to here
  double jump_sigmas = 3;       ///< a pixel whose neighbour lies farther off than this and jump_m
  double jump_m = 0.02;         ///< belongs to two surfaces and is left out
  double pose_sigma_m = 0.005;  ///< of the camera's place: what no single depth can be better than
  double min_cos_incidence = 0.12;  ///< surfaces seen at a flatter angle are left out
};

/// The pixels of a tile of DepthPyramid::kTile_px pixels a side that lie on one surface.
struct SurfaceTile {
  Eigen::Vector2f middle_px;
  float near_m = 0, far_m = 0;
  Eigen::Vector3f normal_camera;  ///< unit length, towards the camera
};

/// Reusable: assign() keeps the memory of the view before.
class PreparedView {
 public:
  static constexpr float kSlopeUnit = 1.0F / 192;
  static constexpr int kMaxWeight = 15;

  /// @param of_same_depth a view prepared from the same depth by the same camera, if there is one:
  /// what follows from depth alone is taken from it.
  void assign(const DepthView& view, const PreparationConfig& config,
              const PreparedView* of_same_depth = nullptr);

  [[nodiscard]] const Pinhole& camera() const { return camera_; }
  /// Of each pixel: depth [DepthView::kUnit_m] | slope [kSlopeUnit] << 16 | weight << 24. The
  /// slope n . r turns a distance along the optical axis into one from the pixel's plane: n is the
  /// plane's normal, r the pixel's ray of z = 1. Weight: 1 to 15, 0 = makes no surface.
  [[nodiscard]] const std::uint32_t* geometry() const { return geometry_.data(); }
  /// Of each pixel: red | green << 8 | blue << 16 | object << 24, as DepthView::object has it.
  [[nodiscard]] const std::uint32_t* appearance() const { return appearance_.data(); }
  /// Where the pixels with a weight are.
  [[nodiscard]] const std::vector<SurfaceTile>& surface_tiles() const { return surface_tiles_; }
  [[nodiscard]] const DepthPyramid& nearest() const { return tiles_.nearest; }
  /// Of every number but DepthView::kNothing and kExcluded, kUnsure included.
  [[nodiscard]] const std::vector<SceneObjectId>& objects() const { return objects_; }
  /// DepthView::spared.
  [[nodiscard]] const std::vector<Eigen::Vector3i>& spared() const { return spared_; }
  /// Of all pixels, at most PreparationConfig::max_depth_m.
  [[nodiscard]] float farthest_m() const { return tiles_.farthest_m; }
  /// No depth of the pixels in a rectangle, as far as it lies in the image, is greater.
  [[nodiscard]] float farthest_m(const Vec2& low_px, const Vec2& high_px) const;

 private:
  void find_tile_depths(const DepthView& view, const PreparationConfig& config);
  void find_tile_slopes(const PreparationConfig& config);
  void weigh_pixels(const DepthView& view, const PreparationConfig& config);
  void find_surface_tiles(const PreparationConfig& config);
  /// Of a tile of several surfaces: one after the other, where depths lie farther apart than this.
  void add_parts(SurfaceTile tile, int u0, int v0, float gap_m);

  static constexpr int kFieldTiles = 8;  // along a side of the fields whose farthest is kept
  /// What follows from depth alone.
  struct Tiles {
    DepthPyramid nearest;
    float farthest_m = 0;
    int field_columns = 0, field_rows = 0;
    std::vector<float> field_farthest_m;
    int columns = 0, rows = 0;
    std::vector<std::uint16_t> nearest_depth;
    std::vector<float> depth_m;  // mean of the nearest surface in the tile, 0 = none
    std::vector<float> slope, cos;
    std::vector<Eigen::Vector3f> normals;
  };

  Pinhole camera_;
  std::vector<std::uint32_t> geometry_, appearance_;
  std::vector<SceneObjectId> objects_;
  std::vector<Eigen::Vector3i> spared_;
  Tiles tiles_;
  std::vector<SurfaceTile> surface_tiles_;
};

}  // namespace ygslam
