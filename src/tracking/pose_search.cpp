#include "tracking/pose_search.hpp"

#include <utility>

#include "core/check.hpp"
#include "core/trace.hpp"
#include "tracking/view_poses.hpp"

namespace ygslam {

PoseSearch::PoseSearch(const Tools& tools, const RelocalizerConfig& relocalizer, int least_inliers)
    : tools_(tools),
      relocalizer_(relocalizer, tools.camera, tools.estimator),
      map_rival_(tools.estimator, uses_geometry(tools.classifier.config().mode)),
      confirmed_(relocalizer.min_inliers),
      least_inliers_(least_inliers) {}

PoseSearch::Guess without_newest(PoseSearch::Guess guess, const SE3& T_odom_last) {
  guess.inertial = without_newest(*guess.inertial);
  guess.T_guess_world = guess.inertial->T_odom_camera.inverse() * T_odom_last * guess.T_last_world;
  return guess;
}

InertialVerdict verdict_on(const std::optional<PoseResult>& pose, const PoseSearch::Guess& guess) {
  std::optional<SeenCamera> seen;
  if (pose) seen = {pose->T_camera_world, pose->covariance.value_or(Mat6::Zero())};
  return verdict_of(guess.inertial, seen, guess.T_guess_world);
}

SE3 PoseSearch::last_pose(TrackedFrame& last, const LocalView& view) const {
  if (view.empty()) return last.pose.T_camera_reference;
  for (const ViewKeyframe& keyframe : view.keyframes)
    if (keyframe.data->frame == last.seen.frame->id) last.pose = {keyframe.data->id, SE3()};
  const auto T_last_world = pose_in(view, last.pose);
  CHECK(T_last_world, "views reach from the keyframe they were asked for to the last one");
  if (last.view->deformations == view.deformations) return *T_last_world;
  // Where the world was bent the frame's landmarks, seen first by several keyframes, did not all
  // move as its reference keyframe did; the difference would look like a motion of the camera.
  return tools_.estimator.follow_landmarks(last, view, *T_last_world).value_or(*T_last_world);
}

FoundPose PoseSearch::step(const FrameFeatures& seen, const From& from, const Guess& guess,
                           Rng& rng) {
  FoundPose found = follow(seen, from, guess, rng);
  if (!is_seen(from.state) && found.pose && found.pose->landmark_inliers < confirmed_) {
    found.pose.reset();  // after a loss only a pose that the map confirms counts
  }
  const bool is_followed = found.pose && found.pose->inliers >= least_inliers_;
  const bool relocalises = !is_followed && !from.view.empty();
  if (relocalises) {
    // As the rows were read: what the velocity came from was wrong.
    found.seen = tools_.shutter.corrected(std::move(found.seen), Vec6::Zero());
    found.pose = relocalizer_.step(found.seen, from.view, rng);
  }
  if (!found.pose) return found;
  found.jump = jump_of(found.pose->T_camera_world, seen, from.last, guess);
  if (relocalises) found.jump.from_prediction_m = 0;
  return found;
}

PoseJump PoseSearch::jump_of(const SE3& T_camera_world, const FrameFeatures& seen,
                             const TrackedFrame& last, const Guess& guess) {
  return {centre_distance_m(T_camera_world, guess.T_guess_world),
          centre_distance_m(T_camera_world, guess.T_last_world),
          seconds_between(seen.frame->stamp, last.seen.frame->stamp)};
}

/// From the previous frame to this one and on to the map.
FoundPose PoseSearch::follow(const FrameFeatures& seen, const From& from, const Guess& guess,
                             Rng& rng) const {
  const auto& [T_last_world, T_guess_world, inertial] = guess;
  const auto match_previous = [&](const FrameFeatures& now, const TrackedFrame& last) {
    return tools_.estimator.match_previous_frame(now, last, T_last_world, from.view, T_guess_world,
                                                 rng);
  };
  auto first = match_previous(seen, from.last);
  if (!first) return {.seen = seen};
  const SE3 T_now_last = first->solution.T_camera_world * T_last_world.inverse();
  const Vec6 body_velocity = inertial
                                 ? inertial->body_velocity
                                 : tools_.motion_model.body_velocity(seen.frame->stamp, T_now_last);
  FoundPose found{.seen = tools_.shutter.corrected(seen, body_velocity)};
  if (from.first_keyframe_is_due) {  // the first frame's velocity shows only now
    TrackedFrame last = from.last;
    last.seen = tools_.shutter.corrected(std::move(last.seen), body_velocity);
    first = match_previous(found.seen, last);
    found.first_seen = std::move(last.seen);
  }
  if (first) found.pose = tools_.estimator.match_map(found.seen, from.view, *first);
  return found;
}

FoundPose PoseSearch::held_against_map(ObservedFrame& now, FoundPose found, const From& from,
                                       const Guess& guess) const {
  if (!map_rival_.is_wanted(found.pose, from.view)) return found;
  const MapRival::Input in{found.pose, found.seen, now.evidence.points, from.view,
                           guess.T_guess_world};
  auto [rival, contested] = map_rival_.step(in);
  if (found.pose) found.pose->contested |= contested;
  if (!rival) return found;
  const SE3 T_now_last = rival->T_camera_world * guess.T_last_world.inverse();
  now.evidence = tools_.classifier.held_against(std::move(now.evidence), T_now_last);
  now.labels = tools_.classifier.classify(now.evidence);
  found.seen.static_weight = now.labels.weight;
  found.pose = std::move(rival);
  found.jump = jump_of(found.pose->T_camera_world, found.seen, from.last, guess);
  return found;
}

FoundPose PoseSearch::held_against_screens(ObservedFrame& now, FoundPose found, const From& from,
                                           const Guess& guess, ScreenWatch& screens, Rng& rng) {
  const trace::Span span("screens");
  if (!is_seen(from.state)) return found;
  const ScreenWatch::Before before{from.last, guess.T_last_world, from.last.T_odom_camera,
                                   from.view};
  SE3 T_guess_world = guess.T_guess_world;
  bool contested = false;
  if (found.pose) {
    auto looked = screens.step({now, found.seen, *found.pose, before});
    contested = looked.contested;
    if (looked.without) {
      now = std::move(looked.without->now);
      T_guess_world = looked.without->T_camera_world;
      found = step(now.seen, from, {guess.T_last_world, T_guess_world, guess.inertial}, rng);
    }
  }
  if (auto carried = screens.carried(found.pose, T_guess_world, found.seen, before)) {
    found.pose = std::move(carried);
    found.jump.from_prediction_m = 0;
    return found;
  }
  if (!found.pose) return found;
  found.pose->contested |= contested || screens.leave_too_few(*found.pose);
  found.pose->T_camera_world = screens.steadied(*found.pose, found.seen, before);
  return found;
}

}  // namespace ygslam
