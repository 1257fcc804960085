// A coloured cloud of the static world from the keyframes, on a voxel grid.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "core/ids.hpp"
#include "geometry/rolling_shutter.hpp"
#include "image/coloured_point.hpp"
#include "image/rgbd_frame.hpp"

namespace ygslam {

struct StaticCloudConfig {
  double voxel_m = 0.01;
  double max_depth_m = 4.0;  ///< farther depth is too coarse for a map
  int pixel_stride = 2;      ///< every n-th pixel of every n-th row
  int margin_px = 6;   ///< this far around a mask nothing is taken: masks and depth have soft edges
  int min_points = 2;  ///< measurements that make a voxel
};

/// Keeps each keyframe's static measurements in its own camera frame, so that the cloud can follow
/// corrected poses; memory grows with the keyframes, which culling bounds by area.
class StaticCloud {
 public:
  StaticCloud(const StaticCloudConfig& config, const Camera& camera);

  /// @param dynamic 255 where the pixel may move (nothing is taken there); empty = none.
  void insert(KeyframeId keyframe, const RgbdFrame& frame, const GreyImage& dynamic,
              const ReadOut& read_out = {});
  void remove(KeyframeId keyframe);

  /// @param T_world_camera of the keyframes; those without a pose are left out.
  [[nodiscard]] std::vector<ColouredPoint> build(
      const std::map<KeyframeId, SE3>& T_world_camera) const;

 private:
  struct Sample {
    std::uint16_t u, v;        // recorded pixel
    std::uint16_t depth_mm10;  // 0.1 mm
    Rgb8 colour;
  };
  struct View {
    ReadOut read_out;
    std::vector<Sample> samples;
  };
  StaticCloudConfig config_;
  const Camera& camera_;
  std::map<KeyframeId, View> views_;
};

/// The mask grown by radius_px (square). @return empty for an empty mask.
[[nodiscard]] GreyImage dilated(const GreyImage& mask, int radius_px);

}  // namespace ygslam
