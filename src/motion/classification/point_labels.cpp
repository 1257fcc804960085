#include "motion/classification/point_labels.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

// Dynamic scores; a sum above 1 makes a point dynamic.
constexpr float kInMask = 2.0F;
constexpr float kAtRest = 1.05F;  // the same, on an object that does not move: first to return
constexpr float kInFreeSpace = 2.0F;
constexpr float kOnScreen = 2.0F;
constexpr float kViolation = 1.01F;     // just beyond the limit
constexpr float kViolationMore = 1.0F;  // added as the distance grows
constexpr float kDoubtful = 0.6F;       // a violation found by a check that is not believed
constexpr float kWasDynamic = 0.5F;     // dynamic in the previous frame, consistent now

bool is_believed(const EpipolarCheck& check, const ClassifierConfig& config) {
  return check.state == CheckState::kDone && check.fit_quality >= config.min_fit_quality;
}

/// Score of a point that is `excess` times its limit away from where it should be.
float excess_score(double excess, bool believed) {
  if (excess <= 1.0) return 0;
  const auto more = static_cast<float>((excess - 1.0) / (excess + 1.0));
  return believed ? kViolation + kViolationMore * more : kDoubtful + 0.3F * more;
}

void count(PointLabels& labels) {
  labels.static_points = labels.dynamic_points = labels.unknown_points = 0;
  for (const MotionLabel label : labels.label) {
    labels.static_points += label == MotionLabel::kStatic ? 1 : 0;
    labels.dynamic_points += label == MotionLabel::kDynamic ? 1 : 0;
    labels.unknown_points += label == MotionLabel::kUnknown ? 1 : 0;
  }
}

class Classifier {
 public:
  Classifier(DynamicMode mode, const EpipolarCheck& check, const MotionLimits& limits,
             const ClassifierConfig& config)
      : geometry_(uses_geometry(mode)),
        semantic_(uses_masks(mode)),
        believed_(geometry_ && is_believed(check, config)),
        limits_(limits),
        config_(config) {}

  void classify(const PointEvidence& e, PointLabels& out) {
    const bool seen_outside = semantic_ && e.semantic.label == SemanticLabel::kStatic;
    float dynamic_score = 0;
    if (semantic_ && e.semantic.label == SemanticLabel::kMovable)
      dynamic_score = e.rests ? kAtRest : kInMask;
    bool obeys = false;
    bool is_moving = false;
    if (geometry_) {
      const float moves = violation(e);
      const bool judged = (believed_ && e.epipolar_px >= 0) || e.ego_motion.own_depth_px >= 0;
      // Where there is no new evidence the old label holds; where there is, it fades. What a mask
      // made dynamic before, a newer mask has cleared.
      const bool was_dynamic = e.previous == MotionLabel::kDynamic && !seen_outside;
      const float was = !was_dynamic ? 0.0F : judged ? kWasDynamic : kViolation;
      dynamic_score += std::max(moves, was);
      is_moving = std::max(moves, was) >= kViolation;
      if (e.in_free_space) dynamic_score = std::max(dynamic_score, kInFreeSpace);
      if (e.on_screen) dynamic_score = std::max(dynamic_score, kOnScreen);
      obeys = judged && moves <= 0 && e.epipolar_px <= limits_.tau_px;
    }
    const bool cleared = seen_outside || obeys || e.previous == MotionLabel::kStatic;
    // A corner on an occlusion boundary moves with it: of no use to tracking, but no moving
    // surface.
    const bool boundary =
        dynamic_score > 1 && e.on_boundary && e.semantic.label != SemanticLabel::kMovable;
    out.dynamic_score.push_back(dynamic_score);
    may_come_back_.push_back(!is_moving && !e.in_free_space && !e.on_screen);
    out.label.push_back(dynamic_score > 1 && !boundary ? MotionLabel::kDynamic
                        : dynamic_score > 0            ? MotionLabel::kUnknown
                        : cleared                      ? MotionLabel::kStatic
                                                       : MotionLabel::kUnknown);
    out.weight.push_back(boundary ? 0 : weight(out.label.back(), dynamic_score));
  }

  [[nodiscard]] bool check_believed() const { return believed_; }
  /// Per point: whether a mask alone speaks against it.
  [[nodiscard]] const std::vector<bool>& may_come_back() const { return may_come_back_; }

