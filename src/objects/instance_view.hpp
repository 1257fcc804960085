// What a mask shows of each thing that can move: its box, its place in space, and how it looks.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "geometry/camera.hpp"
#include "image/pixel_box.hpp"
#include "image/rgbd_frame.hpp"
#include "segment/movable.hpp"

namespace ygslam {

/// A frame at every eighth pixel, small enough to keep until its mask has come.
struct Thumbnail {
  static constexpr int kStep = 8;
  DepthImage depth_m;
  ColourImage colour;
};
[[nodiscard]] Thumbnail make_thumbnail(const RgbdFrame& frame);

/// Shares of the colours of the upper and of the lower half (4 x 4 x 4 bins of RGB each): what
/// people wear.
class Appearance {
 public:
  void add(const Rgb8& colour, bool lower);
  void normalise();
  /// Follows a newer appearance, slowly.
  void blend(const Appearance& newer, float share);
  /// Bhattacharyya coefficient, mean of the halves: 1 = the same, 0 = no colour in common.
  [[nodiscard]] double similarity(const Appearance& other) const;

 private:
  std::array<std::array<float, 64>, 2> share_{};
};

struct InstanceView {
  int class_id = 0;
  float score = 0;
  std::vector<std::uint8_t> ids;  ///< values of Segmentation::ids that are this thing
  PixelBox box;
  double own_share = 0;    ///< of the box that its pixels fill
  bool has_depth = false;  ///< else what follows means nothing
  float depth_m = 0;
  Vec3 centre_odom = Vec3::Zero();                        ///< medians
  Vec3 min_odom = Vec3::Zero(), max_odom = Vec3::Zero();  ///< box about 90 %
  Appearance appearance;
};

/// Depth, place and colour of the pixels with one value of ids in the view's box.
/// @return false where they are too few to tell.
[[nodiscard]] bool measure(std::uint8_t id, const GreyImage& ids, const Thumbnail& thumbnail,
                           const Camera& camera, const SE3& T_odom_camera, InstanceView& view);

/// Instances that can move, best score first; those that show one thing put together.
[[nodiscard]] std::vector<InstanceView> view_instances(const Segmentation& masks,
                                                       const Thumbnail& thumbnail,
                                                       const Camera& camera,
                                                       const SE3& T_odom_camera,
                                                       const MovableClasses& movable);

}  // namespace ygslam
