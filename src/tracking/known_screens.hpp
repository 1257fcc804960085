// Screens that were seen to play: planes that stand while what they show moves. What is on them is
// no part of the static world for as long as they play, also while the picture is slow or stands.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "core/time.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

class KnownScreens {
 public:
  /// Points of one plane that were seen to move on it.
  struct Sighting {
    std::vector<Vec3> p_camera;  ///< not empty
    Vec3 plane;                  ///< plane . p_camera = 1
  };
  /// A new one, or more of one that is known.
  void add(const Sighting& seen, const SE3& T_odom_camera, Timestamp now);
  /// The picture of a known one moved: it is one for longer, and as large as that shows.
  /// @param p_moving points that were seen to move.
  void renew(std::span<const Vec3> p_moving, const SE3& T_odom_camera, Timestamp now);
  /// Those that have not moved for long are surfaces like others.
  void forget_still(Timestamp now);
  void clear() { screens_.clear(); }

  [[nodiscard]] bool empty() const { return screens_.empty(); }
  /// Whether a point is on one of them.
  [[nodiscard]] bool shows(const Vec3& p_odom, double depth_m) const;

 private:
  struct Screen {
    SE3 T_screen_odom;         // z across the plane
    Eigen::AlignedBox2d area;  // [m] in the plane
    Timestamp last_moved;
  };
  std::vector<Screen> screens_;
};

}  // namespace ygslam
