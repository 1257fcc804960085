#include "tracking/tracker.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "features/attach.hpp"

namespace ygslam {
namespace {

constexpr int kProvingFrames = 10;       // after a loss ...
constexpr double kProvingFactor = 1.67;  // ... a pose needs so many times the usual inliers
constexpr double kLostBeforeSubmap_s = 1.0;
constexpr double kCoveredShare = 0.5;
constexpr double kVouchedReach_m = 2;  // farther away the next room may look the same
constexpr float kAnyWeight = std::numeric_limits<float>::min();

/// What agrees with a point of the static map is static.
PointLabels promote(PointLabels labels, std::span<const LandmarkId> landmarks) {
  for (std::size_t i = 0; i < labels.label.size(); ++i)
    if (landmarks[i] != kNoLandmark && labels.label[i] == MotionLabel::kUnknown &&
        labels.weight[i] > 0)
      labels.label[i] = MotionLabel::kStatic;
  count(labels);
  return labels;
}

}  // namespace

const char* to_string(TrackState state) {
  switch (state) {
    case TrackState::kWaiting:
      return "waiting";
    case TrackState::kTracking:
      return "tracking";
    case TrackState::kWeak:
      return "weak";
    case TrackState::kLost:
      return "lost";
  }
  return "?";
}

Tracker::Tracker(const TrackerConfig& config, const OrbConfig& orb, const DynamicConfig& dynamic,
                 const Camera& camera, std::uint64_t seed)
    : config_(config),
      camera_(camera),
      shutter_(camera),
      orb_(orb),
      classifier_(dynamic, camera, seed),
      objects_(config.objects, camera),
      pose_estimator_(config.pose, camera, orb_.scales()),
      relocalizer_(config.relocalizer, camera, pose_estimator_),
      motion_model_(config.motion_model),
      calibration_(camera, config.calibrated),
      localization_(config.max_jump_mps),
      keyframes_(config.keyframe, config.min_start_points),
      rng_(seed) {}

TrackResult Tracker::step(const FramePtr& frame, const LocalViewPtr& view,
                          std::span<const SegmentationPtr> masks, bool mapper_busy) {
  TrackResult result;
  result.masks.assign(masks.begin(), masks.end());
  const ScopedTimer timer;
  TrackedFrame current = extract_features(frame);
  current.view = view;
  const auto predicted = predicted_flow(*frame);
  if (predicted) move_to_middle(current, predicted->read_out.body_velocity);
  result.features = current.features;
  result.orb_ms = timer.wall_ms();

  FrameEvidence evidence = classifier_.observe(*frame, current.features, masks, predicted);
  result.mask_age_frames = evidence.mask_age_frames;
  result.labels = classifier_.classify(evidence);
  current.static_weight = result.labels.weight;
  result.motion_ms = timer.wall_ms() - result.orb_ms;

  if (state_ != TrackState::kWaiting) {
    track(std::move(current), std::move(evidence), *view, mapper_busy, result);
    result.pose_ms = timer.wall_ms() - result.orb_ms - result.motion_ms;
  } else if (view->empty()) {
    start(std::move(current), std::move(evidence), result);
  } else {
    start_in_map(std::move(current), std::move(evidence), *view, result);
  }
  return result;
}

void Tracker::track(TrackedFrame current, FrameEvidence evidence, const LocalView& view,
                    bool mapper_busy, TrackResult& result) {
  const Timestamp stamp = current.frame->stamp, last_stamp = last_->frame->stamp;
  const SE3 T_last_world = last_pose(view);
  const bool was_lost = state_ == TrackState::kLost;
  const PoseHypothesis found = find_pose(current, view, T_last_world);
  result.features = evidence.frame.features = current.features;
  result.state = state_ = assess(found, T_last_world, seconds_between(stamp, last_stamp));
  keyframes_.count_frame();
  if (std::exchange(first_keyframe_is_due_, false)) result.candidate = keyframes_.make(*last_, 0);
  if (state_ == TrackState::kLost)
    return stay_lost(std::move(current), std::move(evidence), view, T_last_world, result);
  const SE3& T_camera_world = found.pose->T_camera_world;
  fit_since_.reset();
  move_to(T_camera_world, T_last_world, was_lost, stamp);
  const auto arrival = localization_.arrive(
      {current.frame->id, stamp, last_stamp, T_camera_world, T_last_world, was_lost}, view);
  const bool carried_off = arrival == Localization::Arrival::kCarriedOff;
  deliver_place(T_camera_world, view, result);
  const auto violations = free_space_violations(current, evidence, *found.pose, view);
  evidence = with_free_space(std::move(evidence), violations);
  result.labels = promote(classifier_.classify(evidence), found.pose->landmarks);
  current.static_weight = result.labels.weight;
  result.objects = follow_objects(evidence, current, result.masks, was_lost, result.T_world_odom);
  classifier_.remember(std::move(evidence), result.labels.label, objects_.resting_points());
  deliver(*found.pose, view, mapper_busy, current, result);
  if (carried_off && starts_submaps()) result.candidate = make_submap(current, 0, view);
  if (view.placed && !carried_off) localization_.trust(current.pose, stamp);
  estimate_camera(current, T_camera_world, view, result);
  last_ = std::move(current);
}

void Tracker::estimate_camera(const TrackedFrame& current, const SE3& T_camera_world,
                              const LocalView& view, TrackResult& result) {
  if (state_ != TrackState::kTracking) return;
  if (config_.calibrated.empty()) {
    if (!shutter_.known()) result.guessed_read_out = current.read_out;
    result.shutter = shutter_.step(current, T_camera_world, view);
  } else {
    calibration_.add(current, T_camera_world, view);
    result.camera_estimate = calibration_.estimate();
  }
}

TrackedFrame Tracker::extract_features(const FramePtr& frame) {
  TrackedFrame current;
  current.frame = frame;
  Features features = orb_.extract(frame->grey);
  attach_geometry(features, camera_, frame->depth_m, orb_.scales());
  current.features = std::make_shared<const Features>(std::move(features));
  current.grid = FeatureGrid(*current.features, camera_.ideal_bounds());
  current.landmarks.assign(current.features->size(), kNoLandmark);
  return current;
}

void Tracker::move_to_middle(TrackedFrame& current, const Vec6& body_velocity) const {
  ReadOut& read_out = current.read_out;
  read_out = {shutter_.times(), body_velocity};
  if (read_out.times.is_global()) return;
  read_out.times.depth_delay_s += current.frame->depth_delay_s;
  auto features = std::make_shared<Features>(*current.features);
  move_to_middle_instant(*features, camera_, current.frame->depth_m, read_out);
  current.grid = FeatureGrid(*features, camera_.ideal_bounds());
  current.features = std::move(features);
}

std::optional<FlowPrediction> Tracker::predicted_flow(const RgbdFrame& frame) const {
  // A weak pose's motion is no good start for the flow; but where rows are read one after the
  // other, ends that are left where they are seen would look as if they moved.
  const bool weak_will_do = !shutter_.times().is_global() && state_ == TrackState::kWeak;
  if (state_ != TrackState::kTracking && !weak_will_do) return std::nullopt;
  const SE3 T_now_last = motion_model_.predict(frame.stamp);
  return FlowPrediction{T_now_last,
                        {shutter_.times(), motion_model_.body_velocity(frame.stamp, T_now_last)},
                        motion_model_.velocity_gain_per_s(frame.stamp)};
}

Tracker::PoseHypothesis Tracker::find_pose(TrackedFrame& current, const LocalView& view,
                                           const SE3& T_last_world) {
  const Timestamp stamp = current.frame->stamp;
  const SE3 T_guess_world = motion_model_.predict(stamp) * T_last_world;
  const auto match_previous = [&] {
    return pose_estimator_.match_previous_frame(current, *last_, T_last_world, view, T_guess_world,
                                                rng_);
  };
  PoseHypothesis found;
  if (auto first = match_previous()) {
    const SE3 T_now_last = first->solution.T_camera_world * T_last_world.inverse();
    const Vec6 body_velocity = motion_model_.body_velocity(stamp, T_now_last);
    move_to_middle(current, body_velocity);
    if (first_keyframe_is_due_) {  // the first frame's velocity shows only now
      move_to_middle(*last_, body_velocity);
      first = match_previous();
    }
    if (first) found.pose = pose_estimator_.match_map(current, view, *first);
  }
  if (state_ == TrackState::kLost && found.pose &&
      found.pose->landmark_inliers < config_.relocalizer.min_inliers) {
    found.pose.reset();  // after a loss only a pose that the map confirms counts
  }
  if (found.pose) found.jump_m = centre_distance_m(found.pose->T_camera_world, T_guess_world);
  if ((!found.pose || found.pose->inliers < config_.least_inliers()) && !view.empty()) {
    move_to_middle(current, Vec6::Zero());  // as seen: what the velocity came from was wrong
    found = {relocalizer_.step(current, view, rng_), 0};
  }
  return found;
}

/// Takes the pose over into odometry and motion model.
void Tracker::move_to(const SE3& T_camera_world, const SE3& T_last_world, bool was_lost,
                      Timestamp stamp) {
  const SE3 T_now_last = T_camera_world * T_last_world.inverse();
  if (was_lost) {
    motion_model_.reset(stamp);
    keyframes_.restart();  // a place just found again must prove itself before it is mapped
  } else {
    motion_model_.update(stamp, T_now_last);
    localization_.move(T_now_last);
  }
}

void Tracker::deliver_place(const SE3& T_camera_world, const LocalView& view, TrackResult& result) {
  result.T_world_camera = T_camera_world.inverse();
  result.T_odom_camera = localization_.T_odom_camera();
  const Odometry::Place place = localization_.place(T_camera_world, view);
  result.T_world_odom = place.T_world_odom;
  result.correction_m = place.correction_m;
  result.unplaced = !view.placed;
  result.provisional = place.provisional || result.unplaced;
}

void Tracker::stay_lost(TrackedFrame current, FrameEvidence evidence, const LocalView& view,
                        const SE3& T_last_world, TrackResult& result) {
  motion_model_.reset(current.frame->stamp);
  result.T_odom_camera = localization_.T_odom_camera();
  objects_.lose_points();
  classifier_.remember(std::move(evidence), result.labels.label);
  offer_submap(std::move(current), view, T_last_world, result);
}

void Tracker::offer_submap(TrackedFrame current, const LocalView& view,
                           const std::optional<SE3>& T_last_world, TrackResult& result) {
  if (!starts_submaps() || view.empty()) return;
  const Timestamp now = current.frame->stamp;
  // Points that came back only because there were too few others are no ground for a new world.
  const int usable = current.usable_points(kMappedWeight);
  const bool is_fit = usable >= config_.min_start_points && !result.labels.too_few_static &&
                      !(T_last_world && is_covered(current, usable, view, *T_last_world));
  if (!is_fit || !fit_since_) fit_since_ = now;
  if (!is_fit || seconds_between(now, *fit_since_) < kLostBeforeSubmap_s) return;
  fit_since_.reset();
  move_to_middle(current, Vec6::Zero());
  current.pose = last_ ? last_->pose : KeyframeRelativePose{view.reference().data->id, SE3()};
  const double reach = view.placed ? std::min(localization_.reach_m(now), kVouchedReach_m) : 0;
  result.candidate = make_submap(current, reach, view);
  localization_.doubt(current.frame->id);
  last_ = std::move(current);
}

/// Seen from where the camera was last, most of it would stand in what was free: something came
/// before the lens, and it is not the world.
bool Tracker::is_covered(const TrackedFrame& current, int usable, const LocalView& view,
                         const SE3& T_last_world) const {
  const std::vector<LandmarkId> no_landmarks(current.features->size(), kNoLandmark);
  const std::vector<std::uint8_t> none_known(current.features->size(), 0);
  FreeSpaceConfig config = config_.free_space;
  config.min_landmarks = 0;  // the pose is a guess
  const auto in_free_space = find_free_space_violations(camera_, current, no_landmarks, none_known,
                                                        view, T_last_world, config);
  return std::count(in_free_space.begin(), in_free_space.end(), 1) > kCoveredShare * usable;
}

KeyframeCandidate Tracker::make_submap(TrackedFrame& frame, double reach_m, const LocalView& view) {
  frame.landmarks.assign(frame.features->size(), kNoLandmark);
  KeyframeCandidate candidate = keyframes_.make(frame, view.map_version);
  candidate.submap_reach_m = reach_m;
  return candidate;
}

std::vector<std::uint8_t> Tracker::free_space_violations(const TrackedFrame& current,
                                                         const FrameEvidence& evidence,
                                                         const PoseResult& pose,
                                                         const LocalView& view) const {
  std::vector<std::uint8_t> known;
  for (const PointEvidence& point : evidence.points) known.push_back(point.in_free_space ? 1 : 0);
  return find_free_space_violations(camera_, current, pose.landmarks, known, view,
                                    pose.T_camera_world, config_.free_space);
}

std::vector<TrackedObject> Tracker::follow_objects(const FrameEvidence& evidence,
                                                   const TrackedFrame& current,
                                                   std::span<const SegmentationPtr> masks,
                                                   bool was_lost, const SE3& T_world_odom) {
  const DynamicMode mode = classifier_.config().mode;
  if (mode == DynamicMode::kOff || was_lost) {
    objects_.lose_points();
    return {};
  }
  const auto motion = classifier_.motion_of(evidence);
  const auto links = classifier_.reliable_links(evidence);
  ObjectInput input{current.frame->id,
                    current.frame->stamp,
                    localization_.T_odom_camera().inverse(),
                    T_world_odom,
                    {},
                    make_thumbnail(*current.frame),
                    {}};
  if (uses_masks(mode)) input.masks.assign(masks.begin(), masks.end());
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const Feature& feature = current.features->points[i];
    const Vec3 p_cam = camera_.unproject(feature.ideal_px.cast<double>(), feature.depth_m);
    input.points.push_back({feature.uv_px, feature.depth_m, localization_.T_odom_camera() * p_cam,
                            links[i], motion[i] == PointMotion::kMoves,
                            motion[i] == PointMotion::kStands});
  }
  return objects_.step(std::move(input));
}

