#include "tracking/screen_watch.hpp"

#include <utility>

#include "geometry/small_systems.hpp"

namespace ygslam {
namespace {

constexpr int kFewBesideScreen = 100;  // points
constexpr double kCarried_m = 0.03;    // where the points have the camera so far from depth
constexpr double kContradiction = 60;  // ScreenFinder::Output::conflict; noise is 22 at most

/// Nothing is known that explains its motion.
bool may_tell(const PointEvidence& evidence) {
  return evidence.semantic.label != SemanticLabel::kMovable && !evidence.on_screen &&
         !evidence.in_free_space;
}

ScreenFinder::Place place_at(const SE3& T_camera_world, const FrameFeatures& seen,
                             const ScreenWatch::Before& before) {
  return {seen, T_camera_world,
          before.T_odom_last * before.T_last_world * T_camera_world.inverse()};
}

}  // namespace

ScreenWatch::ScreenWatch(const ScreenConfig& config, const Camera& camera,
                         const PyramidScales& scales, const NoiseConfig& noise,
                         const PointClassifier& classifier)
    : enabled_(config.enabled && uses_geometry(classifier.config().mode)),
      camera_(camera),
      classifier_(classifier),
      finder_(camera, scales, noise) {}

ObservedFrame ScreenWatch::labelled_ahead(ObservedFrame now, const SE3& T_odom_last,
                                          const SE3& T_now_last) const {
  if (screens_.empty()) return now;
  const auto& ego_motion = now.evidence.ego_motion;
  const SE3& T_moved = ego_motion ? ego_motion->T_current_previous : T_now_last;
  return labelled(std::move(now), T_odom_last * T_moved.inverse());
}

ObservedFrame ScreenWatch::labelled(ObservedFrame now, const SE3& T_odom_camera) const {
  std::vector<std::uint8_t> on_screen;
  for (const Feature& f : now.seen.features->points) {
    const Vec3 p_camera = camera_.unproject(f.ideal_px.cast<double>(), f.depth_m);
    on_screen.push_back(f.depth_m > 0 && screens_.shows(T_odom_camera * p_camera, f.depth_m));
  }
  now.evidence = with_screens(std::move(now.evidence), on_screen);
  now.labels = classifier_.classify(now.evidence);
  now.seen.static_weight = now.labels.weight;
  return now;
}

ScreenWatch::Output ScreenWatch::step(const Input& in) {
  Output out;
  if (!enabled_) return out;
  const auto place = place_at(in.pose.T_camera_world, in.seen, in.before);
  const auto looked =
      finder_.step(place, unexplained_motions(in.now), [&] { return points_before(in); });
  const bool contradicts = !looked.found && looked.conflict > kContradiction;
  out.contested = looked.undecided || (contradicts && !screens_.empty());
  if (!looked.found) return out;
  const SE3& T_without_world = looked.found->T_camera_world;
  const SE3 T_odom_camera = place_at(T_without_world, in.seen, in.before).T_odom_camera;
  screens_.add(looked.found->screen, T_odom_camera, in.seen.frame->stamp);
  ObservedFrame now = in.now;
  now.evidence = classifier_.held_against(std::move(now.evidence),
                                          T_without_world * in.before.T_last_world.inverse());
  out.without = {labelled(std::move(now), T_odom_camera), T_without_world};
  return out;
}

SE3 ScreenWatch::steadied(const PoseResult& pose, const FrameFeatures& seen,
                          const Before& before) const {
  if (screens_.empty() || pose.inliers >= kFewBesideScreen || !pose.covariance)
    return pose.T_camera_world;
  // A screen leaves few points, at the image's edges; depth is known everywhere.
  return finder_.with_depth(place_at(pose.T_camera_world, seen, before), pose.T_camera_world,
                            SymmetricSystem6(*pose.covariance).inverse());
}

std::optional<PoseResult> ScreenWatch::carried(const std::optional<PoseResult>& pose,
                                               const SE3& T_guess_world, const FrameFeatures& seen,
                                               const Before& before) const {
  if (screens_.empty()) return std::nullopt;
  if (pose && pose->inliers >= kFewBesideScreen) return std::nullopt;
  const SE3& T_camera_world = pose ? pose->T_camera_world : T_guess_world;
  const ScreenFinder::Place place = place_at(T_camera_world, seen, before);
  auto by_depth = finder_.by_depth(place, before.T_last_world);
  const auto predicted = finder_.by_depth(place, T_guess_world);
  if (predicted && (!by_depth || predicted->agreement.cost < by_depth->agreement.cost))
    by_depth = predicted;
  if (!by_depth || (pose && by_depth->apart_m < kCarried_m)) return std::nullopt;
  PoseResult carried;
  carried.T_camera_world = by_depth->T_camera_world;
  carried.landmarks.assign(seen.features->size(), kNoLandmark);
  carried.matches = by_depth->agreement.samples;
  carried.inliers = by_depth->agreement.samples - by_depth->agreement.off;
  // Where no surface tells, as uncertain as a metre and a radian.
  const Mat6 information = by_depth->agreement.information + Mat6::Identity();
  carried.covariance = information.inverse();
  carried.position_std_m = std::sqrt(carried.covariance->topLeftCorner<3, 3>().trace());
  carried.contested = true;
  return carried;
}

void ScreenWatch::follow(const ObservedFrame& now, const SE3& T_odom_camera) {
  if (!enabled_) return;
  finder_.remember(now.seen, T_odom_camera);
  screens_.forget_still(now.seen.frame->stamp);
  if (!screens_.empty()) screens_.renew(moving(now), T_odom_camera, now.seen.frame->stamp);
}

void ScreenWatch::forget() {
  screens_.clear();
  finder_.forget();
}

/// What seems to move, but is on nothing that is known to be able to: on a screen, too.
std::vector<Vec3> ScreenWatch::moving(const ObservedFrame& now) const {
  std::vector<Vec3> p_moving;
  const auto motion = classifier_.motion_of(now.evidence);
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const Feature& f = now.seen.features->points[i];
    const PointEvidence& evidence = now.evidence.points[i];
    if (motion[i] == PointMotion::kMoves && f.depth_m > 0 && !evidence.in_free_space &&
        evidence.semantic.label != SemanticLabel::kMovable)
      p_moving.push_back(camera_.unproject(f.ideal_px.cast<double>(), f.depth_m));
  }
  return p_moving;
}

