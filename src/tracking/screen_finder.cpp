#include "tracking/screen_finder.hpp"

#include <algorithm>
#include <cmath>

#include "core/statistics.hpp"
#include "image/depth.hpp"

namespace ygslam {
namespace {

// Depth contradicts the pose: so many times their mean would the squared residuals of depth fall
// elsewhere. Where depth and pose are right it is 5 in the median and 22 at most.
constexpr double kConflict = 20;
constexpr double kBetterBy = 25;  // of the residuals: what depth decides by
constexpr int kMostAnchorAge_frames = 15;
constexpr int kMostPause_frames = 30;
constexpr int kFewestMoving = 8;         // points on a screen ...
constexpr double kMostMoving = 0.5;      // ... and this share of it, where it moved the camera
constexpr double kSomeMoving = 0.15;     // ... where it did not
constexpr int kFewestBeside = 15;        // points that say how the camera moved
constexpr double kAgreeingBeside = 0.5;  // of the points beside it
constexpr double kMoves_px = 1.5;        // at least, and ...
constexpr double kMovesMedians = 5;      // ... times the median of the points beside it
constexpr std::size_t kMostPatches = 4;  // that are tried, those with most points first

constexpr double kStands_m = 0.015;  // a surface is where it was ...
constexpr double kStandsSigmas = 3;  // ... up to the noise of its depth ...
constexpr double kStanding = 0.8;    // ... at so many of its points
constexpr int kEarlier_frames = 5;   // what stood before stood there so long ago

}  // namespace

/// Whether the frame is worth the search: depth contradicts its pose, or points move.
bool ScreenFinder::is_suspect(const DepthAgreement& by_all, int moving) {
  const double conflict = by_all.possible_gain() / std::max(1.0, by_all.mean_cost());
  if (conflict < kConflict && moving < kFewestMoving) {
    pause_frames_ = 0;
    fruitless_conflict_ = 0;
    return false;
  }
  if (waited_frames_++ < pause_frames_ && conflict < 2 * fruitless_conflict_) return false;
  waited_frames_ = 0;
  fruitless_conflict_ = std::max({conflict, fruitless_conflict_, kConflict});
  pause_frames_ = std::clamp(2 * pause_frames_, 1, kMostPause_frames);
  return true;
}

ScreenFinder::Output ScreenFinder::step(const Place& place, int moving,
                                        const std::function<std::vector<Point>()>& points) {
  if (anchor_.empty()) return {};
  const DepthAgreement by_all = agreement(place, place.T_camera_world);
  if (!is_suspect(by_all, moving)) return {};
  const std::vector<Point> found_points = points();
  return search({place, found_points}, by_all);
}

void ScreenFinder::remember(const FrameFeatures& now, const SE3& T_odom_camera) {
  if (!anchor_.empty() && ++anchor_age_frames_ < kMostAnchorAge_frames) return;
  anchor_ = DepthSamples(camera_, now.frame->depth_m);
  anchor_frame_ = now.frame;
  T_odom_anchor_ = T_odom_camera;
  anchor_age_frames_ = 0;
}

void ScreenFinder::forget() {
  anchor_ = {};
  anchor_frame_.reset();
  pause_frames_ = waited_frames_ = 0;
}

/// Whether the points of a plane lie where a surface was before.
bool ScreenFinder::stood_before(const Place& place, const SE3& T_camera_world,
                                std::span<const Vec3> p_camera) const {
  const SE3 T_anchor_camera = T_anchor_world(place) * T_camera_world.inverse();
  int seen = 0;
  int agreeing = 0;
  for (const Vec3& p : p_camera) {
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
  return seen >= kFewestMoving / 2 && agreeing >= kStanding * seen;
}

SE3 ScreenFinder::T_anchor_world(const Place& place) const {
  return T_odom_anchor_.inverse() * place.T_odom_camera * place.T_camera_world;
}

DepthAgreement ScreenFinder::agreement(const Place& place, const SE3& T_camera_world) const {
  return compare_depth(camera_, anchor_, place.now.frame->depth_m,
                       T_camera_world * T_anchor_world(place).inverse());
}

ScreenFinder::Output ScreenFinder::search(const Input& in, const DepthAgreement& by_all) {
  const PlanarPatches patches(camera_, in.place.now.frame->depth_m);
  std::vector<int> points_on(patches.planes().size(), 0);
  std::vector<int> patch_of;
  for (const Point& point : in.points) {
    const Feature& f = in.place.now.features->points[point.feature];
    const Vec3 p_camera = camera_.unproject(f.ideal_px.cast<double>(), f.depth_m);
    patch_of.push_back(patches.patch_at(f.uv_px, p_camera));
    if (patch_of.back() >= 0) ++points_on[static_cast<std::size_t>(patch_of.back())];
  }
  std::vector<int> order;
  for (int i = 0; i < std::ssize(points_on); ++i)
    if (points_on[static_cast<std::size_t>(i)] >= kFewestMoving) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return points_on[static_cast<std::size_t>(a)] > points_on[static_cast<std::size_t>(b)];
  });
  order.resize(std::min(order.size(), kMostPatches));
  Output out;
  double least_cost = by_all.mean_cost();
  for (const int patch : order) {
    const auto rival = without(in, patch_of, patch);
    if (!rival) continue;
    DepthAgreement depth = by_all;
    if (rival->moves_camera) {
      depth = agreement(in.place, rival->T_camera_world);
      const bool is_better = by_all.cost - depth.cost > kBetterBy &&
                             depth.possible_gain() < 0.5 * by_all.possible_gain();
      if (!is_better) continue;
    }
    if (out.found && depth.mean_cost() >= least_cost) continue;
    Finding found{{{}, patches.planes()[static_cast<std::size_t>(patch)]},
                  rival->T_camera_world,
                  rival->moves_camera};
    for (const std::uint32_t i : rival->moving) {
      const Feature& f = in.place.now.features->points[in.points[i].feature];
      found.screen.p_camera.push_back(camera_.unproject(f.ideal_px.cast<double>(), f.depth_m));
    }
    if (!rival->moves_camera &&
        (anchor_age_frames_ < kEarlier_frames ||
         !stood_before(in.place, rival->T_camera_world, found.screen.p_camera))) {
      continue;
    }
    least_cost = depth.mean_cost();
    out.found = std::move(found);
  }
  return out;
}

