#include "motion/dynamic_point_filter.hpp"

#include <algorithm>
#include <utility>

#include "motion/neighbour_verdict.hpp"

namespace ygslam {
namespace {

constexpr int kSameCornerBits = 64;  // of 256 that may differ

FilterResult trust_everything(std::size_t n) {
  FilterResult result;
  result.labels = all_static(n);
  result.links.assign(n, -1);
  result.semantic.resize(n);
  result.intrudes.assign(n, 0);
  result.epipolar_px.assign(n, -1.0F);
  result.rigid_residual.resize(n);
  return result;
}

ObjectConfig with_classes(ObjectConfig objects, std::vector<int> movable_classes) {
  objects.movable_classes = std::move(movable_classes);
  return objects;
}

bool same_size(const ImagePyramid& a, const ImagePyramid& b) {
  return a.width() == b.width() && a.height() == b.height();
}

}  // namespace

DynamicPointFilter::DynamicPointFilter(DynamicConfig config, const Camera& camera,
                                       std::uint64_t seed)
    : config_(std::move(config)),
      camera_(camera),
      rng_(seed),
      history_(config_.propagation),
      anchors_(config_.anchor),
      objects_(with_classes(config_.objects, config_.propagation.mask.movable_classes), camera_) {}

void DynamicPointFilter::reset() {
  previous_.reset();
  history_.clear();
  anchors_.clear();
  objects_.clear();
  shown_.clear();
  T_previous_odom_.reset();
  judged_ = {};
  links_ = {};
}

FilterResult DynamicPointFilter::step(const RgbdFrame& frame, const FeaturesPtr& features,
                                      std::span<const SegmentationPtr> new_masks,
                                      const std::optional<FlowPrediction>& predicted) {
  CHECK(features != nullptr);
  const std::size_t n = features->size();
  FilterResult result = trust_everything(n);
  judged_.labels = result.labels;
  if (config_.mode == DynamicMode::kOff) return result;
  FlowFrame current{ImagePyramid(frame.grey, config_.flow.levels, config_.flow.window_px),
                    features,
                    depth_ranges(*features, frame.depth_m),
                    {},
                    {},
                    frame.stamp};
  if (previous_ && !same_size(previous_->pyramid, current.pyramid)) reset();
  begin_step(n);
  Followed orb = follow(current, predicted, result);
  object_input_ = {frame.id, frame.stamp, {}, {}, make_thumbnail(frame), {}};
  if (config_.mode != DynamicMode::kGeometry)
    object_input_.masks.assign(new_masks.begin(), new_masks.end());
  history_.push(frame.id, features, result.links, orb.ends, frame.depth_m);
  find_same_points(*features);
  read_masks(new_masks, result);
  take_prior(result.semantic);
  for (std::size_t i = 0; i < n; ++i) result.intrudes[i] = judged_.evidence[i].intrudes ? 1 : 0;
  current.intrudes = result.intrudes;
  if (previous_ && uses_geometry()) {
    judged_.followed = config_.motion.corners == FlowCorners::kOrb
                           ? std::move(orb)
                           : follow_harris(camera_, *previous_, current.pyramid,
                                           config_.motion.link_radius_px, config_.flow);
    judge_motion(predicted, *features, result);
  }
  fuse_evidence();
  result.labels = judged_.labels;
  current.label = result.labels.label;
  // Before anything is known everything counts as static: the first check is the classic one.
  if (!previous_ && result.mask_age_frames < 0) current.label.assign(n, MotionLabel::kStatic);
  previous_ = std::move(current);
  return result;
}

void DynamicPointFilter::begin_step(std::size_t features) {
  if (previous_ && uses_anchors()) drop_anchors();
  if (!std::exchange(objects_seen_, false)) objects_.lose_points();
  judged_ = {};
  judged_.evidence.resize(features);
  judged_.source.assign(features, -1);
}

/// Flow of the previous frame's features, and which current feature continues which of them.
Followed DynamicPointFilter::follow(const FlowFrame& current,
                                    const std::optional<FlowPrediction>& predicted,
                                    FilterResult& result) {
  Followed orb;
  if (previous_) {
    orb = follow_features(camera_, *previous_, current.pyramid, predicted, config_.flow);
    result.links =
        link_to_previous(current.features->points, orb.ends, config_.motion.link_radius_px);
    result.followed = static_cast<int>(std::count_if(orb.ends.begin(), orb.ends.end(),
                                                     [](const FlowEnd& end) { return end.found; }));
  }
  links_ = result.links;
  return orb;
}

void DynamicPointFilter::find_same_points(const Features& features) {
  if (!uses_anchors()) return;
  same_point_ = links_;
  for (std::size_t i = 0; i < same_point_.size(); ++i)
    if (const std::int32_t k = same_point_[i]; k >= 0 && !is_same_point(k, features, i))
      same_point_[i] = -1;
}

void DynamicPointFilter::read_masks(std::span<const SegmentationPtr> new_masks,
                                    FilterResult& result) {
  if (config_.mode != DynamicMode::kGeometry)
    for (const SegmentationPtr& masks : new_masks)
      if (masks) history_.apply(*masks);
  result.semantic = history_.current();
  result.mask_age_frames = history_.mask_age_frames();
}

/// What is known of each feature before its motion is looked at.
void DynamicPointFilter::take_prior(std::span<const SemanticPoint> semantic) {
  for (std::size_t i = 0; i < semantic.size(); ++i) {
    PointEvidence& evidence = judged_.evidence[i];
    evidence.semantic = semantic[i];
    const std::int32_t k = links_[i];
    if (k < 0) continue;
    evidence.previous = previous_->label[k];
    evidence.intrudes = uses_geometry() && previous_->intrudes[k] != 0;
    evidence.rests = objects_.rests(static_cast<std::size_t>(k));
  }
}

/// Followed points that may say how the camera moved.
std::vector<std::uint8_t> DynamicPointFilter::voters() const {
  std::vector<std::uint8_t> voter(judged_.followed.size());
  for (std::size_t i = 0; i < voter.size(); ++i)
    voter[i] = !config_.motion.prior || judged_.followed.label[i] == MotionLabel::kStatic ? 1 : 0;
  return voter;
}

/// Epipolar check of all followed points and, with depth, the rigid motion behind them.
void DynamicPointFilter::judge_motion(const std::optional<FlowPrediction>& predicted,
                                      const Features& features, FilterResult& result) {
  const Followed& followed = judged_.followed;
  judged_.check = check_motion(followed.pairs, followed.label, config_.motion, rng_);
  result.check = judged_.check;
  if (config_.rigid.enabled) {
    const SE3 guess = predicted ? predicted->T_current_previous : SE3();
    judged_.rigid = fit_rigid_flow(camera_, followed.points, voters(), guess, config_.rigid);
    result.rigid = judged_.rigid;
    judge_anchors(judged_.rigid ? judged_.rigid->T_current_previous : guess);
  }
  take_verdicts(features, result.links);
  for (std::size_t i = 0; i < features.size(); ++i) {
    result.epipolar_px[i] = judged_.evidence[i].epipolar_px;
    result.rigid_residual[i] = judged_.evidence[i].rigid;
  }
}

/// A flow that slid onto another surface or corner would hand on the anchor of the wrong thing.
bool DynamicPointFilter::is_same_point(std::int32_t previous, const Features& features,
                                       std::size_t i) const {
  const Features& before = *previous_->features;
  const auto k = static_cast<std::size_t>(previous);
  return history_.field().reliable(k) &&
         std::abs(before.points[k].octave - features.points[i].octave) <= 1 &&
         distance(before.descriptors[k], features.descriptors[i]) <= kSameCornerBits;
}

/// The previous frame's features become anchors for the frames to come.
void DynamicPointFilter::drop_anchors() {
  const Features& features = *previous_->features;
  std::vector<RigidPoint> points(features.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].previous_px = features.points[i].ideal_px.cast<double>();
    points[i].depth_m = features.points[i].depth_m;
    points[i].range = previous_->range[i];
  }
  anchors_.push(points, same_point_);
  if (T_previous_odom_) anchors_.set_pose(*T_previous_odom_);
  T_previous_odom_.reset();
}

