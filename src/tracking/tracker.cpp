#include "tracking/tracker.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "core/trace.hpp"
#include "tracking/object_view.hpp"
#include "tracking/view_poses.hpp"

namespace ygslam {

Tracker::Tracker(const TrackerConfig& config, const OrbConfig& orb, const DynamicConfig& dynamic,
                 const Camera& camera, std::uint64_t seed)
    : config_(config),
      camera_(camera),
      shutter_(camera),
      orb_(orb),
      follower_(config.follow, camera, orb_.scales()),
      classifier_(dynamic, camera, seed),
      objects_(config.objects, camera),
      pose_estimator_(config.pose, camera, orb_.scales()),
      ego_mask_(config.ego_mask, camera.config(), pose_estimator_, config.judge.min_inliers),
      screens_(config.screens, camera, orb_.scales(), config.pose.noise, classifier_),
      motion_model_(config.motion_model),
      search_({camera, shutter_, classifier_, pose_estimator_, motion_model_}, config.relocalizer,
              config.judge.least_inliers()),
      calibration_(camera, config.calibrated),
      localization_(config.judge.max_jump_mps),
      judge_(config.judge),
      submaps_(config.starts_submaps && config.proposes_keyframes, config.min_start_points,
               config.free_space, camera),
      keyframes_(config.keyframe, config.min_start_points),
      rng_(seed) {}

Tracker::SeenFrame Tracker::look(const FramePtr& frame,
                                 const std::optional<PosePrediction>& predicted) {
  const ScopedTimer timer;
  const auto inertial = while_certain(predicted);
  const PredictedMotion motion = predicted_motion(*frame, inertial);
  auto predicted_ends = predicted_flow(motion);
  FrameFlow flow = classifier_.follow(*frame, predicted_ends);
  FrameFeatures features = see(frame, predicted_ends, flow);
  return {std::move(features),       motion,          inertial,
          std::move(predicted_ends), std::move(flow), timer.wall_ms()};
}

TrackResult Tracker::step(SeenFrame seen, const LocalViewPtr& view,
                          std::span<const SegmentationPtr> masks, bool mapper_busy) {
  const trace::Span span("track");
  const ScopedTimer timer;
  const FramePtr frame = seen.features.frame;
  ObservedFrame now =
      observe(std::move(seen.features), masks, seen.predicted_ends, std::move(seen.flow));
  const int mask_age_frames = now.evidence.mask_age_frames;
  const double motion_ms = timer.wall_ms();
  TrackResult result =
      judge_.state() != TrackState::kWaiting
          ? track(std::move(now), seen.motion.T_now_last, seen.inertial, view, mapper_busy)
      : view->empty() ? start(std::move(now), view)
                      : start_in_map(std::move(now), view);
  tell_of_mask(*frame, *view, result);
  result.mask_age_frames = mask_age_frames;
  result.masks = {masks.begin(), masks.end()};
  result.orb_ms = seen.orb_ms;
  result.motion_ms = motion_ms;
  result.pose_ms = timer.wall_ms() - motion_ms;
  return result;
}

void Tracker::tell_of_mask(const RgbdFrame& frame, const LocalView& view, TrackResult& result) {
  const trace::Span span("fixed to the camera");
  const TrackedFrame* tracked = last_ && last_->seen.frame->id == frame.id ? &*last_ : nullptr;
  auto told =
      ego_mask_.step({frame.stamp, tracked, view, result.state == TrackState::kTracking}, rng_);
  if (result.candidate)
    result.candidate->frame = without_masked_depth(result.candidate->frame, told.pixels);
  result.ego_mask = std::move(told.found);
  result.masked_pixels = std::move(told.pixels);
  result.ego_mask_grew = told.grew;
  std::ranges::move(told.retracked, std::back_inserter(result.retracked));
}

TrackResult Tracker::track(ObservedFrame now, const SE3& T_now_last,
                           const std::optional<PosePrediction>& inertial, const LocalViewPtr& view,
                           bool mapper_busy) {
  const SE3 T_last_world = search_.last_pose(*last_, *view);
  const PoseSearch::From from{*last_, judge_.state(), first_keyframe_is_due_, *view};
  PoseSearch::Guess guess{T_last_world, T_now_last * T_last_world, inertial};
  now = screens_.labelled_ahead(std::move(now), localization_.T_odom_camera(), T_now_last);
  FoundPose found = search_.step(now.seen, from, guess, rng_);
  found = search_.held_against_map(now, std::move(found), from, guess);
  found = search_.held_against_screens(now, std::move(found), from, guess, screens_, rng_);
  now.seen = std::move(found.seen);
  now.evidence.frame.features = now.seen.features;
  auto first_keyframe = late_first_keyframe(std::move(found.first_seen));
  const TrackState before = judge_.state();
  const bool was_lost = !is_seen(before);
  InertialVerdict verdict = verdict_on(found.pose, guess);
  if (verdict.may_coast && camera_hangs(*now.seen.frame, *last_->seen.frame, T_now_last)) {
    found.pose.reset();
    verdict = verdict_on(found.pose, guess);
  }
  const TrackState state = judge_.next_state(found.pose, found.jump, verdict);
  if (judge_.went_along()) guess = without_newest(guess, last_->T_odom_camera);
  if (state == TrackState::kCoasting)
    return coast(std::move(now), view, guess, std::move(first_keyframe));
  if (state == TrackState::kLost)
    return stay_lost(std::move(now), view, T_last_world, std::move(first_keyframe));

  const PoseResult& pose = *found.pose;
  const bool coasted = before == TrackState::kCoasting && verdict.agrees;
  const auto arrival = arrive(
      {now.seen.frame->id, now.seen.frame->stamp, last_->seen.frame->stamp, pose.T_camera_world,
       T_last_world, was_lost, coasted ? std::optional(inertial->T_odom_camera) : std::nullopt},
      *view);
  if (!coasted) coasting_.forget();
  auto placed_again =
      coasting_.found_again(last_->pose, last_->seen.frame->stamp, now.seen.frame->stamp,
                            pose.T_camera_world * T_last_world.inverse(), T_now_last);
  const Localization::Place place = localization_.place(pose.T_camera_world, *view);
  screens_.follow(now, localization_.T_odom_camera());
  now = compared_with_map(std::move(now), pose, *view, camera_, classifier_, config_.free_space);
  auto objects = follow_objects(now, was_lost, place.T_world_odom);
  classifier_.remember(std::move(now.evidence), now.labels.label, objects_.resting_points());
  last_ = with_pose(std::move(now.seen), pose, view, place.T_odom_camera);
  MapRequest request = ask_mapper(pose, arrival, mapper_busy);
  if (!request.candidate) request.candidate = std::move(first_keyframe);
  CameraFindings camera = estimate_camera();
  TrackResult result = tracked(place, pose, std::move(now.labels), std::move(objects),
                               std::move(request), std::move(camera));
  result.retracked = std::move(placed_again);
  return result;
}

TrackResult Tracker::start(ObservedFrame now, const LocalViewPtr& view) {
  classifier_.remember(std::move(now.evidence), now.labels.label);
  constexpr float kAnyWeight = std::numeric_limits<float>::min();
  const int usable = now.seen.usable_points(kAnyWeight);
  if (usable < config_.min_start_points)
    return {.features = now.seen.features, .labels = std::move(now.labels)};
  judge_.start();
  motion_model_.reset(now.seen.frame->stamp);
  last_ = without_landmarks(std::move(now.seen), {}, view, localization_.T_odom_camera());
  localization_.trust(last_->pose, last_->seen.frame->stamp);
  first_keyframe_is_due_ = shutter_.may_roll();
  TrackResult result{.state = TrackState::kTracking,
                     .features = last_->seen.features,
                     .labels = std::move(now.labels),
                     .landmarks = last_->landmarks,
                     .inliers = usable};
  if (!first_keyframe_is_due_) result.candidate = keyframes_.make(*last_, 0);
  return result;
}

TrackResult Tracker::start_in_map(ObservedFrame now, const LocalViewPtr& view) {
  classifier_.remember(std::move(now.evidence), now.labels.label);
  motion_model_.reset(now.seen.frame->stamp);
  const auto pose = search_.relocalised(now.seen, *view, rng_);
  if (!judge_.start_in_map(pose)) {
    TrackResult result{.state = TrackState::kLost, .features = now.seen.features};
    result.candidate =
        offer_submap(std::move(now.seen), now.labels.too_few_static, view, std::nullopt);
    result.labels = std::move(now.labels);
    if (result.candidate) judge_.lose();
    return result;
  }
  localization_.doubt(now.seen.frame->id);
  const Localization::Place place = localization_.place(pose->T_camera_world, *view);
  last_ = with_pose(std::move(now.seen), *pose, view, place.T_odom_camera);
  MapRequest request = ask_mapper(*pose, Localization::Arrival::kByView, true);
  return tracked(place, *pose, std::move(now.labels), {}, std::move(request), {});
}

/// As an IMU or wheels say, for as long as that is good enough.
TrackResult Tracker::coast(ObservedFrame now, const LocalViewPtr& view,
                           const PoseSearch::Guess& guess,
                           std::optional<KeyframeCandidate> first_keyframe) {
  motion_model_.reset(now.seen.frame->stamp);
  objects_.lose_points();
  screens_.forget();
  localization_.coast(guess.inertial->T_odom_camera);
  const Localization::Place place = localization_.place(guess.T_guess_world, *view);
  coasting_.add(now.seen.frame->id, now.seen.frame->stamp,
                guess.T_guess_world * guess.T_last_world.inverse());
  classifier_.remember(std::move(now.evidence), now.labels.label);
  const FeaturesPtr features = now.seen.features;
  if (auto candidate = map_on(std::move(now.seen), now.labels.too_few_static, view, guess))
    first_keyframe = std::move(candidate);
  return {.state = TrackState::kCoasting,
          .T_world_camera = place.T_world_camera,
          .T_odom_camera = place.T_odom_camera,
          .T_world_odom = place.T_world_odom,
          .provisional = true,
          .unplaced = place.unplaced,
          .overruled = judge_.has_overruled(),
          .went_along = judge_.went_along(),
          .covariance = guess.inertial->covariance,
          .correction_m = place.correction_m,
          .pose = relative_to_keyframe(guess.T_guess_world, *view),
          .wanted_view = nearest_reference(guess.T_guess_world, *view),
          .candidate = std::move(first_keyframe),
          .features = features,
          .labels = std::move(now.labels)};
}

std::optional<KeyframeCandidate> Tracker::map_on(FrameFeatures seen, bool too_few_static,
                                                 const LocalViewPtr& view,
                                                 const PoseSearch::Guess& guess) {
  constexpr double kMostMappedStd_m = 0.25;  // beyond, the map would lie somewhere else
  if (position_std_m(*guess.inertial) > kMostMappedStd_m) return std::nullopt;
  if (!submaps_.may_map_on(seen, too_few_static, *view, guess.T_guess_world)) return std::nullopt;
  judge_.start();
  coasting_.forget();
  localization_.doubt(seen.frame->id);
  const KeyframeMotion motion =
      motion_by(*guess.inertial, guess.T_guess_world * guess.T_last_world.inverse(), last_->pose);
  last_ = without_landmarks(shutter_.corrected(std::move(seen), guess.inertial->body_velocity),
                            relative_to_keyframe(guess.T_guess_world, *view), view,
                            localization_.T_odom_camera());
  KeyframeCandidate candidate = keyframes_.make(*last_, view->map_version);
  candidate.motion = motion;
  return candidate;
}

TrackResult Tracker::stay_lost(ObservedFrame now, const LocalViewPtr& view, const SE3& T_last_world,
                               std::optional<KeyframeCandidate> first_keyframe) {
  coasting_.forget();
  motion_model_.reset(now.seen.frame->stamp);
  objects_.lose_points();
  screens_.forget();
  classifier_.remember(std::move(now.evidence), now.labels.label);
  TrackResult result{.state = TrackState::kLost,
                     .T_odom_camera = localization_.T_odom_camera(),
                     .candidate = std::move(first_keyframe),
                     .features = now.seen.features};
  if (auto submap =
          offer_submap(std::move(now.seen), now.labels.too_few_static, view, T_last_world))
    result.candidate = std::move(submap);
  result.labels = std::move(now.labels);
  return result;
}

TrackResult Tracker::tracked(const Localization::Place& place, const PoseResult& pose,
                             PointLabels labels, std::vector<TrackedObject> objects,
                             MapRequest request, CameraFindings camera) const {
  return {.state = judge_.state(),
          .T_world_camera = place.T_world_camera,
          .T_odom_camera = place.T_odom_camera,
          .T_world_odom = place.T_world_odom,
          .provisional = place.provisional,
          .unplaced = place.unplaced,
          .covariance = pose.covariance,
          .correction_m = place.correction_m,
          .pose = last_->pose,
          .read_out = last_->seen.read_out,
          .wanted_view = request.wanted_view,
          .candidate = std::move(request.candidate),
          .features = last_->seen.features,
          .labels = std::move(labels),
          .objects = std::move(objects),
          .landmarks = pose.landmarks,
          .shutter = camera.shutter,
          .guessed_read_out = camera.guessed_read_out,
          .camera_estimate = std::move(camera.estimate),
          .matches = pose.matches,
          .inliers = pose.inliers};
}

PredictedMotion Tracker::predicted_motion(const RgbdFrame& frame,
                                          const std::optional<PosePrediction>& inertial) {
  const auto expected = std::exchange(expected_motion_, std::nullopt);
  if (inertial && last_)
    return {inertial->T_odom_camera.inverse() * last_->T_odom_camera, inertial->body_velocity, 0};
  PredictedMotion motion = motion_model_.predict(frame.stamp);
  const bool follows = last_ && index(last_->seen.frame->id) + 1 == index(frame.id);
  if (!expected || !follows) return motion;
  motion.T_now_last = *expected;
  motion.body_velocity = motion_model_.body_velocity(frame.stamp, *expected);
  return motion;
}

std::optional<FlowPrediction> Tracker::predicted_flow(const PredictedMotion& motion) const {
  // A weak pose's motion is no good start for the flow; but where rows are read one after the
  // other, ends that are left where they are seen would look as if they moved.
  const TrackState state = judge_.state();
  const bool weak_will_do = !shutter_.times().is_global() && state == TrackState::kWeak;
  if (state != TrackState::kTracking && !weak_will_do) return std::nullopt;
  return FlowPrediction{
      motion.T_now_last, {shutter_.times(), motion.body_velocity}, motion.velocity_gain_per_s};
}

FrameFeatures Tracker::see(const FramePtr& frame, const std::optional<FlowPrediction>& predicted,
                           const FrameFlow& flow) {
  const trace::Span span("features");
  const PixelMaskPtr& mask = ego_mask_.look(*frame);
  auto seen =
      judge_.state() == TrackState::kTracking ? follower_.step({frame, flow, mask}) : std::nullopt;
  if (!seen) {
    seen = extract_features(orb_, camera_, frame, mask);
    follower_.start(*seen->features);
  }
  return predicted ? shutter_.corrected(std::move(*seen), predicted->read_out.body_velocity)
                   : std::move(*seen);
}

ObservedFrame Tracker::observe(FrameFeatures seen, std::span<const SegmentationPtr> masks,
                               const std::optional<FlowPrediction>& predicted, FrameFlow flow) {
  const trace::Span span("motion checks");
  FrameEvidence evidence = classifier_.observe(*seen.frame, seen.features, std::move(flow),
                                               seen.followed_from, masks, predicted);
  PointLabels labels = classifier_.classify(evidence);
  seen.static_weight = labels.weight;
  return {std::move(seen), std::move(evidence), std::move(labels), masks};
}

/// Once per frame that was matched with the one before. A rolling shutter's first keyframe waits
/// for the second frame, which shows how the camera moved.
std::optional<KeyframeCandidate> Tracker::late_first_keyframe(
    std::optional<FrameFeatures> first_seen) {
  keyframes_.count_frame();
  if (first_seen) last_->seen = std::move(*first_seen);
  if (!std::exchange(first_keyframe_is_due_, false)) return std::nullopt;
  return keyframes_.make(*last_, 0);
}

/// Takes the pose over into motion model, odometry and place.
Localization::Arrival Tracker::arrive(const Localization::Step& step, const LocalView& view) {
  submaps_.forget();
  if (step.was_lost) {
    motion_model_.reset(step.stamp);
    keyframes_.restart();  // a place just found again must prove itself before it is mapped
  } else {
    motion_model_.update(step.stamp, step.T_now_last());
  }
  return localization_.arrive(step, view);
}

std::vector<TrackedObject> Tracker::follow_objects(const ObservedFrame& now, bool was_lost,
                                                   const SE3& T_world_odom) {
  const trace::Span span("objects");
  if (classifier_.config().mode == DynamicMode::kOff || was_lost) {
    objects_.lose_points();
    return {};
  }
  return objects_.step(object_input(now, classifier_, camera_,
                                    {localization_.T_odom_camera(), T_world_odom},
                                    ego_mask_.pixels()));
}

/// Of the newest frame with a pose.
Tracker::MapRequest Tracker::ask_mapper(const PoseResult& pose, Localization::Arrival arrival,
                                        bool mapper_busy) {
  const trace::Span span("keyframe decision");
  const LocalViewPtr view = last_->view;
  keyframes_.remember_seen(pose.seen);
  const bool may_propose =
      config_.proposes_keyframes && judge_.state() == TrackState::kTracking && !view->empty();
  const bool begins_submap = arrival == Localization::Arrival::kCarriedOff && submaps_.enabled();
  if (may_propose && !begins_submap && keyframes_.wants(*last_, *view, pose, mapper_busy)) {
    if (!last_->seen.is_followed())
      return {keyframes_.make(*last_, view->map_version), std::nullopt};
    follower_.renew();
  }
  MapRequest request{std::nullopt, better_reference(*last_, *view)};
  if (begins_submap) {
    last_ =
        without_landmarks(std::move(last_->seen), last_->pose, view, localization_.T_odom_camera());
    request.candidate = keyframes_.make_submap(*last_, 0, view->map_version);
  }
  return request;
}

Tracker::CameraFindings Tracker::estimate_camera() {
  const trace::Span span("camera estimate");
  CameraFindings found;
  if (judge_.state() != TrackState::kTracking) return found;
  if (config_.calibrated.empty()) {
    if (!shutter_.known()) found.guessed_read_out = last_->seen.read_out;
    found.shutter = shutter_.step(*last_);
  } else {
    calibration_.add(*last_);
    found.estimate = calibration_.estimate();
  }
  return found;
}

std::optional<KeyframeCandidate> Tracker::offer_submap(FrameFeatures seen, bool too_few_static,
                                                       const LocalViewPtr& view,
                                                       const std::optional<SE3>& T_last_world) {
  const double travelled_m = localization_.reach_m(seen.frame->stamp);
  const auto reach_m = submaps_.consider(seen, too_few_static, *view, T_last_world, travelled_m);
  if (!reach_m) return std::nullopt;
  localization_.doubt(seen.frame->id);
  const auto pose = last_ ? last_->pose : KeyframeRelativePose{view->reference().data->id, SE3()};
  last_ = without_landmarks(shutter_.corrected(std::move(seen), Vec6::Zero()), pose, view,
                            localization_.T_odom_camera());
  return keyframes_.make_submap(*last_, *reach_m, view->map_version);
}

}  // namespace ygslam
