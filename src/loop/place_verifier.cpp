#include "loop/place_verifier.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>

#include "features/matcher.hpp"
#include "geometry/pnp.hpp"
#include "geometry/small_systems.hpp"
#include "map/search_points.hpp"

namespace ygslam {
namespace {

constexpr int kCells = 4;                   // per side of the image
constexpr double kWideSearch_px = 12;       // the first pose stands on few matches ...
constexpr double kSearch_px = 5;            // ... the second on many
constexpr int kMaxDistance = 64;            // Hamming; other light, another side
constexpr std::size_t kSpaceKeyframes = 4;  // of the place whose free space is asked
constexpr int kLeastJudged = 40;            // points: fewer say nothing of the space
constexpr double kSpaceMargin_m = 0.10;
constexpr double kSpaceMarginRatio = 0.1;

struct SpaceCount {
  int judged = 0;
  int contradict = 0;
};

/// Points of one view against the space that another saw through.
void count_contradictions(const Camera& camera, const Features& features,
                          std::span<const float> static_weight, const SE3& T_seen_from,
                          const FreeSpaceImage& space, SpaceCount& count) {
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Feature& f = features.points[i];
    if (f.depth_m <= 0 || static_weight[i] <= 0 || f.on_depth_edge) continue;
    const Vec3 p = T_seen_from * camera.unproject(f.ideal_px.cast<double>(), f.depth_m);
    if (p.z() < 0.3) continue;
    const double nearest_m = space.around_m(camera.distort(camera.project(p)));
    if (nearest_m <= 0) continue;
    ++count.judged;
    const double margin_m = std::max(kSpaceMargin_m, kSpaceMarginRatio * nearest_m);
    count.contradict += static_cast<int>(p.z() < nearest_m - margin_m);
  }
}

/// Which of the image's cells a recorded pixel lies in.
std::size_t cell_of(const Camera& camera, const Eigen::Vector2f& uv_px) {
  const auto cell = [](double at_px, int size_px) {
    return std::clamp(static_cast<int>(at_px * kCells / size_px), 0, kCells - 1);
  };
  return static_cast<std::size_t>(cell(uv_px.y(), camera.height()) * kCells +
                                  cell(uv_px.x(), camera.width()));
}

/// The second largest standard deviation of points in space.
double second_extent_m(std::span<const Vec3> points) {
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : points) mean += p / static_cast<double>(points.size());
  Mat3 scatter = Mat3::Zero();
  for (const Vec3& p : points)
    scatter += (p - mean) * (p - mean).transpose() / static_cast<double>(points.size());
  return std::sqrt(std::max(0.0, symmetric_eigen(scatter).values[1]));
}

}  // namespace

const char* to_string(PlaceVerdict verdict) {
  switch (verdict) {
    case PlaceVerdict::kFewMatches:
      return "few matches";
    case PlaceVerdict::kNoPose:
      return "no pose";
    case PlaceVerdict::kFewInliers:
      return "few inliers";
    case PlaceVerdict::kNarrow:
      return "narrow";
    case PlaceVerdict::kContradicts:
      return "contradicts";
    case PlaceVerdict::kAgrees:
      return "agrees";
  }
  return "?";
}

PlaceMatch PlaceVerifier::verify(const Map& map, const PlaceView& view, KeyframeId place,
                                 std::uint64_t seed) const {
  PlaceMatch match;
  match.place = place;
  const auto window = map.with_covisible(place, 1, config_.window_keyframes);
  const auto landmarks = map.landmarks_of(window);
  if (const auto rough = rough_pose(map, view, landmarks, seed, match))
    judge_near(map, view, window, landmarks, *rough, match);
  return match;
}

PlaceMatch PlaceVerifier::verify_near(const Map& map, const PlaceView& view, KeyframeId place,
                                      const SE3& T_guess_world) const {
  PlaceMatch match;
  match.place = place;
  const auto window = map.with_covisible(place, 1, config_.window_keyframes);
  judge_near(map, view, window, map.landmarks_of(window), T_guess_world, match);
  return match;
}

