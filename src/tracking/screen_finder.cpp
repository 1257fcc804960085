#include "tracking/screen_finder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/statistics.hpp"
#include "geometry/small_systems.hpp"
#include "image/depth.hpp"

namespace ygslam {
namespace {

// Depth contradicts the pose: so many times their mean would the squared residuals of depth fall
// elsewhere. Where depth and pose are right it is 5 in the median and 22 at most, in renderings.
constexpr double kConflict = 12;
constexpr double kBetterBy = 30;     // of the squared residuals: what depth decides by
constexpr int kDenseColumns = 64;    // of the samples that decide
constexpr double kDepthShare = 0.5;  // neighbours share a part of their noise
constexpr int kRefinements = 3;
constexpr int kManyMapped = 30;  // points: these will do
constexpr int kMostAnchorAge_frames = 15;
constexpr int kMostDoubtedAge_frames = 45;  // where depth begins to have the camera elsewhere
// By bench/deceptions.py (screens, floors) and recordings without either. Depth alone is believed
// where it fits as well as a sensor's noise lets it ...
constexpr double kFittingCost = 1.5;  // a sample
constexpr double kFittingOff = 0.15;  // of the samples
constexpr int kFittingSamples = 200;
// ... and contradicts the points where it is so many times worse at their pose, so far away.
constexpr double kDoubtedCost = 1.5;
constexpr double kDoubted_m = 0.012;
constexpr double kRivalCost = 2;
constexpr double kRival_m = 0.05;
constexpr double kDepthDamping = 1;  // [1/m2, 1/rad2], of directions that no surface tells
constexpr int kMostPause_frames = 30;
constexpr int kForgotten_frames = 60;    // after which the next suspicion is a first one
constexpr double kCovered = 0.7;         // of the points: a plane that may be all that is seen ...
constexpr double kClearConflict = 30;    // ... must not contradict depth
constexpr int kFewestMoving = 8;         // points on a screen ...
constexpr double kMostMoving = 0.5;      // ... and this share of it, where it moved the camera
constexpr double kSomeMoving = 0.15;     // ... where it did not, but ...
constexpr double kDrags_px = 0.3;        // ... pulls at the pose; else it does no harm
constexpr int kFewestBeside = 15;        // points that say how the camera moved
constexpr double kAgreeingBeside = 0.5;  // of the points beside it
constexpr double kMoves_px = 1.5;        // at least, and ...
constexpr double kMovesMedians = 5;      // ... times the median of the points beside it
constexpr std::size_t kMostPatches = 3;  // that are tried, those with most points first

constexpr double kStands_m = 0.015;  // a surface is where it was ...
constexpr double kStandsSigmas = 3;  // ... up to the noise of its depth ...
constexpr double kStanding = 0.8;    // ... at so many of its points
constexpr int kFewestSeen = 4;
constexpr int kEarlier_frames = 5;  // what stood before stood there so long ago

struct PatchPoints {
  int patch = -1;
  int points = 0;
};

/// The planes with most points, the fullest first.
std::vector<PatchPoints> fullest(std::span<const int> patch_of, std::size_t patches) {
  std::vector<PatchPoints> count(patches);
  for (int i = 0; i < std::ssize(count); ++i) count[static_cast<std::size_t>(i)].patch = i;
  for (const int patch : patch_of)
    if (patch >= 0) ++count[static_cast<std::size_t>(patch)].points;
  std::erase_if(count, [](const PatchPoints& p) { return p.points < kFewestMoving; });
  std::stable_sort(count.begin(), count.end(),
                   [](const PatchPoints& a, const PatchPoints& b) { return a.points > b.points; });
  if (count.size() > kMostPatches) count.resize(kMostPatches);
  return count;
}

}  // namespace

/// Whether the frame is worth the search: depth contradicts its pose, or points move.
bool ScreenFinder::is_suspect(double conflict, int moving) {
  if (conflict < kConflict && moving < kFewestMoving) {
    if (++waited_frames_ > kForgotten_frames) pause_frames_ = 0;
    if (pause_frames_ == 0) fruitless_conflict_ = 0;
    return false;
  }
  if (waited_frames_++ < pause_frames_ && conflict < 2 * fruitless_conflict_) return false;
  waited_frames_ = 0;
  fruitless_conflict_ = std::max({conflict, fruitless_conflict_, kConflict});
  pause_frames_ = std::min(pause_frames_ + pause_frames_ / 2 + 1, kMostPause_frames);
  return true;
}

ScreenFinder::Output ScreenFinder::step(const Place& place, int moving,
                                        const std::function<std::vector<Point>()>& points) {
  if (anchor_.empty()) return {};
  const DepthAgreement by_all = agreement(place, place.T_camera_world);
  Output nothing;
  nothing.conflict = by_all.possible_gain() / std::max(1.0, by_all.mean_cost());
  const auto T_depth_world = rival_by_depth(place, by_all, nothing.conflict);
  if (!T_depth_world && !is_suspect(nothing.conflict, moving)) return nothing;
  const std::vector<Point> found_points = points();
  Output out = search({place, found_points, T_depth_world});
  out.conflict = nothing.conflict;
  out.undecided |= !out.found && T_depth_world;
  out.undecided |= !out.found && out.covered > kCovered && out.conflict > kClearConflict;
  if (out.undecided || out.found) pause_frames_ = 0;
  return out;
}

/// Where depth alone has the camera, if it contradicts the points by more than it errs.
std::optional<SE3> ScreenFinder::rival_by_depth(const Place& place, const DepthAgreement& by_all,
                                                double conflict) {
  const bool is_turn = anchor_age_frames_ % 2 == 1;  // every other frame will do to begin with
  if (!in_doubt_ && (conflict < kConflict || !is_turn)) return std::nullopt;
  in_doubt_ = false;
  // From where depth had the last frame, on by the step that the points have taken.
  const SE3 T_odom_start =
      T_odom_last_ * T_placed_depth_ * T_odom_last_.inverse() * place.T_odom_camera;
  const SE3 T_odom_world = place.T_odom_camera * place.T_camera_world;
  const auto alone = by_depth(place, T_odom_start.inverse() * T_odom_world);
  if (!alone) return std::nullopt;
  T_odom_depth_ = T_odom_world * alone->T_camera_world.inverse();
  const double worse = by_all.mean_cost() / alone->agreement.mean_cost();
  in_doubt_ = worse > kDoubtedCost && alone->apart_m > kDoubted_m;
  const bool is_rival = worse > kRivalCost && alone->apart_m > kRival_m;
  return is_rival ? std::optional(alone->T_camera_world) : std::nullopt;
}

std::optional<ScreenFinder::ByDepth> ScreenFinder::by_depth(const Place& place,
                                                            const SE3& T_start_world) const {
  if (anchor_.empty()) return std::nullopt;
  SE3 T_camera_world = T_start_world;
  for (int round = 0; round < kRefinements; ++round) {
    const DepthAgreement depth = agreement(place, T_camera_world);
    if (round == kRefinements - 1 && depth.mean_cost() > 2 * kFittingCost) return std::nullopt;
    const Vec6 step = SymmetricSystem6(depth.information + kDepthDamping * Mat6::Identity())
                          .solve(depth.gradient);
    if (!step.allFinite()) return std::nullopt;
    T_camera_world = SE3::exp(-step) * T_camera_world;
  }
  ByDepth found{T_camera_world, agreement(place, T_camera_world), 0};
  if (found.agreement.samples < kFittingSamples || found.agreement.mean_cost() > kFittingCost ||
      found.agreement.off > kFittingOff * found.agreement.samples)
    return std::nullopt;
  const SE3 T_there_here = T_camera_world * place.T_camera_world.inverse();
  const SE3 T_here_anchor = place.T_camera_world * T_anchor_world(place).inverse();
  for (const Vec3& p : anchor_.points()) {
    const Vec3 p_here = T_here_anchor * p;
    found.apart_m += (T_there_here * p_here - p_here).norm();
  }
  found.apart_m /= static_cast<double>(anchor_.points().size());
  return found;
}

void ScreenFinder::remember(const FrameFeatures& now, const SE3& T_odom_camera) {
  T_placed_depth_ = T_odom_depth_ && in_doubt_ ? T_odom_camera.inverse() * *T_odom_depth_ : SE3();
  T_odom_last_ = T_odom_camera;
  T_odom_depth_.reset();
  const int most_frames = in_doubt_ ? kMostDoubtedAge_frames : kMostAnchorAge_frames;
  if (!anchor_.empty() && ++anchor_age_frames_ < most_frames) return;
  T_placed_depth_ = SE3();
  in_doubt_ = false;
  anchor_ = DepthSamples(camera_, now.frame->depth_m);
  anchor_frame_ = now.frame;
  T_odom_anchor_ = T_odom_camera;
  anchor_age_frames_ = 0;
}

void ScreenFinder::forget() {
  anchor_ = {};
  anchor_frame_.reset();
  in_doubt_ = false;
  pause_frames_ = waited_frames_ = 0;
}

/// Whether the points of a plane lie where a surface was before.
bool ScreenFinder::stood_before(const Place& place, const Finding& found) const {
  if (anchor_age_frames_ < kEarlier_frames) return false;
  const SE3 T_anchor_camera = T_anchor_world(place) * found.T_camera_world.inverse();
  int seen = 0;
  int agreeing = 0;
  for (const Vec3& p : found.screen.p_camera) {
    const Vec3 p_anchor = T_anchor_camera * p;
    if (p_anchor.z() <= 0) continue;
    const Vec2 uv_px = camera_.distort(camera_.project(p_anchor));
    if (!camera_.contains(uv_px)) continue;
    const double seen_m = depth_at(anchor_frame_->depth_m, uv_px.x(), uv_px.y());
    if (!(seen_m > 0)) continue;
    ++seen;
    agreeing +=
        std::abs(seen_m - p_anchor.z()) < kStands_m + kStandsSigmas * kinect_depth_sigma_m(seen_m)
            ? 1
            : 0;
  }
  return seen >= kFewestSeen && agreeing >= kStanding * seen;
}

SE3 ScreenFinder::T_anchor_world(const Place& place) const {
  return T_odom_anchor_.inverse() * place.T_odom_camera * place.T_camera_world;
}

/// The pose that both its points and depth agree with best.
SE3 ScreenFinder::with_depth(const Place& place, const SE3& T_points_world,
                             const Mat6& information) const {
  if (anchor_.empty()) return T_points_world;
  SE3 T_camera_world = T_points_world;
  for (int round = 0; round < kRefinements; ++round) {
    const DepthAgreement depth = agreement(place, T_camera_world);
    const Vec6 moved = (T_camera_world * T_points_world.inverse()).log();
    const Mat6 H = kDepthShare * depth.information + information;
    const Vec6 step = SymmetricSystem6(H).solve(kDepthShare * depth.gradient + information * moved);
    if (!step.allFinite()) return T_points_world;
    T_camera_world = SE3::exp(-step) * T_camera_world;
  }
  return T_camera_world;
}

DepthAgreement ScreenFinder::agreement(const Place& place, const SE3& T_camera_world) const {
  return compare_depth(camera_, anchor_, place.now.frame->depth_m,
                       T_camera_world * T_anchor_world(place).inverse());
}

ScreenFinder::Output ScreenFinder::search(const Input& in) const {
  const PlanarPatches patches(camera_, in.place.now.frame->depth_m);
  const std::vector<int> patch_of = patches_of(in, patches);
  const auto order = fullest(patch_of, patches.planes().size());
  Output out;
  if (!order.empty())
    out.covered = static_cast<double>(order.front().points) / static_cast<double>(in.points.size());
  std::optional<double> cost_by_all;
  double least_cost = std::numeric_limits<double>::infinity();
  for (const auto& [patch, points] : order) {
    auto rival = without(in, patch_of, patch);
    if (!rival && in.T_depth_world) rival = without_by_depth(in, patch_of, patch);
    if (!rival) continue;
    if (!cost_by_all) cost_by_all = decisive_cost(in.place, in.place.T_camera_world);
    const double cost =
        rival->moves_camera ? decisive_cost(in.place, rival->T_camera_world) : *cost_by_all;
    if (rival->moves_camera && *cost_by_all - cost < kBetterBy) {
      out.undecided |= cost - *cost_by_all < kBetterBy;
      continue;
    }
    if (cost >= least_cost) continue;
    Finding found = finding(in, *rival, patches.planes()[static_cast<std::size_t>(patch)]);
    // What moves on a plane that came with it is a thing that moves.
    if (!rival->moves_camera && !stood_before(in.place, found)) continue;
    least_cost = cost;
    out.found = std::move(found);
  }
  return out;
}

/// Per point the plane it lies on, -1 if none.
std::vector<int> ScreenFinder::patches_of(const Input& in, const PlanarPatches& patches) const {
  std::vector<int> patch_of;
  patch_of.reserve(in.points.size());
  for (const Point& point : in.points) {
    const Feature& f = in.place.now.features->points[point.feature];
    const Vec3 p_camera = camera_.unproject(f.ideal_px.cast<double>(), f.depth_m);
    patch_of.push_back(patches.patch_at(f.uv_px, p_camera));
  }
  return patch_of;
}

/// Of depth at many pixels, in squared sigmas.
double ScreenFinder::decisive_cost(const Place& place, const SE3& T_camera_world) const {
  const DepthSamples dense(camera_, anchor_frame_->depth_m, kDenseColumns);
  return compare_depth(camera_, dense, place.now.frame->depth_m,
                       T_camera_world * T_anchor_world(place).inverse())
      .cost;
}

ScreenFinder::Finding ScreenFinder::finding(const Input& in, const Hypothesis& rival,
                                            const Vec3& plane) const {
  Finding found{{{}, plane}, rival.T_camera_world, rival.moves_camera};
  for (const std::uint32_t i : rival.moving) {
    const Feature& f = in.place.now.features->points[in.points[i].feature];
    found.screen.p_camera.push_back(camera_.unproject(f.ideal_px.cast<double>(), f.depth_m));
  }
  return found;
}

std::optional<ScreenFinder::Hypothesis> ScreenFinder::without(const Input& in,
                                                              std::span<const int> patch_of,
                                                              int patch) const {
  const auto beside = pose_beside(in, patch_of, patch);
  if (!beside) return std::nullopt;
  if (std::ssize(split(in, patch_of, patch, beside->T_camera_world).moving) < kFewestMoving)
    return std::nullopt;
  const SE3 T_camera_world = with_depth(in.place, beside->T_camera_world, beside->information);
  Hypothesis rival = split(in, patch_of, patch, T_camera_world);
  if (std::ssize(rival.moving) < kFewestMoving) return std::nullopt;
  const double enough = rival.moves_camera ? kMostMoving : kSomeMoving;
  const bool drags = rival.moves_camera || shift_px(in, patch_of, patch, rival) > kDrags_px;
  if (!drags || rival.share_moving < enough) return std::nullopt;
  return rival;
}

/// Too few points are beside the plane to say how the camera moved, but depth does.
std::optional<ScreenFinder::Hypothesis> ScreenFinder::without_by_depth(
    const Input& in, std::span<const int> patch_of, int patch) const {
  Hypothesis rival;
  rival.T_camera_world = *in.T_depth_world;
  rival.moves_camera = true;
  const std::vector<double> by_all_px = residuals_px(in, in.place.T_camera_world);
  const std::vector<double> by_depth_px = residuals_px(in, *in.T_depth_world);
  int mapped = 0;  // the others are where the points had the frame before
  for (std::uint32_t i = 0; i < in.points.size(); ++i) {
    if (patch_of[i] != patch || !in.points[i].mapped) continue;
    ++mapped;
    if (by_all_px[i] <= kMoves_px && by_depth_px[i] > kMovesMedians * kMoves_px)
      rival.moving.push_back(i);
  }
  rival.share_moving = static_cast<double>(rival.moving.size()) / std::max(1, mapped);
  const bool moves = std::ssize(rival.moving) >= kFewestMoving && rival.share_moving >= kMostMoving;
  return moves ? std::optional(rival) : std::nullopt;
}

/// By the points that are not on the plane, if most of them agree.
std::optional<PoseSolution> ScreenFinder::pose_beside(const Input& in,
                                                      std::span<const int> patch_of,
                                                      int patch) const {
  std::vector<PoseObservation> beside;
  std::vector<PoseObservation> mapped;  // where odometry erred lately, these still stand right
  for (std::size_t i = 0; i < in.points.size(); ++i) {
    if (patch_of[i] == patch) continue;
    const Feature& f = in.place.now.features->points[in.points[i].feature];
    beside.push_back({in.points[i].p_world, observation_of(f, scales_.of(f.octave), noise_, 1)});
    if (in.points[i].mapped) mapped.push_back(beside.back());
  }
  if (std::ssize(mapped) >= kManyMapped) beside = std::move(mapped);
  if (std::ssize(beside) < kFewestBeside) return std::nullopt;
  auto pose = solve_pose(camera_, in.place.T_camera_world, beside, {});
  if (!pose || pose->inliers < kFewestBeside ||
      pose->inliers < kAgreeingBeside * static_cast<double>(beside.size()))
    return std::nullopt;
  return pose;
}

/// What of the plane moves if the camera is there.
ScreenFinder::Hypothesis ScreenFinder::split(const Input& in, std::span<const int> patch_of,
                                             int patch, const SE3& T_camera_world) const {
  Hypothesis rival;
  rival.T_camera_world = T_camera_world;
  const std::vector<double> by_all_px = residuals_px(in, in.place.T_camera_world);
  const std::vector<double> by_rival_px = residuals_px(in, T_camera_world);
  std::vector<double> beside_px;
  for (std::size_t i = 0; i < in.points.size(); ++i)
    if (patch_of[i] != patch) beside_px.push_back(by_rival_px[i]);
  const double limit_px = std::max(kMoves_px, kMovesMedians * median(std::move(beside_px)));
  int on_plane = 0;
  int only_by_rival = 0;
  for (std::uint32_t i = 0; i < in.points.size(); ++i) {
    if (patch_of[i] != patch) continue;
    ++on_plane;
    if (by_rival_px[i] <= limit_px) continue;
    rival.moving.push_back(i);
    only_by_rival += by_all_px[i] <= limit_px ? 1 : 0;
  }
  rival.share_moving = static_cast<double>(rival.moving.size()) / std::max(1, on_plane);
  rival.moves_camera = 2 * only_by_rival > std::ssize(rival.moving);
  return rival;
}

/// How far the two poses are apart in the image of the plane.
double ScreenFinder::shift_px(const Input& in, std::span<const int> patch_of, int patch,
                              const Hypothesis& rival) const {
  std::vector<double> shifts_px;
  for (std::size_t i = 0; i < in.points.size(); ++i) {
    if (patch_of[i] != patch) continue;
    const Vec3& p_world = in.points[i].p_world;
    shifts_px.push_back((camera_.project(in.place.T_camera_world * p_world) -
                         camera_.project(rival.T_camera_world * p_world))
                            .norm());
  }
  return shifts_px.empty() ? 0 : median(std::move(shifts_px));
}

std::vector<double> ScreenFinder::residuals_px(const Input& in, const SE3& T_camera_world) const {
  std::vector<double> result;
  for (const Point& point : in.points) {
    const Feature& f = in.place.now.features->points[point.feature];
    const Vec3 p = T_camera_world * point.p_world;
    const double px = (camera_.project(p) - f.ideal_px.cast<double>()).norm();
    result.push_back(p.z() > 0 ? px / scales_.of(f.octave) : 1e6);
  }
  return result;
}

}  // namespace ygslam
