// Inertial odometry beside vision's: fed with an IMU's samples and with the poses of tracked
// frames, it knows gravity, velocity and biases, says how the camera moves before a frame is looked
// at, and goes on alone for some seconds when nothing is seen (docs/inertial.md). Loosely coupled:
// vision's poses come with their covariance; what they were made of is not seen here.
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "inertial/camera_gravity.hpp"
#include "inertial/camera_turn.hpp"
#include "inertial/gyro_turn.hpp"
#include "inertial/imu_buffer.hpp"
#include "inertial/inertial_start.hpp"
#include "inertial/inertial_window.hpp"
#include "inertial/pose_prediction.hpp"
#include "inertial/time_offset.hpp"
#include "inertial/visual_pose.hpp"
#include "inertial/wheel_odometry.hpp"

namespace ygslam {

struct InertialConfig {
  ImuNoise noise;
  ImuRange range{};
  SE3 T_camera_imu;
  /// An IMU's stamp less the camera's of the same instant; nullopt: found once it turns. One that
  /// turns out to be wrong by more than 20 ms (and three times what the found one may err by) is a
  /// fault, and the found one is used.
  std::optional<double> time_offset_s;
  ImuBounds bounds{};
  /// What calibration leaves of a gyroscope's scale and misalignment, relative to its rates.
  double gyro_scale_error = 0.001;
  /// How fast vision's idea of upright drifts [rad/sqrt(s)].
  double tilt_walk_rad_sqrts = 2e-4;
  double start_s = 1.0;    ///< of poses that a start needs
  int window_frames = 12;  ///< kept in the smoother
};

class InertialEstimator {
 public:
  /// @param wheels null: there are none. They hold what frames without a pose may drift; fed before
  /// the frames, and outlive this.
  explicit InertialEstimator(const InertialConfig& config, const WheelOdometry* wheels = nullptr);

  /// In order of time. Frames wait for the samples of their time, predictions do not.
  void add(const ImuSample& sample);
  /// Every frame in turn. @param pose nullopt: it has none, or none to be trusted.
  void add_frame(Timestamp stamp, const std::optional<VisualPose>& pose);
  /// The same, found again in odom as coasting left it: its pose there is a definition, no
  /// measurement, and tells nothing of what the IMU erred in between.
  void add_frame_found_again(Timestamp stamp, const VisualPose& pose);
  /// What vision said in the last half second before `now` was wrong: as if nothing had been seen.
  /// What time offset was found, and what the wheels learned, is not undone.
  void go_back(Timestamp now);
  /// Vision is right where both say something else: the IMU is dropped, see take_fault().
  void disagree() { restart(ImuFault::kDisagrees); }
  /// @param stamp after the last frame's. @return nullopt before a start, and where samples do not
  /// reach.
  [[nodiscard]] std::optional<PosePrediction> predict(Timestamp stamp) const;

  /// How the camera turned between two frames, by the gyroscope as it is read: with its bias.
  /// Less certain before the offset of its clock is known.
  /// @return nullopt where samples are missing or at the end of its range.
  [[nodiscard]] std::optional<CameraTurn> turn(Timestamp from, Timestamp to) const;

  [[nodiscard]] bool started() const { return window_.has_value(); }
  /// A second alone would take the camera nowhere: what predict() says may stand for vision.
  [[nodiscard]] bool is_trusted() const;
  /// Why the IMU was dropped since this was last asked; it starts anew by itself.
  [[nodiscard]] ImuFault take_fault() { return std::exchange(fault_, ImuFault::kNone); }

  /// Of the newest frame; nullopt before a start.
  [[nodiscard]] std::optional<UncertainState> state() const;
  /// TiltedGravity in odom [m/s2].
  [[nodiscard]] std::optional<Vec3> gravity_odom() const;
  /// Of the newest frame; nullopt before a start.
  [[nodiscard]] std::optional<CameraGravity> camera_gravity() const {
    if (!window_) return std::nullopt;
    return camera_gravity_of(window_->newest(), window_->gravity(), config_.T_camera_imu);
  }
  /// The same; of another stamp than the newest frame's where nothing was added up to it.
  [[nodiscard]] const GyroTurn& gyro_turn() const { return turn_.now(); }
  [[nodiscard]] double time_offset_s() const { return 1e-9 * static_cast<double>(offset_ns_); }
  [[nodiscard]] bool time_offset_is_known() const { return offset_known_; }

