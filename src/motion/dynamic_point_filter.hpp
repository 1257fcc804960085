// What the tracker calls once per frame: flow from the previous frame, late masks carried along it,
// the motion consistency check, and one fused label and weight per feature.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "geometry/camera.hpp"
#include "image/rgbd_frame.hpp"
#include "motion/flow_follower.hpp"
#include "motion/lk_flow.hpp"
#include "motion/mask_propagation.hpp"
#include "motion/motion_consistency.hpp"
#include "motion/occlusion_rim.hpp"
#include "motion/point_anchors.hpp"
#include "motion/rigid_flow.hpp"
#include "motion/static_labels.hpp"
#include "objects/object_tracker.hpp"

namespace ygslam {

struct DynamicConfig {
  DynamicMode mode = DynamicMode::kFull;
  MotionConfig motion{};
  RigidFlowConfig rigid{};
  AnchorConfig anchor{};
  ObjectConfig objects{};
  FlowConfig flow{};
  PropagationConfig propagation{};
  RimConfig rim{};
  FusionConfig fusion{};
};

struct FilterResult {
  StaticLabels labels;
  std::vector<std::int32_t> links;      ///< previous feature per current one; all -1 in mode off
  std::vector<SemanticPoint> semantic;  ///< per current feature
  std::vector<std::uint8_t> intrudes;   ///< per current feature: continues an intruder
  std::vector<float> epipolar_px;       ///< D of eq. (16) per current feature, -1 = not judged
  std::vector<RigidResidual> rigid_residual;  ///< per current feature
  std::optional<RigidFit> rigid;              ///< camera motion from flow and depth alone
  MotionCheck check;                          ///< verdicts per followed point of the previous frame
  int followed = 0;                           ///< previous points whose flow was found
  int mask_age_frames = -1;                   ///< of the newest mask used, -1 = none
};

class DynamicPointFilter {
 public:
  DynamicPointFilter(DynamicConfig config, const Camera& camera, std::uint64_t seed);

  /// @param new_masks results that arrived since the last call, of this or earlier frames.
  /// @param predicted nullopt: points are searched from where they were.
  [[nodiscard]] FilterResult step(const RgbdFrame& frame, const FeaturesPtr& features,
                                  std::span<const SegmentationPtr> new_masks,
                                  const std::optional<FlowPrediction>& predicted);

  /// Second look at the last frame, with the camera's motion as the tracker found it from the map:
  /// every followed point is held against that motion, and the labels are fused again. They are the
  /// prior of the next step. Without depth check or second look (see the config), in modes off and
  /// semantic, and for a first frame the labels stay as they were.
  /// @param T_current_previous nullopt where the previous frame's pose is not known: no second
  /// look.
  /// @param T_current_odom the pose later frames' anchors and objects refer to: a frame that never
  /// jumps, whatever becomes of the map.
  /// @param intrudes per feature: in space the map knows to be empty; empty: as step() gave it.
  [[nodiscard]] StaticLabels rejudge(const std::optional<SE3>& T_current_previous,
                                     const SE3& T_current_odom,
                                     std::span<const std::uint8_t> intrudes = {});

  /// What is known of the things that move or could, as of the last rejudge().
  [[nodiscard]] const std::vector<TrackedObject>& objects() const { return shown_; }

  /// Labels of the last frame's features as the tracker sees them after its own pose check; they
  /// are the prior of the next step. Size as the features of that frame.
  void report(std::span<const MotionLabel> refined);

  /// Forgets all frames (after a cut); the configuration stays.
  void reset();

  [[nodiscard]] const DynamicConfig& config() const { return config_; }

 private:
  // What the last step knew, for the second look.
  struct Judged {
    Followed followed;  // what was judged: features or Harris corners
    std::vector<std::int32_t>
        source;  // per current feature: the followed point whose verdict it has
    MotionCheck check;
    std::optional<RigidFit> rigid;
    AnchorJudgement anchors;
    std::vector<PointEvidence> evidence;
    StaticLabels labels;
  };

  [[nodiscard]] bool uses_geometry() const { return ygslam::uses_geometry(config_.mode); }
  /// Anchors need the depth check and points that stay the same from frame to frame.
  [[nodiscard]] bool uses_anchors() const {
    return uses_geometry() && config_.anchor.enabled && config_.rigid.enabled &&
           config_.motion.corners == FlowCorners::kOrb;
  }
  void begin_step(std::size_t features);
  [[nodiscard]] Followed follow(const FlowFrame& current,
                                const std::optional<FlowPrediction>& predicted,
                                FilterResult& result);
  void find_same_points(const Features& features);
  void read_masks(std::span<const SegmentationPtr> new_masks, FilterResult& result);
  void take_prior(std::span<const SemanticPoint> semantic);
  void judge_motion(const std::optional<FlowPrediction>& predicted, const Features& features,
                    FilterResult& result);
  [[nodiscard]] std::vector<std::uint8_t> voters() const;
  [[nodiscard]] bool is_same_point(std::int32_t previous, const Features& features,
                                   std::size_t i) const;
  void drop_anchors();
  void judge_anchors(const SE3& T_current_previous);
  void take_verdicts(const Features& features, std::span<const std::int32_t> links);
  void look_again(const SE3& T_current_previous);
  void fuse_evidence();
  void follow_objects(const SE3& T_current_odom);
  void set_motion(const PointEvidence& evidence, ObjectPoint& point) const;

  DynamicConfig config_;
  Camera camera_;
  Rng rng_;
  LabelHistory history_;
  PointAnchors anchors_;
  ObjectTracker objects_;
  bool objects_seen_ = false;  // by the last step; false after frames without a pose
  ObjectInput object_input_;
  std::vector<TrackedObject> shown_;
  std::optional<FlowFrame> previous_;
  std::optional<SE3> T_previous_odom_;    // where the tracker found it
  std::vector<std::int32_t> links_;       // of the last step
  std::vector<std::int32_t> same_point_;  // links_ where it surely is the same corner
  Judged judged_;
};

}  // namespace ygslam