void Tracker::deliver(const PoseResult& pose, const LocalView& view, bool mapper_busy,
                      TrackedFrame& current, TrackResult& result) {
  keyframes_.remember_seen(pose.seen);
  current.landmarks = pose.landmarks;
  current.T_camera_world = pose.T_camera_world;
  current.pose = relative_to_keyframe(pose.T_camera_world, view);
  result.landmarks = pose.landmarks;
  result.covariance = pose.covariance;
  result.matches = pose.matches;
  result.inliers = pose.inliers;
  const bool may_propose = config_.proposes_keyframes && state_ == TrackState::kTracking;
  if (may_propose && !view.empty() && keyframes_.wants(current, view, pose, mapper_busy)) {
    result.candidate = keyframes_.make(current, view.map_version);
  } else {
    result.wanted_view = better_reference(current, view);
  }
  result.pose = current.pose;
  result.read_out = current.read_out;
}

void Tracker::start(TrackedFrame current, FrameEvidence evidence, TrackResult& result) {
  classifier_.remember(std::move(evidence), result.labels.label);
  const int usable = current.usable_points(kAnyWeight);
  if (usable < config_.min_start_points) return;
  state_ = result.state = TrackState::kTracking;
  motion_model_.reset(current.frame->stamp);
  result.landmarks = current.landmarks;
  result.inliers = usable;
  first_keyframe_is_due_ = shutter_.may_roll();
  if (!first_keyframe_is_due_) result.candidate = keyframes_.make(current, 0);
  localization_.trust(current.pose, current.frame->stamp);
  last_ = std::move(current);
}