std::optional<ScreenFinder::Hypothesis> ScreenFinder::without(const Input& in,
                                                              std::span<const int> patch_of,
                                                              int patch) const {
  std::vector<PoseObservation> beside;
  for (std::size_t i = 0; i < in.points.size(); ++i) {
    const Feature& f = in.place.now.features->points[in.points[i].feature];
    if (patch_of[i] != patch)
      beside.push_back({in.points[i].p_world, observation_of(f, scales_.of(f.octave), noise_, 1)});
  }
  if (std::ssize(beside) < kFewestBeside) return std::nullopt;
  const auto pose = solve_pose(camera_, in.place.T_camera_world, beside, {});
  if (!pose || pose->inliers < kFewestBeside ||
      pose->inliers < kAgreeingBeside * static_cast<double>(beside.size()))
    return std::nullopt;

  Hypothesis rival;
  rival.T_camera_world = pose->T_camera_world;
  rival.beside = pose->inliers;
  const std::vector<double> by_all_px = residuals_px(in, in.place.T_camera_world);
  const std::vector<double> by_rival_px = residuals_px(in, pose->T_camera_world);
  std::vector<double> beside_px;
  for (std::size_t i = 0; i < in.points.size(); ++i)
    if (patch_of[i] != patch) beside_px.push_back(by_rival_px[i]);
  const double limit_px = std::max(kMoves_px, kMovesMedians * median(beside_px));
  int on_plane = 0;
  int moved_by_rival = 0;
  for (std::uint32_t i = 0; i < in.points.size(); ++i) {
    if (patch_of[i] != patch) continue;
    ++on_plane;
    if (by_rival_px[i] <= limit_px) continue;
    rival.moving.push_back(i);
    moved_by_rival += by_all_px[i] <= limit_px ? 1 : 0;
  }
  const auto moving = std::ssize(rival.moving);
  rival.share_moving = static_cast<double>(moving) / std::max(1, on_plane);
  rival.moves_camera = 2 * moved_by_rival > moving;
  const double enough = rival.moves_camera ? kMostMoving : kSomeMoving;
  if (moving < kFewestMoving || rival.share_moving < enough) return std::nullopt;
  return rival;
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
