// Position, velocity and what the IMU is off by, at one instant; how two instants are tied by what
// the IMU measured between them, and one by a pose that was seen. For a smoother that works with
// small changes of states (Forster et al., T-RO 2017, section VI; equation numbers are of it).
#pragma once

#include "inertial/preintegration.hpp"
#include "inertial/visual_pose.hpp"

namespace ygslam {

/// Changes of a state, in this order: rotation (in the IMU's axes), position, velocity (in odom's),
/// biases of gyroscope and accelerometer, tilt of gravity.
inline constexpr int kStateSize = 17;
using StateVector = Eigen::Matrix<double, kStateSize, 1>;
using StateMatrix = Eigen::Matrix<double, kStateSize, kStateSize>;
namespace state_part {
inline constexpr int kRotation = 0, kPosition = 3, kVelocity = 6, kGyroBias = 9, kAccelBias = 12,
                     kTilt = 15;
}

/// odom is where vision counts from, leans as the first camera did, and leans more as vision
/// drifts: gravity in it is part of the state, as a small rotation of a fixed direction.
class TiltedGravity {
 public:
  explicit TiltedGravity(const Vec3& down_odom);
  TiltedGravity() : TiltedGravity(Vec3::UnitZ()) {}
  /// [m/s2]
  [[nodiscard]] Vec3 at(const Vec2& tilt) const;
  [[nodiscard]] Eigen::Matrix<double, 3, 2> derivative(const Vec2& tilt) const;
  /// How the tilt changes with gravity's direction.
  [[nodiscard]] Eigen::Matrix<double, 2, 3> tilt_from_gravity(const Vec2& tilt) const;

 private:
  Vec3 middle_;                        // at no tilt
  Eigen::Matrix<double, 3, 2> basis_;  // of what turns it
};

struct InertialState {
  Timestamp stamp;
  SE3 T_odom_imu;
  Vec3 velocity_odom_mps = Vec3::Zero();
  ImuBias bias;
  Vec2 tilt = Vec2::Zero();  ///< of TiltedGravity
};

[[nodiscard]] InertialState changed(const InertialState& state, const StateVector& change);
/// What changes `from` to `to`.
[[nodiscard]] StateVector change_between(const InertialState& from, const InertialState& to);
/// Derivative of change_between() by small changes of `to`.
[[nodiscard]] StateMatrix change_jacobian(const InertialState& from, const InertialState& to);

/// How fast what is constant in theory goes elsewhere.
struct StateWalk {
  double gyro_radps2_sqrthz = 0;
  double accel_mps3_sqrthz = 0;
  double tilt_rad_sqrts = 0;  ///< the drift of vision's roll and pitch
};

/// What the IMU measured between two states.
class MotionFactor {
 public:
  MotionFactor(Preintegration measured, const StateWalk& walk);
  /// Odom drifted in between: `after`'s pose in it is less certain, and velocity and gravity turn
  /// along, so that both are known no worse in the IMU's own axes.
  void add_drift(const OdomDrift& drift, const InertialState& before, const InertialState& after,
                 const TiltedGravity& gravity);

  struct Linear {
    StateVector residual;
    StateMatrix by_before, by_after;  ///< derivatives
  };
  /// Eqs. (45) to (48) and appendix C.
  [[nodiscard]] Linear linear(const InertialState& before, const InertialState& after,
                              const TiltedGravity& gravity) const;
  [[nodiscard]] const StateMatrix& information() const { return information_; }
  [[nodiscard]] const StateMatrix& covariance() const { return covariance_; }
  [[nodiscard]] const Preintegration& measured() const { return measured_; }
  /// The state that agrees with all of it.
  [[nodiscard]] InertialState after(const InertialState& before, Timestamp stamp,
                                    const TiltedGravity& gravity) const;

 private:
  Preintegration measured_;
  StateMatrix covariance_, information_;
};

/// A state and how well it is known.
struct UncertainState {
  InertialState state;
  StateMatrix covariance;

  [[nodiscard]] UncertainState moved(const MotionFactor& motion, Timestamp stamp,
                                     const TiltedGravity& gravity) const;
};

/// A pose that was seen. Errors: T_odom_imu exp(error), translation first.
struct SeenPose {
  SE3 T_odom_imu;
  Mat6 covariance;
  OdomDrift drift{};  ///< since the last frame with a pose
};
struct SeenLinear {
  Vec6 residual;
  Eigen::Matrix<double, 6, 6> by_pose;  ///< by rotation and position of the state
};
[[nodiscard]] SeenLinear linear(const SeenPose& seen, const InertialState& state);

/// How the IMU moved between two states, by something that neither it nor vision measured. Errors:
/// T_before_after exp(error), translation first.
struct WheelTie {
  SE3 T_before_after;
  Mat6 covariance;
};
struct WheelLinear {
  Vec6 residual;
  Mat6 by_before, by_after;  ///< by rotation and position of the states
};
[[nodiscard]] WheelLinear linear(const WheelTie& tie, const InertialState& before,
                                 const InertialState& after);

}  // namespace ygslam
