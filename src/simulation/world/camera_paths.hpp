// How the camera moves: the motions of TUM's Table 1 with their speeds, walks, and the small jerks
// of a hand.
#pragma once

#include <optional>
#include <vector>

#include "geometry/se3.hpp"

namespace ygslam::sim {

enum class PathKind {
  kStatic,
  kXyz,
  kRpy,
  kHalfsphere,
  kWalk,   ///< in a hand, looking where one will be
  kDrive,  ///< on a robot with two wheels: from standing, along its nose, to standing at the end
};

/// Average speeds over a sequence; measured over poses 1/30 s apart.
struct PathSpeed {
  double translation_mps = 0;
  double rotation_deg_per_s = 0;
};

/// During [from_s, until_s) the camera is somewhere else: picked up and put down again.
struct Kidnap {
  double from_s = 0;
  double until_s = 0;
  Vec3 at = Vec3::Zero();
  Vec3 look_at = Vec3::UnitX();
};

struct CameraPathConfig {
  PathKind kind = PathKind::kStatic;
  double seconds = 30;             ///< length over which the speeds are met
  Vec3 at = Vec3(0, 0, 1.4);       ///< [m], world; where the motion is centred
  Vec3 look_at = Vec3(1, 0, 1.2);  ///< [m], world
  std::optional<PathSpeed> speed;  ///< default: Table 1 of the paper for the kind
  std::vector<Vec3> waypoints;     ///< walk, drive: visited in turn along a smooth curve
  bool closed = true;              ///< walk, drive: back to the first waypoint, again and again
  std::uint64_t seed = 1;          ///< of the hand's jerks
  double jerk = 1;                 ///< strength of the hand's jerks, 0 = a perfect machine
  std::vector<Kidnap> kidnaps;
};

/// A pose for every time; a pure function of the configuration.
class CameraPath {
 public:
  explicit CameraPath(const CameraPathConfig& config);

  [[nodiscard]] SE3 T_world_camera(double t_s) const;
  /// The same motion as a body with mass can make it, for inertial sensors. A walk is drawn along
  /// short straight pieces, at whose ends the velocity would jump: here a smooth curve runs past
  /// them, within 1 mm and 0.03 degrees (4 mm and 0.2 degrees at ring's sharp corners; where
  /// long_floor turns round, within 50 ms, no body could follow). A kidnapping takes no time, which
  /// nobody can feel: the motion of the stretch that holds `within_s` goes on before and after it.
  [[nodiscard]] SE3 T_world_camera_felt(double t_s, double within_s) const;
  /// Average speeds over the configured duration, poses 1/30 s apart.
  /// Of the motion in the hand: the jumps of a kidnapping are not counted.
  [[nodiscard]] PathSpeed measured_speed() const;
  [[nodiscard]] double length_m() const;

 private:
  struct Wave {
    double amplitude, hz, phase;
  };
  [[nodiscard]] SE3 base(double t_s) const;
  [[nodiscard]] SE3 base_xyz(double t_s) const;
  [[nodiscard]] SE3 base_rpy(double t_s) const;
  [[nodiscard]] SE3 base_halfsphere(double t_s) const;
  [[nodiscard]] SE3 base_walk(double t_s) const;
  [[nodiscard]] SE3 base_walk_felt(double t_s) const;
  [[nodiscard]] SE3 base_drive(double t_s) const;
  [[nodiscard]] double driven_m(double t_s) const;
  [[nodiscard]] Vec3 walk_view(double s_m, const Vec3& here) const;
  [[nodiscard]] Vec3 walk_point(double s_m) const;
  /// The same; before and behind what is not closed straight on.
  [[nodiscard]] Vec3 endless_point(double s_m) const;
  [[nodiscard]] SE3 sway(double t_s) const;
  /// The pose, had nobody been kidnapped.
  [[nodiscard]] SE3 in_hand(double t_s) const { return base(t_s) * sway(t_s); }
  void calibrate();
  void prepare_walk();

  CameraPathConfig config_;
  PathSpeed target_;
  SE3 T_world_start_;
  std::vector<Wave> waves_[6];  // translation x y z [m], rotation x y z [rad]
  double sway_translation_ = 0;
  double sway_rotation_ = 0;
  double hz_ = 0.15;               // of the base motion
  double turn_gain_ = 1;           // halfsphere: how far the camera turns with its place
  std::vector<Vec3> curve_;        // walk: samples of the smooth curve
  std::vector<double> curve_s_m_;  // their arc lengths
};

/// Camera at `at`, optical axis towards `look_at`, image upright (world z up).
[[nodiscard]] SE3 look_at_pose(const Vec3& at, const Vec3& look_at);

}  // namespace ygslam::sim