 private:
  struct Frame {
    Timestamp stamp;
    std::optional<VisualPose> pose;
    bool found_again = false;
  };
  [[nodiscard]] SeenPose of_imu(const VisualPose& pose) const;
  /// Until it is taken a silence does not hide that the IMU was wrong.
  void note(ImuFault fault) {
    if (!is_wrong(fault_)) fault_ = fault;
  }
  void restart(ImuFault fault);
  void put(const Frame& frame);
  void process_waiting();
  void look_for_readings(Timestamp now);
  void process(const Frame& frame);
  void remember_turn(const SeenFrame& frame);
  void find_time_offset(Timestamp now);
  void take_time_offset(const TimeOffset& found);
  void find_far_offset(std::span<const SeenTurn> turns, const std::optional<TimeOffset>& near);
  void confirm_offset();
  void set_further_offset(double offset_s);
  [[nodiscard]] bool is_offset_precise() const;
  [[nodiscard]] double offset_sigma_s() const;
  void doubt_time_offset();
  void try_start(const SeenFrame& frame);
  void go_on(Timestamp stamp, const std::optional<SeenPose>& seen);
  [[nodiscard]] std::optional<WheelTie> tie_by_wheels(const UncertainState& before,
                                                      const UncertainState& predicted,
                                                      const MotionFactor& motion);
  [[nodiscard]] SeenPose with_unsure_time(SeenPose seen, const InertialState& state,
                                          const Preintegration& measured) const;
  [[nodiscard]] bool is_absurd(const InertialState& state) const;
  void judge(const UncertainState& predicted, const SeenPose& seen);
  [[nodiscard]] std::optional<UncertainState> moved(UncertainState state, Timestamp stamp) const;
  struct Earlier {
    UncertainState state;
    Timestamp last_seen;
    [[nodiscard]] Timestamp stamp() const { return state.state.stamp; }
  };
  void remember(Timestamp stamp, bool seen);
  /// The newest of half a second before.
  [[nodiscard]] const Earlier* earlier(Timestamp now) const;
  [[nodiscard]] PosePrediction::Earlier of_camera(const UncertainState& state) const;
  [[nodiscard]] StateWalk walk() const {
    return {config_.noise.gyro_walk_radps2_sqrthz, config_.noise.accel_walk_mps3_sqrthz,
            config_.tilt_walk_rad_sqrts};
  }

  static constexpr double kTurnsKept_s = 4;

  InertialConfig config_;
  const WheelOdometry* wheels_;
  SE3 T_imu_camera_;
  ImuBuffer samples_;
  std::int64_t offset_ns_ = 0;
  bool offset_known_ = false;
  std::deque<Frame> waiting_;  // for their samples
  std::optional<Timestamp> last_frame_, last_seen_;
  std::optional<SeenFrame> last_pose_;  // processed
  std::deque<SeenTurn> turns_;
  Timestamp offset_looked_at_;
  double further_offset_s_ = 0, offset_weight_ = 0;  // what was found beyond offset_ns_
  std::optional<double> far_offset_s_;               // the same, of the last look farther away
  bool offset_in_doubt_ = false;  // another fits, or none ever did, though it turned
  bool offset_fitted_ = false;    // at the last look
  bool offset_fits_ = false;      // vision once agreed
  int offset_unfound_ = 0;        // looks at turns that should have told
  std::vector<SeenFrame> start_;  // what one will be made of
  std::optional<InertialWindow> window_;
  std::deque<Earlier> earlier_;  // the last frames, as they were then; not empty once started
  std::optional<Timestamp> agrees_since_;
  std::optional<Vec3> seen_velocity_mps_;  // at the last seen frame
  std::deque<bool> disagreed_;             // of the last seen frames
  std::optional<Timestamp> slipped_at_;    // that the wheels were last seen to slip by the IMU
  std::optional<Timestamp> tied_at_;       // the last frame that they held
  GyroTurnSum turn_;
  Mat6 lasting_ = Mat6::Zero();  // of the camera, by errors of the wheels that last
  bool once_trusted_ = false;    // since it started
  ImuFault fault_ = ImuFault::kNone;
  std::optional<Timestamp> first_frame_;
  int frames_without_ = 0;                 // readings of their time
  bool any_came_ = false, heard_ = false;  // readings; some of a frame's time, or told that none
};

}  // namespace ygslam