int ScreenWatch::unexplained_motions(const ObservedFrame& now) const {
  const auto motion = classifier_.motion_of(now.evidence);
  int count = 0;
  for (std::size_t i = 0; i < motion.size(); ++i)
    count += motion[i] == PointMotion::kMoves && may_tell(now.evidence.points[i]) ? 1 : 0;
  return count;
}

/// Features that go on from the frame before, with their place in the world as it was known there.
std::vector<ScreenFinder::Point> ScreenWatch::points_before(const Input& in) const {
  const auto& [last, T_last_world, T_odom_last, view] = in.before;
  const SE3 T_world_last = T_last_world.inverse();
  std::vector<ScreenFinder::Point> points;
  for (std::uint32_t i = 0; i < in.now.evidence.points.size(); ++i) {
    const std::int32_t k = in.now.evidence.links[i];
    if (k < 0 || !may_tell(in.now.evidence.points[i])) continue;
    if (!(in.now.seen.features->points[i].depth_m > 0)) continue;
    const ViewLandmark* landmark = view.landmark(in.pose.landmarks[i]);
    if (!landmark) landmark = view.landmark(last.landmarks[static_cast<std::size_t>(k)]);
    const Feature& before = last.seen.features->points[static_cast<std::size_t>(k)];
    if (landmark) {
      points.push_back({i, landmark->p_world, true});
    } else if (before.depth_m > 0) {
      const Vec3 p_last = camera_.unproject(before.ideal_px.cast<double>(), before.depth_m);
      points.push_back({i, T_world_last * p_last, false});
    }
  }
  return points;
}

}  // namespace ygslam