 private:
  /// Score by motion alone.
  [[nodiscard]] float violation(const PointEvidence& e) const {
    const bool is_supported = e.moving_share < 0 || e.moving_share >= config_.min_moving_share;
    // Where depth agrees with a standing point, a crossed epipolar line means a bad F.
    const bool obeys_depth =
        e.ego_motion.own_depth_px >= 0 && e.ego_motion.own_depth_px <= limits_.ego_motion_px;
    const float epipolar =
        excess_score(e.epipolar_px / limits_.tau_px, believed_ && is_supported && !obeys_depth);
    // At a depth edge the point's own depth may be its neighbour's: a motion that another depth
    // around it explains is only a doubt.
    const float rigid =
        excess_score(e.ego_motion.any_depth_px / limits_.ego_motion_px, is_supported);
    const float edge = excess_score(e.ego_motion.own_depth_px / limits_.ego_motion_px, false);
    return std::max({epipolar, rigid, edge});
  }
  [[nodiscard]] float weight(MotionLabel label, float dynamic_score) const {
    if (label == MotionLabel::kDynamic) return 0;
    if (label == MotionLabel::kStatic) return 1;
    return static_cast<float>(config_.unknown_weight) *
           (1.0F - 0.5F * std::min(dynamic_score, 1.0F));
  }

  bool geometry_;
  bool semantic_;
  bool believed_;
  MotionLimits limits_;
  const ClassifierConfig& config_;
  std::vector<bool> may_come_back_;
};

/// Too few points left: those that a mask alone excludes come back with reduced weight, the lowest
/// scores first. What moves does not: better lost than dragged along.
void fall_back_to_least_dynamic(const std::vector<bool>& may_come_back,
                                const ClassifierConfig& config, PointLabels& out) {
  std::vector<std::uint32_t> excluded;
  int usable = 0;
  for (std::size_t i = 0; i < out.label.size(); ++i) {
    if (out.weight[i] > 0) {
      ++usable;
      continue;
    }
    if (may_come_back[i]) excluded.push_back(static_cast<std::uint32_t>(i));
  }
  if (usable >= config.min_static) return;
  out.too_few_static = true;
  std::stable_sort(excluded.begin(), excluded.end(), [&](std::uint32_t a, std::uint32_t b) {
    return out.dynamic_score[a] < out.dynamic_score[b];
  });
  const auto missing = static_cast<std::size_t>(config.min_static - usable);
  excluded.resize(std::min(excluded.size(), missing));
  for (const std::uint32_t i : excluded) {
    // The score of an excluded point lies between 1 and about 4.5.
    const double share = std::clamp((out.dynamic_score[i] - 1.0) / 3.0, 0.0, 1.0);
    out.label[i] = MotionLabel::kUnknown;
    out.weight[i] = static_cast<float>(
        std::lerp(config.fallback_weight_high, config.fallback_weight_low, share));
  }
  out.fallback_points = static_cast<int>(excluded.size());
}

}  // namespace

const char* mode_name(DynamicMode mode) {
  switch (mode) {
    case DynamicMode::kOff:
      return "off";
    case DynamicMode::kGeometry:
      return "geometry";
    case DynamicMode::kSemantic:
      return "semantic";
    case DynamicMode::kFull:
      return "full";
  }
  return "?";
}

PointLabels promote(PointLabels labels, std::span<const LandmarkId> landmarks) {
  for (std::size_t i = 0; i < labels.label.size(); ++i)
    if (landmarks[i] != kNoLandmark && labels.label[i] == MotionLabel::kUnknown &&
        labels.weight[i] > 0)
      labels.label[i] = MotionLabel::kStatic;
  count(labels);
  return labels;
}

PointLabels all_static(std::size_t n) {
  PointLabels labels;
  labels.label.assign(n, MotionLabel::kStatic);
  labels.weight.assign(n, 1.0F);
  labels.dynamic_score.assign(n, 0.0F);
  labels.static_points = static_cast<int>(n);
  return labels;
}

PointLabels classify(DynamicMode mode, std::span<const PointEvidence> evidence,
                     const EpipolarCheck& check, const MotionLimits& limits,
                     const ClassifierConfig& config) {
  if (mode == DynamicMode::kOff) return all_static(evidence.size());
  PointLabels labels;
  labels.label.reserve(evidence.size());
  labels.weight.reserve(evidence.size());
  labels.dynamic_score.reserve(evidence.size());
  Classifier classifier(mode, check, limits, config);
  for (const PointEvidence& e : evidence) classifier.classify(e, labels);
  labels.check_believed = classifier.check_believed();
  fall_back_to_least_dynamic(classifier.may_come_back(), config, labels);
  count(labels);
  return labels;
}

}  // namespace ygslam
