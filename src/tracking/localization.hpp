// Where the camera is in the world, and whether that can be relied on: after a loss, a gap or a
// jump a place is known by what is seen alone, and another room may look the same.
#pragma once

#include <limits>
#include <optional>

#include "tracking/odometry.hpp"
#include "tracking/view_poses.hpp"

namespace ygslam {

class Localization {
 public:
  /// @param max_speed_mps faster than this a camera is not carried.
  explicit Localization(double max_speed_mps) : max_speed_mps_(max_speed_mps) {}

  /// The run's first frame is surely in the world; those that follow it are by arrive().
  void trust(const KeyframeRelativePose& pose, Timestamp stamp) { trusted_ = {{pose, stamp}}; }

  /// A frame with a pose, and the last one before it in the same map.
  struct Step {
    FrameId frame = kNoFrame;
    Timestamp stamp, last_stamp;
    SE3 T_camera_world, T_last_world;
    bool was_lost = false;  ///< in the frame before
    /// An IMU led here meanwhile: where it says that the camera is by now.
    std::optional<SE3> T_odom_coasted{};

    [[nodiscard]] SE3 T_now_last() const { return T_camera_world * T_last_world.inverse(); }
  };
  enum class Arrival : std::uint8_t {
    kFollowed,    ///< from frame to frame
    kByView,      ///< it jumped, or was unseen for long: known by what it sees alone
    kCarriedOff,  ///< it was lost, and is found where it cannot have come by itself
  };
  /// Without a pose, by an IMU or wheels alone.
  void coast(const SE3& T_odom_camera) { odometry_.place_at(T_odom_camera); }
  /// Odometry goes along, unless it was lost. From kByView and kCarriedOff on the place is
  /// provisional, see Odometry::doubt().
  [[nodiscard]] Arrival arrive(const Step& step, const LocalView& view);
  /// From here on its place is known by what it sees alone: found without anything before, or in a
  /// submap, which may be joined to another room. Ground mapped since proves nothing.
  void doubt(FrameId frame);

  /// See TrackResult.
  struct Place {
    SE3 T_world_camera, T_odom_camera, T_world_odom;
    double correction_m = 0;
    bool provisional = false;
    bool unplaced = false;
  };
  /// After arrive().
  [[nodiscard]] Place place(const SE3& T_camera_world, const LocalView& view);

  /// How far from the last trusted frame the camera can be by now.
  [[nodiscard]] double reach_m(Timestamp now) const;
  [[nodiscard]] const SE3& T_odom_camera() const { return odometry_.T_odom_camera(); }

 private:
  struct Trusted {
    KeyframeRelativePose pose;
    Timestamp stamp;
  };
  [[nodiscard]] bool is_carried_off(const Step& step, const LocalView& view) const;
  [[nodiscard]] bool is_known_by_view_alone(const Step& step, const LocalView& view) const;

  double max_speed_mps_;
  Odometry odometry_;
  std::optional<Trusted> trusted_;
  FrameId doubtful_since_ = kNoFrame;   // the first of several doubts
  std::optional<double> usual_step_s_;  // of frames that follow each other
  double last_step_s_ = std::numeric_limits<double>::infinity();
};

}  // namespace ygslam
