#include "tracking/map_rival.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "tracking/view_poses.hpp"

namespace ygslam {
namespace {

constexpr double kAgree = 0.75;  // of the matches: with fewer inliers the pose is in doubt
constexpr int kSure = 60;        // inliers, with fewer it is, too
constexpr int kFewest = 20;      // landmarks, of a rival
constexpr double kMore = 1.3;    // times as many as the pose that was followed has
constexpr double kApart_m = 0.01;
// What moves is in the map, too, where it kept up with the camera for a while; but not for long.
constexpr double kBefore_s = 1.0;
constexpr double kCoherent = 0.5;  // of its matches agree with it

/// Whatever was taken to move may be the world's, but not what a mask shows or a screen.
FrameFeatures all_points(FrameFeatures seen, std::span<const PointEvidence> evidence) {
  for (std::size_t i = 0; i < evidence.size(); ++i) {
    const PointEvidence& e = evidence[i];
    const bool is_out = e.semantic.label == SemanticLabel::kMovable || e.on_screen;
    seen.static_weight[i] = is_out ? 0.0F : 1.0F;
  }
  return seen;
}

/// By the view's landmarks, 1 = some keyframe had seen it kBefore_s ago; while the map is younger
/// than twice that, in its first half.
std::vector<std::uint8_t> is_older(const LocalView& view, Timestamp now) {
  double age_s = 0;
  for (const ViewKeyframe& keyframe : view.keyframes)
    age_s = std::max(age_s, seconds_between(now, keyframe.data->stamp));
  const double before_s = std::min(kBefore_s, age_s / 2);
  std::vector<std::uint8_t> older(view.landmarks.size(), 0);
  for (const ViewKeyframe& keyframe : view.keyframes) {
    if (seconds_between(now, keyframe.data->stamp) < before_s) continue;
    for (const std::int32_t i : keyframe.landmarks)
      if (i >= 0) older[static_cast<std::size_t>(i)] = 1;
  }
  return older;
}

/// The landmarks of a view that are marked; no keyframes.
LocalView only(const LocalView& view, std::span<const std::uint8_t> marked) {
  LocalView some;
  for (std::size_t i = 0; i < view.landmarks.size(); ++i) {
    if (marked[i] == 0) continue;
    some.landmark_index.emplace(view.landmarks[i].id,
                                static_cast<std::uint32_t>(some.landmarks.size()));
    some.landmarks.push_back(view.landmarks[i]);
  }
  return some;
}

}  // namespace

bool MapRival::is_wanted(const std::optional<PoseResult>& followed, const LocalView& view) {
  if (view.empty()) return false;
  return !followed || followed->inliers < kSure || followed->inliers < kAgree * followed->matches;
}

MapRival::Output MapRival::step(const Input& in) const {
  if (auto rival = by_all(in)) return {std::move(rival)};
  return older_speak_ && in.followed ? by_older_landmarks(in) : Output{};
}

std::optional<PoseResult> MapRival::by_all(const Input& in) const {
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

/// By the landmarks that the map had before and the pose that was followed leaves unexplained.
MapRival::Output MapRival::by_older_landmarks(const Input& in) const {
  const PoseResult& followed = *in.followed;
  FrameFeatures seen = all_points(in.seen, in.evidence);
  std::vector<std::uint8_t> older = is_older(in.view, in.seen.frame->stamp);
  int explained = 0;
  for (std::size_t i = 0; i < followed.landmarks.size(); ++i) {
    const std::int32_t landmark = in.view.find(followed.landmarks[i]);
    if (landmark < 0) continue;
    seen.static_weight[i] = 0;
    explained += std::exchange(older[static_cast<std::size_t>(landmark)], std::uint8_t{0});
  }
  auto rival = estimator_.match_predicted(seen, only(in.view, older), in.T_guess_world);
  if (!rival || rival->landmark_inliers < kFewest || rival->inliers < kCoherent * rival->matches ||
      centre_distance_m(rival->T_camera_world, followed.T_camera_world) < kApart_m)
    return {};
  if (rival->landmark_inliers < kMore * explained)
    return {std::nullopt, rival->landmark_inliers > explained};
  rival->contested = rival->inliers < kSure;
  return {std::move(rival)};
}

}  // namespace ygslam
