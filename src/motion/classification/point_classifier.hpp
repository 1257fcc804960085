// Which points of a frame stand still: flow from the previous frame, late masks carried along it,
// the checks of motion, and one label and weight per feature out of all of them. The tracker calls
//   observe -> classify -> (pose, free space) -> classify -> remember
// with values going from one to the next; only remember() and the masks change what is kept.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "geometry/camera.hpp"
#include "image/rgbd_frame.hpp"
#include "motion/checks/ego_motion.hpp"
#include "motion/checks/epipolar_check.hpp"
#include "motion/checks/occlusion_boundary.hpp"
#include "motion/classification/point_labels.hpp"
#include "motion/flow/flow_follower.hpp"
#include "motion/flow/lk_flow.hpp"
#include "motion/masks/label_history.hpp"

namespace ygslam {

struct DynamicConfig {
  DynamicMode mode = DynamicMode::kFull;
  EpipolarConfig epipolar{};
  EgoMotionConfig ego_motion{};
  FlowConfig flow{};
  LabelHistoryConfig masks{};
  OcclusionBoundaryConfig boundary{};
  ClassifierConfig classifier{};
};

/// Where the previous frame's points went: all that is known of a frame before its features.
struct FrameFlow {
  ImagePyramid pyramid;
  FeaturesPtr previous;  ///< whose points were followed; null: none were
  Followed followed;
};

/// What is known of a frame's features before they are labelled. A value of its own.
struct FrameEvidence {
  FlowFrame frame;                  ///< what the next frame's flow starts from
  Followed followed;                ///< points of the previous frame: features or Harris corners
  std::vector<std::int32_t> links;  ///< per feature: the previous feature it continues; -1 = none
  EpipolarCheck epipolar;           ///< Algorithm 1, per followed point
  std::optional<EgoMotion> ego_motion;      ///< the camera motion the points were held against
  std::vector<EgoMotionResidual> residual;  ///< from it, per followed point; empty without
  std::vector<PointEvidence> points;        ///< all of it per feature
  int mask_age_frames = -1;                 ///< of the newest mask used, -1 = none
  bool is_first = true;                     ///< no frame before it
};

/// @param in_free_space per feature: where the map saw empty space; of no weight in modes without
/// geometry.
[[nodiscard]] FrameEvidence with_free_space(FrameEvidence evidence,
                                            std::span<const std::uint8_t> in_free_space);

/// @param on_screen per feature: on a screen that plays; of no weight in modes without geometry.
[[nodiscard]] FrameEvidence with_screens(FrameEvidence evidence,
                                         std::span<const std::uint8_t> on_screen);

/// How a feature moves against the camera's motion.
enum class PointMotion : std::uint8_t { kUnknown, kMoves, kStands };

class PointClassifier {
 public:
  /// @param camera must outlive it.
  PointClassifier(DynamicConfig config, const Camera& camera, std::uint64_t seed);

  /// Flow of the previous frame's points; nothing in mode off.
  /// @param predicted nullopt: points are searched from where they were.
  [[nodiscard]] FrameFlow follow(const RgbdFrame& frame,
                                 const std::optional<FlowPrediction>& predicted);

  /// The masks' labels carried along the flow, the fundamental matrix from points that were static
  /// before and each point's distance from its epipolar line (Algorithm 1), and the camera's motion
  /// as flow and depth give it. Everything but masks is left out in mode semantic, masks in mode
  /// geometry, all in mode off.
  /// @param flow what follow() gave of this frame, with the same prediction.
  /// @param links per feature the previous one that it was followed from; empty: those whose flow
  /// ends nearest.
  /// @param new_masks results that arrived since the last call, of this or earlier frames.
  [[nodiscard]] FrameEvidence observe(const RgbdFrame& frame, const FeaturesPtr& features,
                                      FrameFlow flow, std::span<const std::int32_t> links,
                                      std::span<const SegmentationPtr> new_masks,
                                      const std::optional<FlowPrediction>& predicted);

  /// The same held against another motion of the camera than the one found by flow and depth.
  [[nodiscard]] FrameEvidence held_against(FrameEvidence evidence,
                                           const SE3& T_current_previous) const;

  [[nodiscard]] PointLabels classify(const FrameEvidence& evidence) const;

  /// How each feature moves, for the objects.
  [[nodiscard]] std::vector<PointMotion> motion_of(const FrameEvidence& evidence) const;
  /// Per feature: links to the previous frame along which the flow stayed on its surface, or -1.
  [[nodiscard]] std::vector<std::int32_t> reliable_links(const FrameEvidence& evidence) const;

  /// The frame becomes the previous one.
  /// @param label the final ones: candidates for the next fundamental matrix are those static here.
  /// @param rests per feature: on an object that stands still; empty = none.
  void remember(FrameEvidence evidence, std::span<const MotionLabel> label,
                std::vector<std::uint8_t> rests = {});

  [[nodiscard]] const DynamicConfig& config() const { return config_; }

 private:
  [[nodiscard]] bool uses_geometry() const { return ygslam::uses_geometry(config_.mode); }
  void carry_masks(const RgbdFrame& frame, const std::vector<FlowEnd>& ends,
                   std::span<const SegmentationPtr> new_masks, FrameEvidence& evidence);
  [[nodiscard]] std::vector<PointEvidence> prior(const FrameEvidence& evidence) const;
  void find_ego_motion(const FlowPrediction& guess, FrameEvidence& evidence) const;
  [[nodiscard]] std::vector<EgoMotionResidual> residuals_of(const Followed& followed,
                                                            const SE3& T_current_previous) const;
  [[nodiscard]] std::vector<std::uint8_t> static_before(const Followed& followed) const;
  [[nodiscard]] std::vector<std::uint8_t> moving(const FrameEvidence& evidence) const;
  void give_to_features(FrameEvidence& evidence) const;
  [[nodiscard]] MotionLimits limits(const FrameEvidence& evidence) const;
  void forget();

  DynamicConfig config_;
  const Camera& camera_;
  Rng rng_;
  LabelHistory labels_;
  std::optional<FlowFrame> previous_;
};

}  // namespace ygslam
