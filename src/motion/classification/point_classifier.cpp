#include "motion/classification/point_classifier.hpp"

#include <algorithm>
#include <utility>

#include "core/trace.hpp"
#include "motion/checks/neighbour_vote.hpp"

namespace ygslam {
namespace {

bool same_size(const ImagePyramid& a, const ImagePyramid& b) {
  return a.width() == b.width() && a.height() == b.height();
}

}  // namespace

PointClassifier::PointClassifier(DynamicConfig config, const Camera& camera, std::uint64_t seed)
    : config_(std::move(config)), camera_(camera), rng_(seed), labels_(config_.masks) {}

void PointClassifier::forget() {
  previous_.reset();
  labels_.clear();
}

FrameFlow PointClassifier::follow(const RgbdFrame& frame,
                                  const std::optional<FlowPrediction>& predicted) {
  FrameFlow flow;
  if (config_.mode == DynamicMode::kOff) return flow;
  {
    const trace::Span span("pyramid");
    flow.pyramid = ImagePyramid(frame.grey, config_.flow.levels, config_.flow.window_px);
  }
  if (previous_ && !same_size(previous_->pyramid, flow.pyramid)) forget();
  if (!previous_) return flow;
  const trace::Span span("flow");
  if (config_.epipolar.corners == FlowCorners::kOrb) flow.previous = previous_->features;
  flow.followed = follow_features(camera_, *previous_, flow.pyramid, predicted, config_.flow);
  return flow;
}

FrameEvidence PointClassifier::observe(const RgbdFrame& frame, const FeaturesPtr& features,
                                       FrameFlow flow, std::span<const std::int32_t> links,
                                       std::span<const SegmentationPtr> new_masks,
                                       const std::optional<FlowPrediction>& predicted) {
  CHECK(features != nullptr && (links.empty() || links.size() == features->size()));
  FrameEvidence evidence;
  evidence.frame.features = features;
  evidence.links.assign(features->size(), -1);
  evidence.points.resize(features->size());
  if (config_.mode == DynamicMode::kOff) return evidence;
  const ImagePyramid& image = flow.pyramid;
  evidence.frame.pyramid = image;
  evidence.frame.range = depth_ranges(*features, frame.depth_m);
  evidence.is_first = !previous_;

  if (previous_) {
    evidence.followed = std::move(flow.followed);
    if (links.empty()) {
      evidence.links = link_to_previous(features->points, evidence.followed.ends,
                                        config_.epipolar.link_radius_px);
    } else {
      evidence.links.assign(links.begin(), links.end());
    }
  }
  carry_masks(frame, evidence.followed.ends, new_masks, evidence);
  if (!previous_ || !uses_geometry()) return evidence;

  if (config_.epipolar.corners == FlowCorners::kHarris)
    evidence.followed =
        follow_harris(camera_, *previous_, image, config_.epipolar.link_radius_px, config_.flow);
  if (config_.ego_motion.enabled) find_ego_motion(predicted.value_or(FlowPrediction{}), evidence);
  const trace::Span span("epipolar check");
  evidence.epipolar =
      check_epipolar(evidence.followed.pairs, evidence.followed.label, config_.epipolar, rng_);
  give_to_features(evidence);
  return evidence;
}

/// The camera's motion by flow and depth, and how far each followed point is from obeying it.
void PointClassifier::find_ego_motion(const FlowPrediction& guess, FrameEvidence& evidence) const {
  const trace::Span span("ego-motion");
  Followed& followed = evidence.followed;
  const auto fit = [&](const SE3& start) {
    return fit_ego_motion(camera_, followed.points, static_before(followed), start,
                          config_.ego_motion);
  };
  evidence.ego_motion = fit(guess.T_current_previous);
  // Harris corners stay as seen at both ends, where the rows' times nearly cancel.
  const bool brought_to_middle = config_.epipolar.corners == FlowCorners::kOrb;
  if (evidence.ego_motion && brought_to_middle && !guess.read_out.times.is_global()) {
    const SE3 T_current_previous = evidence.ego_motion->T_current_previous;
    followed = with_motion(camera_, std::move(followed), guess.corrected(T_current_previous));
    evidence.ego_motion = fit(T_current_previous);
  }
  if (evidence.ego_motion)
    evidence.residual = residuals_of(followed, evidence.ego_motion->T_current_previous);
}

std::vector<EgoMotionResidual> PointClassifier::residuals_of(const Followed& followed,
                                                             const SE3& T_current_previous) const {
  std::vector<EgoMotionResidual> residuals;
  residuals.reserve(followed.size());
  for (const FollowedPoint& point : followed.points)
    residuals.push_back(ego_motion_residual(camera_, T_current_previous, point));
  return residuals;
}

FrameEvidence PointClassifier::held_against(FrameEvidence evidence,
                                            const SE3& T_current_previous) const {
  if (!uses_geometry() || evidence.is_first) return evidence;
  evidence.ego_motion = EgoMotion{T_current_previous, config_.ego_motion.limit_px, 0, 0};
  evidence.residual = residuals_of(evidence.followed, T_current_previous);
  // F came from points that the motion contradicts.
  for (EpipolarLabel& point : evidence.epipolar.points) point = {};
  evidence.epipolar.state = CheckState::kNoFit;
  give_to_features(evidence);
  return evidence;
}

FrameEvidence with_screens(FrameEvidence evidence, std::span<const std::uint8_t> on_screen) {
  CHECK(on_screen.size() == evidence.points.size());
  for (std::size_t i = 0; i < on_screen.size(); ++i)
    evidence.points[i].on_screen = on_screen[i] != 0;
  return evidence;
}

FrameEvidence with_free_space(FrameEvidence evidence, std::span<const std::uint8_t> in_free_space) {
  CHECK(in_free_space.size() == evidence.points.size());
  for (std::size_t i = 0; i < in_free_space.size(); ++i)
    evidence.points[i].in_free_space = in_free_space[i] != 0;
  return evidence;
}

PointLabels PointClassifier::classify(const FrameEvidence& evidence) const {
  return ygslam::classify(config_.mode, evidence.points, evidence.epipolar, limits(evidence),
                          config_.classifier);
}

void PointClassifier::remember(FrameEvidence evidence, std::span<const MotionLabel> label,
                               std::vector<std::uint8_t> rests) {
  if (config_.mode == DynamicMode::kOff) return;
  CHECK(label.size() == evidence.points.size());
  FlowFrame& frame = evidence.frame;
  frame.label.assign(label.begin(), label.end());
  // Before anything is known everything counts as static: the first check is the classic one.
  if (evidence.is_first && evidence.mask_age_frames < 0)
    frame.label.assign(label.size(), MotionLabel::kStatic);
  frame.in_free_space.clear();
  for (const PointEvidence& point : evidence.points)
    frame.in_free_space.push_back(point.in_free_space ? 1 : 0);
  frame.rests = std::move(rests);
  frame.rests.resize(label.size(), 0);
  previous_ = std::move(frame);
}

/// Late masks label the features of their own frames; those labels come along the flow.
void PointClassifier::carry_masks(const RgbdFrame& frame, const std::vector<FlowEnd>& ends,
                                  std::span<const SegmentationPtr> new_masks,
                                  FrameEvidence& evidence) {
  labels_.push(frame.id, evidence.frame.features, evidence.links, ends, frame.depth_m);
  if (uses_masks(config_.mode))
    for (const SegmentationPtr& masks : new_masks)
      if (masks) labels_.apply(*masks);
  evidence.mask_age_frames = labels_.mask_age_frames();
  evidence.points = prior(evidence);
}

/// What is known of each feature before its motion is looked at.
std::vector<PointEvidence> PointClassifier::prior(const FrameEvidence& evidence) const {
  const std::vector<SemanticPoint> semantic = labels_.current();
  std::vector<PointEvidence> points(semantic.size());
  for (std::size_t i = 0; i < semantic.size(); ++i) {
    points[i].semantic = semantic[i];
    const std::int32_t k = evidence.links[i];
    if (k < 0) continue;
    points[i].previous = previous_->label[k];
    points[i].in_free_space = uses_geometry() && previous_->in_free_space[k] != 0;
    points[i].rests = previous_->rests[k] != 0;
  }
  return points;
}

std::vector<std::int32_t> PointClassifier::reliable_links(const FrameEvidence& evidence) const {
  std::vector<std::int32_t> links = evidence.links;
  for (std::int32_t& k : links)
    if (k >= 0 && !labels_.field().reliable(static_cast<std::size_t>(k))) k = -1;
  return links;
}

/// Per followed point 1 where it may say how the camera moved.
std::vector<std::uint8_t> PointClassifier::static_before(const Followed& followed) const {
  std::vector<std::uint8_t> result(followed.size());
  for (std::size_t i = 0; i < result.size(); ++i)
    result[i] = !config_.epipolar.prior || followed.label[i] == MotionLabel::kStatic ? 1 : 0;
  return result;
}

/// Per followed point 1 where any check sees it move.
std::vector<std::uint8_t> PointClassifier::moving(const FrameEvidence& evidence) const {
  const Followed& followed = evidence.followed;
  std::vector<std::uint8_t> moves(followed.size(), 0);
  for (std::size_t k = 0; k < followed.size(); ++k) {
    moves[k] = evidence.epipolar.points[k].label == MotionLabel::kDynamic ? 1 : 0;
    if (!evidence.ego_motion) continue;
    const EgoMotionResidual& residual = evidence.residual[k];
    const double limit_px = evidence.ego_motion->limit_px;
    if (residual.any_depth_px > limit_px) moves[k] = 1;
    // Where depth agrees with a standing point, a crossed epipolar line means a bad F.
    if (residual.own_depth_px >= 0 && residual.own_depth_px <= limit_px) moves[k] = 0;
  }
  return moves;
}

/// Each feature takes over what was found for the followed point at it or, failing that, around it.
void PointClassifier::give_to_features(FrameEvidence& evidence) const {
  const Features& features = *evidence.frame.features;
  const Followed& followed = evidence.followed;
  const std::vector<std::uint8_t> moves = moving(evidence);
  std::vector<float> share(followed.size(), -1.0F);
  std::vector<std::int32_t> source = evidence.links;  // per feature: the followed point
  if (config_.epipolar.corners == FlowCorners::kHarris) {
    source = link_to_previous(features.points, followed.ends, config_.epipolar.link_radius_px);
  } else if (config_.classifier.vote_of_neighbours) {
    source = vote_of_neighbours(features, evidence.links, moves, labels_.field(),
                                config_.classifier.neighbour_majority);
    share = moving_share(moves, labels_.field());
  }
  for (std::size_t i = 0; i < features.size(); ++i) {
    PointEvidence& point = evidence.points[i];
    const std::int32_t k = source[i];
    if (k >= 0) {
      point.epipolar_px = evidence.epipolar.points[k].distance_px;
      point.moving_share = share[k];
      if (!evidence.residual.empty()) point.ego_motion = evidence.residual[k];
    }
    // Only of points that could be called dynamic does it matter.
    const bool suspect = point.previous == MotionLabel::kDynamic || (k >= 0 && moves[k]);
    point.on_boundary =
        suspect && config_.boundary.enabled &&
        is_on_occlusion_boundary(features.points[i], labels_.depth_m(), config_.boundary);
  }
}

MotionLimits PointClassifier::limits(const FrameEvidence& evidence) const {
  return {config_.epipolar.tau_px,
          evidence.ego_motion ? evidence.ego_motion->limit_px : config_.ego_motion.limit_px};
}

std::vector<PointMotion> PointClassifier::motion_of(const FrameEvidence& evidence) const {
  const MotionLimits limit = limits(evidence);
  std::vector<PointMotion> motion(evidence.points.size(), PointMotion::kUnknown);
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const PointEvidence& point = evidence.points[i];
    const double own_px = point.ego_motion.own_depth_px;
    if (!point.on_boundary && point.ego_motion.any_depth_px > limit.ego_motion_px) {
      motion[i] = PointMotion::kMoves;
    } else if (own_px >= 0 && own_px <= limit.ego_motion_px) {
      motion[i] = PointMotion::kStands;
    }
  }
  return motion;
}

}  // namespace ygslam
