// Wheel odometry beside vision's: while the camera sees, both are compared, which finds how far the
// wheels' radius, their distance and the camera's place are off, and when wheels slip; while it
// sees nothing, the wheels say how it goes on, with a covariance (docs/inertial.md).
#pragma once

#include <deque>
#include <optional>
#include <utility>

#include "inertial/pose_prediction.hpp"
#include "inertial/visual_pose.hpp"
#include "inertial/wheel_motion.hpp"

namespace ygslam {

enum class WheelFault : std::uint8_t {
  kNone,
  kSilent,     ///< no poses for too long
  kJumped,     ///< faster than any robot: it began to count anew
  kClock,      ///< stamps went back
  kDisagrees,  ///< with vision, again and again
  kNoPoses,    ///< none that is one has come since the first frame
};
[[nodiscard]] const char* to_string(WheelFault fault);

class WheelOdometry {
 public:
  explicit WheelOdometry(const WheelCalibration& wheels);

  /// In order of time; what is not newer than the last, or no pose, is passed over.
  void add(const OdometrySample& sample);
  /// Every frame in turn. @param pose nullopt: it has none, or none to be trusted.
  void add_frame(Timestamp stamp, const std::optional<VisualPose>& pose);
  /// Found again in odom as coasting left it, see InertialEstimator.
  void add_frame_found_again(Timestamp stamp, const VisualPose& pose);
  /// Since the last frame with a pose. @return nullopt before one, and where samples do not reach.
  [[nodiscard]] std::optional<PosePrediction> predict(Timestamp stamp) const;

  /// Interpolated. @return nullopt where samples do not reach or are missing.
  [[nodiscard]] std::optional<WheelMotion> between(Timestamp from, Timestamp to) const;
  /// They have samples of that time, or none will come.
  [[nodiscard]] bool have_reached(Timestamp stamp) const;
  /// Vision has agreed with them on a way, and when it was last there they did not slip.
  [[nodiscard]] bool is_trusted() const;

  /// What is known of their errors.
  [[nodiscard]] const WheelErrors& errors() const { return errors_; }
  [[nodiscard]] const WheelErrorMatrix& error_covariance() const { return covariance_; }
  /// Of the prediction: what comes of errors that last, for who knows the heading otherwise.
  [[nodiscard]] Mat6 lasting_covariance(Timestamp stamp) const;
  [[nodiscard]] int slips() const { return slips_; }
  /// Why they are not used since this was last asked; they come back by themselves.
  [[nodiscard]] WheelFault take_fault() { return std::exchange(fault_, WheelFault::kNone); }

 private:
  struct Seen {
    Timestamp stamp;
    VisualPose pose;
  };
  [[nodiscard]] std::optional<OdometrySample> at(Timestamp stamp, double beyond_s) const;
  [[nodiscard]] std::optional<WheelSum> summed(Timestamp from, Timestamp to, double beyond_s) const;
  [[nodiscard]] std::optional<WheelSum> since_seen(Timestamp stamp) const;
  void restart(WheelFault fault);
  void forget_before(Timestamp frame);
  void compare(const Seen& seen);
  void note_slip(Timestamp stamp);
  void learn(const WheelMotion& motion, const Vec6& error, const Mat6& covariance);

  WheelCalibration wheels_;
  std::optional<Timestamp> first_frame_;
  bool has_begun_ = false;              // a sample has come, or it was told that none has
  std::deque<OdometrySample> samples_;  // since the last frame with a pose and some before it
  int gone_back_ = 0;                   // samples in a row
  WheelErrors errors_ = WheelErrors::Zero();
  WheelErrorMatrix covariance_;
  std::deque<Seen> waiting_;             // for samples of their time
  std::optional<Seen> compared_;         // the last frame that began a comparison
  std::optional<Seen> last_seen_;        // frame with a pose
  double agreed_m_ = 0;                  // way on which vision agreed
  std::optional<Timestamp> slipped_at_;  // last
  int slips_ = 0, slips_in_row_ = 0;
  WheelFault fault_ = WheelFault::kNone;
};

}  // namespace ygslam