void DynamicPointFilter::judge_anchors(const SE3& T_current_previous) {
  judged_.anchors = {};
  if (uses_anchors())
    judged_.anchors =
        anchors_.judge(camera_, judged_.followed.points, voters(), T_current_previous);
}

/// Each feature takes over what was found for the followed point at it or, failing that, around it.
void DynamicPointFilter::take_verdicts(const Features& features,
                                       std::span<const std::int32_t> links) {
  const Followed& followed = judged_.followed;
  std::vector<RigidResidual> residuals(followed.size());
  std::vector<std::uint8_t> moves(followed.size(), 0);
  for (std::size_t k = 0; k < followed.size(); ++k) {
    moves[k] = judged_.check.verdict[k].label == MotionLabel::kDynamic ? 1 : 0;
    if (!judged_.rigid) continue;
    residuals[k] = rigid_residual(camera_, judged_.rigid->T_current_previous, followed.points[k]);
    const double limit_px = judged_.rigid->limit_px;
    if (residuals[k].any_depth_px > limit_px) moves[k] = 1;
    // Where depth agrees with a standing point, a crossed epipolar line means a bad F.
    if (residuals[k].own_depth_px >= 0 && residuals[k].own_depth_px <= limit_px) moves[k] = 0;
  }
  const auto& anchors = judged_.anchors;
  for (std::size_t k = 0; k < anchors.residual.size(); ++k)
    if (anchors.residual[k].px.any_depth_px > anchors.limit_px) moves[k] = 1;
  std::vector<float> share(followed.size(), -1.0F);
  if (config_.motion.corners == FlowCorners::kHarris) {
    judged_.source =
        link_to_previous(features.points, followed.ends, config_.motion.link_radius_px);
  } else if (config_.fusion.ask_neighbours) {
    judged_.source =
        ask_neighbours(features, links, moves, history_.field(), config_.fusion.neighbour_majority);
    share = moving_share(moves, history_.field());
  } else {
    judged_.source.assign(links.begin(), links.end());
  }
  for (std::size_t i = 0; i < features.size(); ++i) {
    const std::int32_t k = judged_.source[i];
    judged_.evidence[i].epipolar_px = k < 0 ? -1.0F : judged_.check.verdict[k].distance_px;
    judged_.evidence[i].moving_share = k < 0 ? -1.0F : share[k];
    judged_.evidence[i].rigid = k < 0 ? RigidResidual{} : residuals[k];
    judged_.evidence[i].anchor =
        k < 0 || anchors.residual.empty() ? AnchorResidual{} : anchors.residual[k];
    // Only of points that could be called dynamic does it matter.
    const bool suspect =
        judged_.evidence[i].previous == MotionLabel::kDynamic || (k >= 0 && moves[k]);
    judged_.evidence[i].on_rim = suspect && config_.rim.enabled &&
                                 is_on_rim(features.points[i], history_.depth_m(), config_.rim);
  }
}