void Tracker::start_in_map(TrackedFrame current, FrameEvidence evidence, const LocalView& view,
                           TrackResult& result) {
  classifier_.remember(std::move(evidence), result.labels.label);
  const auto found = relocalizer_.step(current, view, rng_);
  result.state = TrackState::kLost;
  motion_model_.reset(current.frame->stamp);
  if (!found || found->inliers < kProvingFactor * config_.min_inliers) {
    offer_submap(std::move(current), view, std::nullopt, result);
    if (result.candidate) state_ = TrackState::kLost;
    return;
  }
  state_ = result.state = TrackState::kTracking;
  frames_since_loss_ = 0;
  localization_.doubt(current.frame->id);
  deliver_place(found->T_camera_world, view, result);
  deliver(*found, view, true, current, result);
  last_ = std::move(current);
}

TrackState Tracker::assess(const PoseHypothesis& found, const SE3& T_last_world, double gap_s) {
  const auto& pose = found.pose;
  if (!pose || pose->inliers < config_.least_inliers() || !pose->T_camera_world.is_finite() ||
      !(pose->position_std_m <= config_.lost_position_std_m)) {
    return TrackState::kLost;
  }
  // A place found again must prove itself for a while: few points fit many places.
  frames_since_loss_ = state_ == TrackState::kLost ? 0 : frames_since_loss_ + 1;
  if (frames_since_loss_ < kProvingFrames && pose->inliers < kProvingFactor * config_.min_inliers)
    return TrackState::kLost;
  const bool many = pose->inliers >= config_.min_inliers;
  const bool certain = pose->position_std_m <= config_.weak_position_std_m;
  if (many && certain) {
    weak_frames_ = 0;
    return TrackState::kTracking;
  }
  // After a loss only the last known place vouches for a weak pose.
  const bool was_lost = state_ == TrackState::kLost;
  const double jump_m =
      was_lost ? centre_distance_m(pose->T_camera_world, T_last_world) : found.jump_m;
  const double reach_m = was_lost ? 0 : gap_s * config_.max_jump_mps;
  if (jump_m > std::max(config_.max_jump_m, reach_m)) return TrackState::kLost;
  if (many) return TrackState::kWeak;  // uncertain by its weights, but no chance matches
  return ++weak_frames_ > config_.weak_frames_until_lost ? TrackState::kLost : TrackState::kWeak;
}

/// T_last_world in the map as the view has it.
SE3 Tracker::last_pose(const LocalView& view) {
  if (view.empty()) return last_->pose.T_camera_reference;
  for (const ViewKeyframe& keyframe : view.keyframes)
    if (keyframe.data->frame == last_->frame->id) last_->pose = {keyframe.data->id, SE3()};
  const auto T_last_world = pose_in(view, last_->pose);
  CHECK(T_last_world, "views reach from the keyframe they were asked for to the last one");
  if (last_->view->bends == view.bends) return *T_last_world;
  // Where the world was bent the frame's landmarks, seen first by several keyframes, did not all
  // move as its reference keyframe did; the difference would look like a motion of the camera.
  return pose_estimator_.follow_landmarks(*last_, view, *T_last_world).value_or(*T_last_world);
}

}  // namespace ygslam
