// Where the feet are: planted on one spot while they carry the body, else swinging to the next
// spot.
#pragma once

#include <vector>

#include "simulation/people/timeline.hpp"

namespace ygslam::sim {

struct FootShape {
  double side_m = 0.1;               ///< of the ankle from the middle, > 0
  double ankle_m = 0.08;             ///< height of the ankle
  Vec3 ball = Vec3(0.13, 0, -0.06);  ///< from the ankle to the joint of the toes, foot frame
};

struct FootState {
  Vec3 p_ankle_world = Vec3::Zero();
  double yaw_rad = 0;
  double pitch_rad = 0;  ///< > 0: heel up
  bool planted = true;   ///< the ball of the foot rests on its spot
};

class Footsteps {
 public:
  Footsteps(const Timeline& timeline, const FootShape& shape);
  /// @param side +1 left, -1 right.
  [[nodiscard]] FootState foot(int side, double local_s) const;

 private:
  struct Stance {
    double from_s, until_s;
    Vec2 at;  ///< below the ankle
    double yaw_rad;
    bool rolls_off;  ///< the heel rises before the end
  };
  void plan(const Timeline& timeline, int side);
  [[nodiscard]] FootState planted(const Stance& stance, double local_s) const;

  FootShape shape_;
  std::vector<Stance> left_, right_;
};

}  // namespace ygslam::sim