void DynamicPointFilter::fuse_evidence() {
  const FusionLimits limits{
      config_.motion.tau_px, config_.motion.limit_tau_px,
      judged_.rigid ? judged_.rigid->limit_px : config_.rigid.limit_px,
      judged_.anchors.limit_px > 0 ? judged_.anchors.limit_px : config_.anchor.limit_px};
  judged_.labels = fuse(config_.mode, judged_.evidence, judged_.check, limits, config_.fusion);
}

StaticLabels DynamicPointFilter::rejudge(const std::optional<SE3>& T_current_previous,
                                         const SE3& T_current_odom,
                                         std::span<const std::uint8_t> intrudes) {
  // The odometry frame does not know how far the camera came while it was lost.
  if (!T_current_previous) anchors_.clear();
  if (T_current_odom.is_finite()) T_previous_odom_ = T_current_odom;
  if (uses_geometry() && judged_.followed.size() > 0) {
    for (std::size_t i = 0; i < intrudes.size(); ++i) {
      judged_.evidence[i].intrudes = intrudes[i] != 0;
      previous_->intrudes[i] = intrudes[i];
    }
    if (T_current_previous) look_again(*T_current_previous);
    fuse_evidence();
    previous_->label = judged_.labels.label;
  }
  if (previous_ && config_.mode != DynamicMode::kOff && T_current_previous &&
      T_current_odom.is_finite())
    follow_objects(T_current_odom);
  return judged_.labels;
}

/// Holds every followed point against the camera's motion as the map gives it.
void DynamicPointFilter::look_again(const SE3& T_current_previous) {
  if (!config_.fusion.second_look || !config_.rigid.enabled || !T_current_previous.is_finite())
    return;
  judged_.rigid = judge_rigid_flow(camera_, judged_.followed.points, voters(), T_current_previous,
                                   config_.rigid);
  judge_anchors(T_current_previous);
  take_verdicts(*previous_->features, links_);
}

/// Tells the object tracker what is known about each feature.
void DynamicPointFilter::follow_objects(const SE3& T_current_odom) {
  const SE3 T_odom_current = T_current_odom.inverse();
  const auto& features = previous_->features->points;
  object_input_.T_camera_odom = T_current_odom;
  object_input_.points.resize(features.size());
  for (std::size_t i = 0; i < features.size(); ++i) {
    ObjectPoint& point = object_input_.points[i];
    point.uv_px = features[i].uv_px;
    point.depth_m = features[i].depth_m;
    point.p_odom =
        T_odom_current * camera_.unproject(features[i].ideal_px.cast<double>(), point.depth_m);
    if (links_[i] >= 0 && history_.field().reliable(static_cast<std::size_t>(links_[i])))
      point.previous = links_[i];
    set_motion(judged_.evidence[i], point);
  }
  shown_ = objects_.step(std::move(object_input_));
  objects_seen_ = true;
}

void DynamicPointFilter::set_motion(const PointEvidence& evidence, ObjectPoint& point) const {
  const double limit_px = judged_.rigid ? judged_.rigid->limit_px : config_.rigid.limit_px;
  const bool drifts = evidence.anchor.px.any_depth_px > judged_.anchors.limit_px;
  const double own_px = evidence.rigid.own_depth_px;
  point.moves = !evidence.on_rim && (drifts || evidence.rigid.any_depth_px > limit_px);
  point.stands = !point.moves && own_px >= 0 && own_px <= limit_px;
}

void DynamicPointFilter::report(std::span<const MotionLabel> refined) {
  if (!previous_) return;
  CHECK(refined.size() == previous_->label.size());
  previous_->label.assign(refined.begin(), refined.end());
}

}  // namespace ygslam
