#include "tracking/relocalizer.hpp"

#include <algorithm>
#include <utility>

#include "core/trace.hpp"
#include "features/matcher.hpp"
#include "geometry/pnp.hpp"

namespace ygslam {

Relocalizer::Relocalizer(const RelocalizerConfig& config, const Camera& camera,
                         const PoseEstimator& pose_estimator)
    : config_(config), camera_(camera), pose_estimator_(pose_estimator) {}

std::optional<PoseResult> Relocalizer::step(const FrameFeatures& frame, const LocalView& view,
                                            Rng& rng) {
  const trace::Span span("relocalisation");
  if (frame.features->size() < static_cast<std::size_t>(config_.min_matches)) return std::nullopt;
  if (std::exchange(reference_, view.reference().data->id) != view.reference().data->id)
    next_ = 0;  // another place: its nearest keyframes first
  const int tries =
      std::min<int>(config_.keyframes_per_frame, static_cast<int>(view.keyframes.size()));
  for (int i = 0; i < tries; ++i) {
    const ViewKeyframe& keyframe = view.keyframes[next_++ % view.keyframes.size()];
    if (auto result = try_keyframe(frame, view, keyframe, rng)) {
      next_ = 0;
      return result;
    }
  }
  return std::nullopt;
}

std::optional<PoseResult> Relocalizer::try_keyframe(const FrameFeatures& frame,
                                                    const LocalView& view,
                                                    const ViewKeyframe& keyframe, Rng& rng) const {
  const Features& known = *keyframe.data->features;
  std::vector<PnpPoint> points;
  for (const Match& m : match_brute_force(known, *frame.features, MatchConfig{})) {
    if (frame.static_weight[m.b] <= 0) continue;
    // Without a landmark it may be a moving thing; it is certainly not in the map.
    if (keyframe.landmarks[m.a] < 0) continue;
    const Feature& here = frame.features->points[m.b];
    points.push_back({view.landmarks[keyframe.landmarks[m.a]].p_world, here.ideal_px.cast<double>(),
                      here.depth_m});
  }
  if (points.size() < static_cast<std::size_t>(config_.min_matches)) return std::nullopt;
  const auto rough = solve_pnp_ransac(camera_, points, PnpConfig{}, rng);
  if (!rough) return std::nullopt;
  auto result = pose_estimator_.refine_on_map(frame, view, rough->T_camera_world);
  if (!result || result->landmark_inliers < config_.min_inliers) return std::nullopt;
  // Once more from the better pose: the first search window was centred on a rough one.
  if (auto better = pose_estimator_.refine_on_map(frame, view, result->T_camera_world))
    result = better;
  return result;
}

}  // namespace ygslam
