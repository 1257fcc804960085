#include "tracking/map_rival.hpp"

#include "tracking/view_poses.hpp"

namespace ygslam {
namespace {

constexpr double kAgree = 0.75;  // of the matches: with fewer inliers the pose is in doubt
constexpr int kSure = 60;        // inliers, with fewer it is, too
constexpr int kFewest = 20;      // landmarks, of a rival
constexpr double kMore = 1.3;    // times as many as the pose that was followed has
constexpr double kApart_m = 0.01;

/// Whatever was taken to move may be the world's, but not what a mask shows or a screen.
FrameFeatures all_points(FrameFeatures seen, std::span<const PointEvidence> evidence) {
  for (std::size_t i = 0; i < evidence.size(); ++i) {
    const PointEvidence& e = evidence[i];
    const bool is_out = e.semantic.label == SemanticLabel::kMovable || e.on_screen;
    seen.static_weight[i] = is_out ? 0.0F : 1.0F;
  }
  return seen;
}

}  // namespace

bool MapRival::is_wanted(const std::optional<PoseResult>& followed, const LocalView& view) {
  if (view.empty()) return false;
  return !followed || followed->inliers < kSure || followed->inliers < kAgree * followed->matches;
}

std::optional<PoseResult> MapRival::step(const Input& in) const {
  auto rival =
      estimator_.match_predicted(all_points(in.seen, in.evidence), in.view, in.T_guess_world);
  if (!rival || rival->landmark_inliers < kFewest) return std::nullopt;
  if (in.followed) {
    const bool is_same =
        centre_distance_m(rival->T_camera_world, in.followed->T_camera_world) < kApart_m;
    if (is_same || rival->landmark_inliers < kMore * in.followed->landmark_inliers)
      return std::nullopt;
  }
  rival->contested = rival->inliers < kSure;
  return rival;
}

}  // namespace ygslam
