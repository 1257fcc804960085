// What a pose errs by that the points do not show which the frame was matched with.
#pragma once

namespace ygslam {

/// Variance of each axis.
struct Doubt {
  double position_m2 = 0, rotation_rad2 = 0;
};

struct PoseDoubt {
  Doubt odom;  ///< how far odom has drifted since the run began
  Doubt map;  ///< how far the ground it sees lies from where the map began, by what drifted between
};

}  // namespace ygslam
