#include "tracking/pose_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>

#include "core/trace.hpp"
#include "features/matcher.hpp"
#include "geometry/pnp.hpp"
#include "geometry/small_systems.hpp"
#include "map/search_points.hpp"

namespace ygslam {
namespace {

// Of the landmarks that the previous frame had: fewer agree by chance, where texture repeats itself
// as lines of text do and the window misses the true places.
constexpr double kConvincingShare = 0.25;
constexpr int kThinMap = 60;        // matches with the map
constexpr double kAside = 1.6;      // times the window, unless a landmark is seen head-on
constexpr double kNearest_m = 0.1;  // nearer no landmark is looked for
// Sum of weights; below, the bias of outlines does less harm than the noise of the rest alone.
constexpr double kFewOnSurfaces = 150;
constexpr double kTypicalDepth_m = 2.0;  // turns a shift of the camera into pixels

// How certain a pose is: the twist is a left perturbation, so that its translation moves the camera
// centre in the camera's axes.
void judge_certainty(const PoseSolution& pose, PoseResult& result) {
  const SymmetricSystem6 system(pose.information);
  const Mat6 covariance = system.inverse();
  const double variance_m2 = covariance.topLeftCorner<3, 3>().trace();
  const bool determined = system.is_decomposed() && system.is_positive() &&
                          std::isfinite(variance_m2) && variance_m2 >= 0;
  // Residuals larger than the noise model expects widen the estimate.
  const double widened = std::max(1.0, pose.rms);
  result.position_std_m =
      determined ? widened * std::sqrt(variance_m2) : std::numeric_limits<double>::infinity();
  if (determined) result.covariance = widened * widened * covariance;
}

std::vector<std::uint8_t> usable_features(const FrameFeatures& frame) {
  std::vector<std::uint8_t> usable(frame.features->size());
  for (std::size_t i = 0; i < usable.size(); ++i) usable[i] = frame.static_weight[i] > 0;
  return usable;
}

}  // namespace

PoseEstimator::PoseEstimator(const PoseEstimatorConfig& config, const Camera& camera,
                             const PyramidScales& scales)
    : config_(config), camera_(camera), scales_(scales) {}

std::optional<PoseEstimator::FirstPose> PoseEstimator::match_previous_frame(
    const FrameFeatures& frame, const TrackedFrame& last, const SE3& T_last_world,
    const LocalView& view, const SE3& T_guess_world, Rng& rng) const {
  const trace::Span span("previous frame");
  // The first search that explains enough will do, else the one that explains most.
  const auto had = std::ssize(last.landmarks) -
                   std::count(last.landmarks.begin(), last.landmarks.end(), kNoLandmark);
  std::optional<FirstPose> best;
  const auto consider = [&](std::vector<Pairing> pairings, const SE3& T_start_world) {
    const auto pose = solve(frame, pairings, T_start_world);
    if (!pose || pose->inliers < config_.min_matches) return;
    if (!best || pose->inliers > best->solution.inliers) best = {*pose, std::move(pairings)};
  };
  if (frame.is_followed()) {
    consider(along_flow(frame, last, T_last_world, view), T_guess_world);
    if (best) best->knows_map = last.view.get() == &view;
    return best;
  }
  for (const double radius_px : {config_.search_last_px, config_.search_wide_px}) {
    consider(match_last(frame, last, T_last_world, view, T_guess_world, radius_px), T_guess_world);
    if (best && best->solution.inliers >= kConvincingShare * static_cast<double>(had)) return best;
  }
  auto pairings = match_last_by_descriptor(frame, last, T_last_world, view);
  std::vector<PnpPoint> points;
  for (const Pairing& p : pairings) {
    const Feature& f = frame.features->points[p.feature];
    points.push_back({p.p_world, f.ideal_px.cast<double>(), f.depth_m});
  }
  if (const auto rough = solve_pnp_ransac(camera_, points, PnpConfig{}, rng))
    consider(std::move(pairings), rough->T_camera_world);
  return best;
}

std::optional<PoseResult> PoseEstimator::refine_on_map(const FrameFeatures& frame,
                                                       const LocalView& view,
                                                       const SE3& T_guess_world) const {
  FirstPose start;
  start.solution.T_camera_world = T_guess_world;
  return refine(frame, view, start, config_.search_map_px);
}

std::optional<PoseResult> PoseEstimator::match_predicted(const FrameFeatures& frame,
                                                         const LocalView& view,
                                                         const SE3& T_guess_world) const {
  FirstPose start;
  start.solution.T_camera_world = T_guess_world;
  const auto rough = refine(frame, view, start, config_.search_last_px);
  if (!rough || rough->landmark_inliers < config_.min_matches) return std::nullopt;
  return refine_on_map(frame, view, rough->T_camera_world);
}

std::optional<SE3> PoseEstimator::follow_landmarks(const TrackedFrame& frame, const LocalView& view,
                                                   const SE3& T_guess_world) const {
  CHECK(frame.view, "a frame that was posed");
  std::vector<Pairing> before, now;
  for (std::uint32_t i = 0; i < frame.landmarks.size(); ++i) {
    const ViewLandmark* landmark = frame.view->landmark(frame.landmarks[i]);
    if (landmark && view.landmark(landmark->id))
      before.push_back({landmark->p_world, i, landmark->id});
  }
  const auto of_before = solve(frame.seen, before, frame.T_camera_world);
  if (!of_before || of_before->inliers < config_.min_matches) return std::nullopt;
  for (std::size_t i = 0; i < before.size(); ++i)
    if (of_before->inlier[i])
      now.push_back(
          {view.landmark(before[i].landmark)->p_world, before[i].feature, before[i].landmark});
  const auto of_now = solve(frame.seen, now, T_guess_world);
  if (!of_now || of_now->inliers < config_.min_matches) return std::nullopt;
  // The frame's pose rested on more than these landmarks: it takes over how theirs changed.
  return frame.T_camera_world * of_before->T_camera_world.inverse() * of_now->T_camera_world;
}

/// A point of the previous frame: its landmark in view, or without one what its depth says. Not yet
/// paired with a feature.
PoseEstimator::Pairing PoseEstimator::known_point(const TrackedFrame& last, std::uint32_t source,
                                                  const SE3& T_world_last,
                                                  const LocalView& view) const {
  const LandmarkId id = last.landmarks[source];
  if (const ViewLandmark* landmark = view.landmark(id)) return {landmark->p_world, 0, id};
  const Feature& f = last.seen.features->points[source];
  return {T_world_last * camera_.unproject(f.ideal_px.cast<double>(), f.depth_m), 0, id};
}

bool PoseEstimator::is_usable(const TrackedFrame& last, std::uint32_t source,
                              const LocalView& view) const {
  const Feature& f = last.seen.features->points[source];
  const bool temporary = f.depth_m > 0 && f.depth_m < config_.max_temporary_depth_m;
  return last.seen.static_weight[source] > 0 &&
         (temporary || view.landmark(last.landmarks[source]));
}

std::vector<PoseEstimator::Pairing> PoseEstimator::along_flow(const FrameFeatures& frame,
                                                              const TrackedFrame& last,
                                                              const SE3& T_last_world,
                                                              const LocalView& view) const {
  const SE3 T_world_last = T_last_world.inverse();
  std::vector<Pairing> pairings;
  for (std::uint32_t i = 0; i < frame.followed_from.size(); ++i) {
    const auto source = static_cast<std::uint32_t>(frame.followed_from[i]);
    if (frame.static_weight[i] <= 0 || !is_usable(last, source, view)) continue;
    pairings.push_back(known_point(last, source, T_world_last, view));
    pairings.back().feature = i;
  }
  return pairings;
}

std::vector<PoseEstimator::Pairing> PoseEstimator::match_last(
    const FrameFeatures& frame, const TrackedFrame& last, const SE3& T_last_world,
    const LocalView& view, const SE3& T_guess_world, double radius_px) const {
  const SE3 T_world_last = T_last_world.inverse();
  const int top = scales_.levels() - 1;
  std::vector<Pairing> known;
  std::vector<SearchPoint> points;
  for (std::uint32_t i = 0; i < last.seen.features->size(); ++i) {
    const Feature& f = last.seen.features->points[i];
    if (!is_usable(last, i, view)) continue;
    const auto source = static_cast<std::uint32_t>(known.size());
    known.push_back(known_point(last, i, T_world_last, view));
    points.push_back({known.back().p_world, &last.seen.features->descriptors[i],
                      std::max(0, f.octave - 1), std::min(top, f.octave + 1),
                      radius_px * scales_.of(f.octave), f.angle_rad, source});
  }
  ProjectionMatcherConfig matcher;
  matcher.ratio = 0.9;
  matcher.check_orientation = true;
  std::vector<Pairing> pairings;
  for (const PointMatch& m : match_by_projection(camera_, T_guess_world, points, *frame.features,
                                                 frame.grid, usable_features(frame), matcher)) {
    pairings.push_back(known[m.source]);
    pairings.back().feature = m.feature;
  }
  return pairings;
}

std::vector<PoseEstimator::Pairing> PoseEstimator::match_last_by_descriptor(
    const FrameFeatures& frame, const TrackedFrame& last, const SE3& T_last_world,
    const LocalView& view) const {
  const SE3 T_world_last = T_last_world.inverse();
  std::vector<Pairing> pairings;
  for (const Match& m : match_brute_force(*last.seen.features, *frame.features, MatchConfig{})) {
    if (last.seen.static_weight[m.a] <= 0 || frame.static_weight[m.b] <= 0) continue;
    if (last.seen.features->points[m.a].depth_m <= 0 && !view.landmark(last.landmarks[m.a]))
      continue;
    pairings.push_back(known_point(last, m.a, T_world_last, view));
    pairings.back().feature = m.b;
  }
  return pairings;
}

std::optional<PoseSolution> PoseEstimator::solve(const FrameFeatures& frame,
                                                 const std::vector<Pairing>& pairings,
                                                 const SE3& T_guess_world) const {
  double on_surfaces = 0;
  for (const Pairing& p : pairings) {
    const bool outline = frame.features->points[p.feature].on_depth_edge;
    on_surfaces += outline ? 0.0 : frame.static_weight[p.feature];
  }
  NoiseConfig noise = config_.noise;
  if (on_surfaces < kFewOnSurfaces) noise.edge_weight = 1.0;
  std::vector<PoseObservation> observations;
  observations.reserve(pairings.size());
  for (const Pairing& p : pairings) {
    const Feature& f = frame.features->points[p.feature];
    observations.push_back({p.p_world, observation_of(f, scales_.of(f.octave), noise,
                                                      frame.static_weight[p.feature])});
  }
  return solve_pose(camera_, T_guess_world, observations, config_.pose);
}

std::optional<PoseResult> PoseEstimator::match_map(const FrameFeatures& frame,
                                                   const LocalView& view,
                                                   const FirstPose& first) const {
  const trace::Span span("local map");
  auto result = refine(frame, view, first, config_.search_map_px);
  if (!result || result->landmark_inliers < kThinMap) return result;
  const SE3 correction = result->T_camera_world * first.solution.T_camera_world.inverse();
  const double moved_px =
      camera_.fx() * (correction.angle() + correction.t().norm() / kTypicalDepth_m);
  if (moved_px <= 0.5 * config_.search_map_px) return result;
  const auto better = refine_on_map(frame, view, result->T_camera_world);
  return better && better->inliers > result->inliers ? better : result;
}

std::optional<PoseResult> PoseEstimator::refine(const FrameFeatures& frame, const LocalView& view,
                                                const FirstPose& first, double radius_px) const {
  PoseResult result;
  std::vector<Pairing> pairings;
  std::vector<Pairing> temporary;
  for (std::size_t i = 0; i < first.pairings.size(); ++i) {
    if (!first.solution.inlier[i]) continue;
    const bool mapped = view.landmark(first.pairings[i].landmark) != nullptr;
    (mapped ? pairings : temporary).push_back(first.pairings[i]);
    if (!mapped) temporary.back().landmark = kNoLandmark;
  }
  const bool knows_map = first.knows_map && std::ssize(pairings) >= kThinMap;
  if (config_.use_local_map && !knows_map)
    add_map_matches(frame, view, first.solution.T_camera_world, radius_px, pairings, result.seen);
  // Points of the previous frame carry its error: they help only where the map is thin.
  if (std::ssize(pairings) < kThinMap) {
    std::vector<std::uint8_t> taken(frame.features->size(), 0);
    for (const Pairing& p : pairings) taken[p.feature] = 1;
    for (const Pairing& p : temporary) {
      if (!taken[p.feature]) pairings.push_back(p);
    }
  }
  const auto pose = solve(frame, pairings, first.solution.T_camera_world);
  if (!pose) return std::nullopt;
  result.T_camera_world = pose->T_camera_world;
  result.landmarks.assign(frame.features->size(), kNoLandmark);
  result.matches = static_cast<int>(pairings.size());
  result.inliers = pose->inliers;
  judge_certainty(*pose, result);
  for (std::size_t i = 0; i < pairings.size(); ++i) {
    if (!pose->inlier[i] || pairings[i].landmark == kNoLandmark) continue;
    result.landmarks[pairings[i].feature] = pairings[i].landmark;
    ++result.landmark_inliers;
  }
  const std::unordered_set<LandmarkId> found(result.landmarks.begin(), result.landmarks.end());
  for (auto& seen : result.seen) seen.found = found.contains(seen.id) ? 1 : 0;
  return result;
}

void PoseEstimator::add_map_matches(const FrameFeatures& frame, const LocalView& view,
                                    const SE3& T_camera_world, double radius_px,
                                    std::vector<Pairing>& pairings,
                                    std::vector<KeyframeCandidate::Seen>& seen) const {
  auto usable = usable_features(frame);
  std::vector<std::uint8_t> already(view.landmarks.size(), 0);
  for (const Pairing& p : pairings) {
    usable[p.feature] = 0;
    already[static_cast<std::size_t>(view.find(p.landmark))] = 1;
    seen.push_back({p.landmark, 1, 0});
  }
  const Vec3 centre_world = T_camera_world.inverse().t();
  std::vector<SearchPoint> points;
  for (std::uint32_t i = 0; i < view.landmarks.size(); ++i) {
    const ViewLandmark& landmark = view.landmarks[i];
    if (already[i]) continue;
    const Vec3 p_camera = T_camera_world * landmark.p_world;
    if (p_camera.z() < kNearest_m || !camera_.sees(camera_.project(p_camera))) continue;
    const auto point = search_point(landmark, centre_world, scales_, radius_px, kAside, i);
    if (!point) continue;
    points.push_back(*point);
    seen.push_back({landmark.id, 1, 0});
  }
  for (const PointMatch& m : match_by_projection(camera_, T_camera_world, points, *frame.features,
                                                 frame.grid, usable, ProjectionMatcherConfig{})) {
    const ViewLandmark& landmark = view.landmarks[m.source];
    pairings.push_back({landmark.p_world, m.feature, landmark.id});
  }
}

}  // namespace ygslam
