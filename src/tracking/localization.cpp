#include "tracking/localization.hpp"

#include <algorithm>
#include <utility>

namespace ygslam {
namespace {

constexpr double kSamePlace_m = 0.5;  // a loss that ends this near has moved nothing
constexpr double kGlance_s = 1.0;     // unseen for longer, the camera may have left the room
constexpr double kLongerStep = 1.5;   // than the step before: frames are missing

}  // namespace

double Localization::reach_m(Timestamp now) const {
  return trusted_ ? max_speed_mps_ * seconds_between(now, trusted_->stamp) + kSamePlace_m : 0;
}

bool Localization::is_carried_off(const Step& step, const LocalView& view) const {
  if (!step.was_lost || !view.placed) return false;
  const auto T_trusted_world = trusted_ ? pose_in(view, trusted_->pose) : std::nullopt;
  return !T_trusted_world ||
         centre_distance_m(step.T_camera_world, *T_trusted_world) > reach_m(step.stamp);
}

bool Localization::is_known_by_view_alone(const Step& step, const LocalView& view) const {
  if (step.T_odom_coasted) return false;
  const double unseen_s = seconds_between(step.stamp, step.last_stamp);
  const double untrusted_s =
      view.placed && trusted_ ? seconds_between(step.stamp, trusted_->stamp) : 0;
  // A camera that takes an image every two seconds is not unseen in between.
  const double glance_s = std::max(kGlance_s, kLongerStep * usual_step_s_.value_or(unseen_s));
  const double jump_m = centre_distance_m(step.T_camera_world, step.T_last_world);
  return std::max(unseen_s, untrusted_s) > glance_s ||
         jump_m > max_speed_mps_ * unseen_s + kSamePlace_m;
}

Localization::Arrival Localization::arrive(const Step& step, const LocalView& view) {
  if (step.T_odom_coasted) {
    odometry_.place_at(*step.T_odom_coasted);
  } else if (!step.was_lost) {
    odometry_.move(step.T_now_last());
  }
  Arrival arrival = Arrival::kFollowed;
  if (is_carried_off(step, view)) {
    arrival = Arrival::kCarriedOff;
  } else if (is_known_by_view_alone(step, view)) {
    arrival = Arrival::kByView;
  }
  if (arrival != Arrival::kFollowed) doubt(step.frame);
  // The shorter of two steps in a row: what is missing once does not make the camera a slow one.
  const double step_s = seconds_between(step.stamp, step.last_stamp);
  if (!step.was_lost) usual_step_s_ = std::min(step_s, std::exchange(last_step_s_, step_s));
  if (view.placed && arrival != Arrival::kCarriedOff)
    trust(relative_to_keyframe(step.T_camera_world, view), step.stamp);
  return arrival;
}

void Localization::doubt(FrameId frame) {
  if (!odometry_.is_doubtful()) doubtful_since_ = frame;
  odometry_.doubt();
}

Localization::Place Localization::place(const SE3& T_camera_world, const LocalView& view) {
  const FrameId mapped = view.empty() ? doubtful_since_ : view.reference().data->frame;
  const bool sees_known_ground = mapped == kNoFrame || index(mapped) < index(doubtful_since_);
  const SE3 T_world_camera = T_camera_world.inverse();
  const auto [T_world_odom, correction_m, provisional] =
      odometry_.place(T_world_camera, sees_known_ground);
  return {T_world_camera, T_odom_camera(), T_world_odom, correction_m, provisional || !view.placed,
          !view.placed};
}

}  // namespace ygslam
