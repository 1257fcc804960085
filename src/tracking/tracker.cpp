#include "tracking/tracker.hpp"

#include <limits>
#include <utility>

#include "tracking/view_poses.hpp"

namespace ygslam {
namespace {

constexpr int kFewBesideScreen = 100;  // points
constexpr double kContradiction = 60;  // ScreenFinder::Output::conflict; noise is 22 at most
constexpr float kAnyWeight = std::numeric_limits<float>::min();

TrackedFrame without_landmarks(FrameFeatures seen, const KeyframeRelativePose& pose,
                               const LocalViewPtr& view) {
  std::vector<LandmarkId> none(seen.features->size(), kNoLandmark);
  return {std::move(seen), std::move(none), pose, view, SE3()};
}

/// Nothing is known that explains its motion.
bool may_tell(const PointEvidence& evidence) {
  return evidence.semantic.label != SemanticLabel::kMovable && !evidence.on_screen &&
         !evidence.in_free_space;
}

TrackedFrame with_pose(FrameFeatures seen, const PoseResult& pose, const LocalViewPtr& view) {
  return {std::move(seen), pose.landmarks, relative_to_keyframe(pose.T_camera_world, *view), view,
          pose.T_camera_world};
}

}  // namespace

Tracker::Tracker(const TrackerConfig& config, const OrbConfig& orb, const DynamicConfig& dynamic,
                 const Camera& camera, std::uint64_t seed)
    : config_(config),
      camera_(camera),
      shutter_(camera),
      ego_mask_(config.ego_mask, camera.config()),
      orb_(orb),
      classifier_(dynamic, camera, seed),
      objects_(config.objects, camera),
      pose_estimator_(config.pose, camera, orb_.scales()),
      relocalizer_(config.relocalizer, camera, pose_estimator_),
      retracker_(pose_estimator_, config.judge.min_inliers),
      screen_finder_(camera, orb_.scales(), config.pose.noise),
      motion_model_(config.motion_model),
      calibration_(camera, config.calibrated),
      localization_(config.judge.max_jump_mps),
      judge_(config.judge),
      submaps_(config.starts_submaps && config.proposes_keyframes, config.min_start_points,
               config.free_space, camera),
      keyframes_(config.keyframe, config.min_start_points),
      rng_(seed) {}

TrackResult Tracker::step(const FramePtr& frame, const LocalViewPtr& view,
                          std::span<const SegmentationPtr> masks, bool mapper_busy) {
  const ScopedTimer timer;
  ego_mask_.step(*frame);
  const PredictedMotion motion = predicted_motion(*frame);
  const auto predicted = predicted_flow(motion);
  FrameFeatures seen = see(frame, predicted);
  const double orb_ms = timer.wall_ms();
  Observed now = observe(std::move(seen), masks, predicted);
  const int mask_age_frames = now.evidence.mask_age_frames;
  const double motion_ms = timer.wall_ms() - orb_ms;
  TrackResult result = judge_.state() != TrackState::kWaiting
                           ? track(with_known_screens(std::move(now), motion.T_now_last),
                                   motion.T_now_last, view, mapper_busy)
                       : view->empty() ? start(std::move(now), view)
                                       : start_in_map(std::move(now), view);
  tell_of_mask(*frame, *view, result);
  result.mask_age_frames = mask_age_frames;
  result.masks = {masks.begin(), masks.end()};
  result.orb_ms = orb_ms;
  result.motion_ms = motion_ms;
  result.pose_ms = timer.wall_ms() - orb_ms - motion_ms;
  return result;
}

void Tracker::tell_of_mask(const RgbdFrame& frame, const LocalView& view, TrackResult& result) {
  if (result.candidate)
    result.candidate->frame = without_masked_depth(result.candidate->frame, ego_mask_.pixels());
  result.ego_mask = ego_mask_.found();
  result.masked_pixels = ego_mask_.pixels();
  result.ego_mask_grew = ego_mask_.take_growth(frame.stamp);
  if (!last_ || last_->seen.frame->id != frame.id) return;
  retracker_.add(*last_, result.ego_mask_grew ? result.ego_mask : nullptr);
  result.retracked = retracker_.step(view, result.state == TrackState::kTracking, rng_);
}

TrackResult Tracker::track(Observed now, const SE3& T_now_last, const LocalViewPtr& view,
                           bool mapper_busy) {
  const SE3 T_last_world = last_pose(*view);
  FoundPose found = find_pose(now.seen, *view, T_last_world, T_now_last * T_last_world);
  found = look_for_screens(now, std::move(found), *view, T_last_world);
  now.seen = std::move(found.seen);
  now.evidence.frame.features = now.seen.features;
  auto first_keyframe = late_first_keyframe(std::move(found.first_seen));
  const bool was_lost = judge_.state() == TrackState::kLost;
  if (judge_.next_state(found.pose, found.jump) == TrackState::kLost)
    return stay_lost(std::move(now), view, T_last_world, std::move(first_keyframe));

  const PoseResult& pose = *found.pose;
  const auto arrival = arrive({now.seen.frame->id, now.seen.frame->stamp, last_->seen.frame->stamp,
                               pose.T_camera_world, T_last_world, was_lost},
                              *view);
  const Localization::Place place = localization_.place(pose.T_camera_world, *view);
  follow_screens(now);
  now = compared_with_map(std::move(now), pose, *view);
  auto objects = follow_objects(now, was_lost, place.T_world_odom);
  classifier_.remember(std::move(now.evidence), now.labels.label, objects_.resting_points());
  last_ = with_pose(std::move(now.seen), pose, view);
  MapRequest request = ask_mapper(pose, arrival, mapper_busy);
  if (!request.candidate) request.candidate = std::move(first_keyframe);
  CameraFindings camera = estimate_camera();
  return tracked(place, pose, std::move(now.labels), std::move(objects), std::move(request),
                 std::move(camera));
}

TrackResult Tracker::start(Observed now, const LocalViewPtr& view) {
  classifier_.remember(std::move(now.evidence), now.labels.label);
  const int usable = now.seen.usable_points(kAnyWeight);
  if (usable < config_.min_start_points)
    return {.features = now.seen.features, .labels = std::move(now.labels)};
  judge_.start();
  motion_model_.reset(now.seen.frame->stamp);
  last_ = without_landmarks(std::move(now.seen), {}, view);
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

TrackResult Tracker::start_in_map(Observed now, const LocalViewPtr& view) {
  classifier_.remember(std::move(now.evidence), now.labels.label);
  motion_model_.reset(now.seen.frame->stamp);
  const auto pose = relocalizer_.step(now.seen, *view, rng_);
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
  last_ = with_pose(std::move(now.seen), *pose, view);
  MapRequest request = ask_mapper(*pose, Localization::Arrival::kByView, true);
  return tracked(place, *pose, std::move(now.labels), {}, std::move(request), {});
}

TrackResult Tracker::stay_lost(Observed now, const LocalViewPtr& view, const SE3& T_last_world,
                               std::optional<KeyframeCandidate> first_keyframe) {
  motion_model_.reset(now.seen.frame->stamp);
  objects_.lose_points();
  screens_.clear();
  screen_finder_.forget();
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

PredictedMotion Tracker::predicted_motion(const RgbdFrame& frame) {
  PredictedMotion motion = motion_model_.predict(frame.stamp);
  const auto expected = std::exchange(expected_motion_, std::nullopt);
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

FrameFeatures Tracker::see(const FramePtr& frame, const std::optional<FlowPrediction>& predicted) {
  FrameFeatures seen = extract_features(orb_, camera_, frame, ego_mask_.pixels());
  return predicted ? corrected(std::move(seen), predicted->read_out.body_velocity) : seen;
}

FrameFeatures Tracker::corrected(FrameFeatures seen, const Vec6& body_velocity) const {
  return shutter_corrected(std::move(seen), camera_, shutter_.times(), body_velocity);
}

Tracker::Observed Tracker::observe(FrameFeatures seen, std::span<const SegmentationPtr> masks,
                                   const std::optional<FlowPrediction>& predicted) {
  FrameEvidence evidence = classifier_.observe(*seen.frame, seen.features, masks, predicted);
  PointLabels labels = classifier_.classify(evidence);
  seen.static_weight = labels.weight;
  return {std::move(seen), std::move(evidence), std::move(labels), masks};
}

/// T_last_world in the map as the view has it.
SE3 Tracker::last_pose(const LocalView& view) {
  if (view.empty()) return last_->pose.T_camera_reference;
  for (const ViewKeyframe& keyframe : view.keyframes)
    if (keyframe.data->frame == last_->seen.frame->id) last_->pose = {keyframe.data->id, SE3()};
  const auto T_last_world = pose_in(view, last_->pose);
  CHECK(T_last_world, "views reach from the keyframe they were asked for to the last one");
  if (last_->view->deformations == view.deformations) return *T_last_world;
  // Where the world was bent the frame's landmarks, seen first by several keyframes, did not all
  // move as its reference keyframe did; the difference would look like a motion of the camera.
  return pose_estimator_.follow_landmarks(*last_, view, *T_last_world).value_or(*T_last_world);
}

Tracker::FoundPose Tracker::find_pose(const FrameFeatures& seen, const LocalView& view,
                                      const SE3& T_last_world, const SE3& T_guess_world) {
  FoundPose found = follow(seen, view, T_last_world, T_guess_world);
  if (judge_.state() == TrackState::kLost && found.pose &&
      found.pose->landmark_inliers < config_.relocalizer.min_inliers) {
    found.pose.reset();  // after a loss only a pose that the map confirms counts
  }
  const bool is_followed = found.pose && found.pose->inliers >= config_.judge.least_inliers();
  const bool relocalises = !is_followed && !view.empty();
  if (relocalises) {
    // As the rows were read: what the velocity came from was wrong.
    found.seen = corrected(std::move(found.seen), Vec6::Zero());
    found.pose = relocalizer_.step(found.seen, view, rng_);
  }
  if (!found.pose) return found;
  const SE3& T_camera_world = found.pose->T_camera_world;
  found.jump = {relocalises ? 0 : centre_distance_m(T_camera_world, T_guess_world),
                centre_distance_m(T_camera_world, T_last_world),
                seconds_between(seen.frame->stamp, last_->seen.frame->stamp)};
  return found;
}

/// From the previous frame to this one and on to the map.
Tracker::FoundPose Tracker::follow(const FrameFeatures& seen, const LocalView& view,
                                   const SE3& T_last_world, const SE3& T_guess_world) {
  const auto match_previous = [&](const FrameFeatures& now, const TrackedFrame& last) {
    return pose_estimator_.match_previous_frame(now, last, T_last_world, view, T_guess_world, rng_);
  };
  auto first = match_previous(seen, *last_);
  if (!first) return {.seen = seen};
  const SE3 T_now_last = first->solution.T_camera_world * T_last_world.inverse();
  const Vec6 body_velocity = motion_model_.body_velocity(seen.frame->stamp, T_now_last);
  FoundPose found{.seen = corrected(seen, body_velocity)};
  if (first_keyframe_is_due_) {  // the first frame's velocity shows only now
    TrackedFrame last = *last_;
    last.seen = corrected(std::move(last.seen), body_velocity);
    first = match_previous(found.seen, last);
    found.first_seen = std::move(last.seen);
  }
  if (first) found.pose = pose_estimator_.match_map(found.seen, view, *first);
  return found;
}

Tracker::Observed Tracker::with_known_screens(Observed now, const SE3& T_now_last) const {
  if (screens_.empty()) return now;
  const auto& ego_motion = now.evidence.ego_motion;
  const SE3& T_moved = ego_motion ? ego_motion->T_current_previous : T_now_last;
  return labelled_by_screens(std::move(now), localization_.T_odom_camera() * T_moved.inverse());
}

Tracker::Observed Tracker::labelled_by_screens(Observed now, const SE3& T_odom_camera) const {
  std::vector<std::uint8_t> on_screen;
  for (const Feature& f : now.seen.features->points) {
    const Vec3 p_camera = camera_.unproject(f.ideal_px.cast<double>(), f.depth_m);
    on_screen.push_back(f.depth_m > 0 && screens_.shows(T_odom_camera * p_camera, f.depth_m));
  }
  now.evidence = with_screens(std::move(now.evidence), on_screen);
  now.labels = classifier_.classify(now.evidence);
  now.seen.static_weight = now.labels.weight;
  return now;
}

/// What seems to move, but is on nothing that is known to be able to.
std::vector<Vec3> Tracker::moving_unmasked(const Observed& now) const {
  std::vector<Vec3> p_moving;
  const auto motion = classifier_.motion_of(now.evidence);
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const Feature& f = now.seen.features->points[i];
    const PointEvidence& evidence = now.evidence.points[i];
    if (motion[i] == PointMotion::kMoves && f.depth_m > 0 && !evidence.in_free_space &&
        evidence.semantic.label != SemanticLabel::kMovable)
      p_moving.push_back(camera_.unproject(f.ideal_px.cast<double>(), f.depth_m));
  }
  return p_moving;
}

int Tracker::unexplained_motions(const Observed& now) const {
  const auto motion = classifier_.motion_of(now.evidence);
  int count = 0;
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const PointEvidence& evidence = now.evidence.points[i];
    count += motion[i] == PointMotion::kMoves && may_tell(evidence) ? 1 : 0;
  }
  return count;
}

/// Features that go on from the frame before, with their place in the world as it was known there.
std::vector<ScreenFinder::Point> Tracker::points_before(const Observed& now, const PoseResult& pose,
                                                        const LocalView& view,
                                                        const SE3& T_last_world) const {
  const SE3 T_world_last = T_last_world.inverse();
  std::vector<ScreenFinder::Point> points;
  for (std::uint32_t i = 0; i < now.evidence.points.size(); ++i) {
    const PointEvidence& evidence = now.evidence.points[i];
    const std::int32_t k = now.evidence.links[i];
    if (k < 0 || !may_tell(evidence) || !(now.seen.features->points[i].depth_m > 0)) continue;
    const ViewLandmark* landmark = view.landmark(pose.landmarks[i]);
    if (!landmark) landmark = view.landmark(last_->landmarks[static_cast<std::size_t>(k)]);
    const Feature& before = last_->seen.features->points[static_cast<std::size_t>(k)];
    if (landmark) {
      points.push_back({i, landmark->p_world, true});
    } else if (before.depth_m > 0) {
      const Vec3 p_last = camera_.unproject(before.ideal_px.cast<double>(), before.depth_m);
      points.push_back({i, T_world_last * p_last, false});
    }
  }
  return points;
}

Tracker::FoundPose Tracker::look_for_screens(Observed& now, FoundPose found, const LocalView& view,
                                             const SE3& T_last_world) {
  if (!found.pose || !uses_geometry(classifier_.config().mode) ||
      judge_.state() == TrackState::kLost)
    return found;
  const SE3& T_odom_last = localization_.T_odom_camera();
  const auto place_at = [&](const SE3& T_camera_world) {
    return ScreenFinder::Place{found.seen, T_camera_world,
                               T_odom_last * T_last_world * T_camera_world.inverse()};
  };
  const auto looked =
      screen_finder_.step(place_at(found.pose->T_camera_world), unexplained_motions(now),
                          [&] { return points_before(now, *found.pose, view, T_last_world); });
  if (looked.found) {
    const SE3& T_without_world = looked.found->T_camera_world;
    const SE3 T_odom_camera = place_at(T_without_world).T_odom_camera;
    screens_.add(looked.found->screen, T_odom_camera, now.seen.frame->stamp);
    now.evidence =
        classifier_.held_against(std::move(now.evidence), T_without_world * T_last_world.inverse());
    now = labelled_by_screens(std::move(now), T_odom_camera);
    found = find_pose(now.seen, view, T_last_world, T_without_world);
  }
  if (!found.pose) return found;
  PoseResult& pose = *found.pose;
  pose.contested =
      looked.undecided || (!screens_.empty() && !looked.found && looked.conflict > kContradiction);
  // A screen leaves few points, at the image's edges; depth is known everywhere.
  if (!screens_.empty() && pose.inliers < kFewBesideScreen && pose.covariance)
    pose.T_camera_world = screen_finder_.with_depth(
        place_at(pose.T_camera_world), pose.T_camera_world, pose.covariance->inverse());
  return found;
}

/// With the final pose: what moves on screens that are known keeps them known.
void Tracker::follow_screens(const Observed& now) {
  const Timestamp stamp = now.seen.frame->stamp;
  const SE3& T_odom_camera = localization_.T_odom_camera();
  screen_finder_.remember(now.seen, T_odom_camera);
  screens_.forget_still(stamp);
  if (screens_.empty()) return;
  screens_.renew(moving_unmasked(now), T_odom_camera, stamp);
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

/// The final labels: what agrees with the map is static, what stands where it saw empty space is
/// new.
Tracker::Observed Tracker::compared_with_map(Observed now, const PoseResult& pose,
                                             const LocalView& view) const {
  std::vector<std::uint8_t> known;
  for (const PointEvidence& point : now.evidence.points)
    known.push_back(point.in_free_space ? 1 : 0);
  const auto violations = find_free_space_violations(camera_, now.seen, pose.landmarks, known, view,
                                                     pose.T_camera_world, config_.free_space);
  now.evidence = with_free_space(std::move(now.evidence), violations);
  now.labels = promote(classifier_.classify(now.evidence), pose.landmarks);
  now.seen.static_weight = now.labels.weight;
  return now;
}

std::vector<TrackedObject> Tracker::follow_objects(const Observed& now, bool was_lost,
                                                   const SE3& T_world_odom) {
  const DynamicMode mode = classifier_.config().mode;
  if (mode == DynamicMode::kOff || was_lost) {
    objects_.lose_points();
    return {};
  }
  const auto motion = classifier_.motion_of(now.evidence);
  const auto links = classifier_.reliable_links(now.evidence);
  const SE3& T_odom_camera = localization_.T_odom_camera();
  ObjectInput input{now.seen.frame->id,
                    now.seen.frame->stamp,
                    T_odom_camera.inverse(),
                    T_world_odom,
                    {},
                    make_thumbnail(*now.seen.frame),
                    {}};
  if (uses_masks(mode)) input.masks = {now.masks.begin(), now.masks.end()};
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const Feature& feature = now.seen.features->points[i];
    const Vec3 p_cam = camera_.unproject(feature.ideal_px.cast<double>(), feature.depth_m);
    input.points.push_back({feature.uv_px, feature.depth_m, T_odom_camera * p_cam, links[i],
                            motion[i] == PointMotion::kMoves, motion[i] == PointMotion::kStands});
  }
  return objects_.step(std::move(input));
}

/// Of the newest frame with a pose.
Tracker::MapRequest Tracker::ask_mapper(const PoseResult& pose, Localization::Arrival arrival,
                                        bool mapper_busy) {
  const LocalViewPtr view = last_->view;
  keyframes_.remember_seen(pose.seen);
  const bool may_propose =
      config_.proposes_keyframes && judge_.state() == TrackState::kTracking && !view->empty();
  const bool begins_submap = arrival == Localization::Arrival::kCarriedOff && submaps_.enabled();
  if (may_propose && !begins_submap && keyframes_.wants(*last_, *view, pose, mapper_busy))
    return {keyframes_.make(*last_, view->map_version), std::nullopt};
  MapRequest request{std::nullopt, better_reference(*last_, *view)};
  if (begins_submap) {
    last_ = without_landmarks(std::move(last_->seen), last_->pose, view);
    request.candidate = keyframes_.make_submap(*last_, 0, view->map_version);
  }
  return request;
}

Tracker::CameraFindings Tracker::estimate_camera() {
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
  last_ = without_landmarks(corrected(std::move(seen), Vec6::Zero()), pose, view);
  return keyframes_.make_submap(*last_, *reach_m, view->map_version);
}

}  // namespace ygslam