std::optional<SE3> PlaceVerifier::rough_pose(const Map& map, const PlaceView& view,
                                             std::span<const LandmarkId> landmarks,
                                             std::uint64_t seed, PlaceMatch& match) const {
  Features known;
  for (const LandmarkId id : landmarks) known.descriptors.push_back(map.landmark(id).descriptor);
  known.points.resize(known.descriptors.size());
  std::vector<PnpPoint> points;
  for (const Match& m : match_brute_force(known, view.features, {.max_distance = kMaxDistance})) {
    if (view.static_weight[m.b] <= 0) continue;
    const Feature& f = view.features.points[m.b];
    points.push_back({map.landmark(landmarks[m.a]).p_world, f.ideal_px.cast<double>(), f.depth_m});
  }
  match.matches = static_cast<int>(points.size());
  match.verdict = PlaceVerdict::kFewMatches;
  if (match.matches < config_.min_matches) return std::nullopt;
  match.verdict = PlaceVerdict::kNoPose;
  Rng rng(seed);
  const auto pose = solve_pnp_ransac(camera_, points, PnpConfig{}, rng);
  if (!pose) return std::nullopt;
  return pose->T_camera_world;
}

void PlaceVerifier::judge_near(const Map& map, const PlaceView& view,
                               std::span<const KeyframeId> window,
                               std::span<const LandmarkId> landmarks, const SE3& T_guess_world,
                               PlaceMatch& match) const {
  std::vector<std::uint8_t> usable(view.features.size());
  for (std::size_t i = 0; i < usable.size(); ++i) usable[i] = view.static_weight[i] > 0 ? 1 : 0;
  match.verdict = PlaceVerdict::kFewInliers;
  match.T_camera_world = T_guess_world;
  std::vector<Vec3> points;
  std::bitset<kCells * kCells> cells;
  for (const double search_px : {kWideSearch_px, kSearch_px}) {
    const auto found =
        match_by_projection(camera_, match.T_camera_world,
                            visible_points(map, match.T_camera_world, landmarks, search_px),
                            view.features, view.grid, usable, {.max_distance = kMaxDistance});
    std::vector<PoseObservation> observations;
    for (const PointMatch& m : found) {
      const Feature& f = view.features.points[m.feature];
      observations.push_back({map.landmark(landmarks[m.source]).p_world,
                              observation_of(f, map.scales().of(f.octave), config_.noise,
                                             view.static_weight[m.feature])});
    }
    const auto solution = solve_pose(camera_, match.T_camera_world, observations, config_.pose);
    match.guided = static_cast<int>(found.size());
    match.inliers = solution ? solution->inliers : 0;
    if (match.inliers < config_.min_inliers) return;
    match.T_camera_world = solution->T_camera_world;
    points.clear();
    cells.reset();
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (solution->inlier[i] == 0) continue;
      points.push_back(observations[i].p_world);
      cells.set(cell_of(camera_, view.features.points[found[i].feature].uv_px));
    }
  }
  if (match.inliers < config_.min_inlier_share * match.guided) return;
  match.verdict = PlaceVerdict::kNarrow;
  if (static_cast<int>(cells.count()) < config_.min_cells) return;
  if (second_extent_m(points) < config_.min_extent_m) return;
  match.contradiction = contradiction(map, view, window, match.T_camera_world);
  match.verdict = match.contradiction > config_.max_contradiction ? PlaceVerdict::kContradicts
                                                                  : PlaceVerdict::kAgrees;
}

double PlaceVerifier::contradiction(const Map& map, const PlaceView& view,
                                    std::span<const KeyframeId> window,
                                    const SE3& T_camera_world) const {
  SpaceCount count;
  for (const KeyframeId id : window.first(std::min(window.size(), kSpaceKeyframes))) {
    const Keyframe& keyframe = map.keyframe(id);
    const SE3 T_keyframe_camera = keyframe.T_camera_world * T_camera_world.inverse();
    count_contradictions(camera_, view.features, view.static_weight, T_keyframe_camera,
                         keyframe.data->free_space, count);
    if (view.free_space)
      count_contradictions(camera_, *keyframe.data->features, keyframe.static_weight,
                           T_keyframe_camera.inverse(), *view.free_space, count);
  }
  return count.judged < kLeastJudged ? 0 : static_cast<double>(count.contradict) / count.judged;
}

}  // namespace ygslam
