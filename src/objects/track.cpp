#include "objects/track.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "objects/quantile.hpp"

namespace ygslam {
namespace {

constexpr double kMaxSpeedMps = 5;  // beyond, the points were not the same
constexpr double kVelocityWindow_s = 0.5;
constexpr double kHalfBody_m = 0.12;      // from the side that is seen to the middle of a person
constexpr double kAppearanceShare = 0.1;  // of a new appearance in the remembered one

// When a track is confirmed.
constexpr double kMaskEvidence = 3;    // sum of the scores of its masks ...
constexpr double kOverlooked = 0.5;    // ... less this for each that shows its place without it
constexpr double kMoverEvidence = 10;  // frames of motion
constexpr double kMoverWay_m = 0.05;   // that a mover has come ...
constexpr double kMoverStraight =
    0.5;                            // ... of its path (noise goes to and fro), its centre of that
constexpr double kTentative_s = 1;  // unconfirmed or without a class it is kept for so long

constexpr double kGrows = 0.3;     // of what is seen of it in how large it is known to be ...
constexpr double kShrinks = 0.05;  // ... where that is less

// When it is in sight.
constexpr double kShowMissed_s = 0.5;     // masks may overlook it for so long
constexpr double kFade_s = 1;             // and for so long it counts as live
constexpr double kPresentDepth_m = 0.4;   // surface so near to its depth ...
constexpr double kPresentShare = 0.15;    // ... fills so much of its box
constexpr double kPartOfBox = 0.5;        // a smaller instance is a part of it ...
constexpr double kStillThere = 0.4;       // ... where its box has so much surface no mask shows
constexpr double kMinVisibleShare = 0.1;  // of its box in the image
constexpr double kNear_m = 0.8;           // nearer, a part of it may be too near for depth ...
constexpr double kNearShare = 0.3;        // ... where so much of its box has none

constexpr double kRestMovingShare = 0.1;  // fewer of its judged points move: it rests ...
constexpr int kRestFrames = 15;           // ... once that has held for so long

PixelBox shifted(const PixelBox& box, const Vec2& by_px, double scale) {
  scale = std::clamp(scale, 0.9, 1.1);
  const double cx = (box.x0 + box.x1) / 2 + by_px.x();
  const double cy = (box.y0 + box.y1) / 2 + by_px.y();
  const double w = scale * box.width() / 2, h = scale * box.height() / 2;
  return {static_cast<float>(cx - w), static_cast<float>(cy - h), static_cast<float>(cx + w),
          static_cast<float>(cy + h)};
}

/// How far points came that have depth in both frames and surely are the same.
std::vector<Vec3> displacements(const PointIndices& points, const ObjectFrame& from,
                                const ObjectFrame& to) {
  std::vector<Vec3> moved;
  const double max_m = kMaxSpeedMps * to.seconds_since(from.in.stamp);
  for (const std::uint32_t i : points) {
    const ObjectPoint& b = to.in.points[i];
    if (b.previous < 0 || b.previous >= std::ssize(from.in.points)) continue;
    const ObjectPoint& a = from.in.points[b.previous];
    if (!(a.depth_m > 0 && b.depth_m > 0)) continue;
    const Vec3 d = b.p_odom - a.p_odom;
    if (d.norm() <= max_m) moved.push_back(d);
  }
  return moved;
}

/// @return nullopt with too few points.
std::optional<PixelBox> box_along_flow(const PixelBox& box, const ObjectFrame& from,
                                       const ObjectFrame& to, const PointIndices& on_it) {
  std::vector<double> du, dv, scale;
  for (const std::uint32_t i : on_it) {
    const ObjectPoint& b = to.in.points[i];
    const ObjectPoint& a = from.in.points[b.previous];
    du.push_back(b.uv_px.x() - a.uv_px.x());
    dv.push_back(b.uv_px.y() - a.uv_px.y());
    if (a.depth_m > 0 && b.depth_m > 0) scale.push_back(a.depth_m / b.depth_m);
  }
  if (scale.size() < kMinTrackPoints) return std::nullopt;
  return shifted(box, {quantile(du, 0.5), quantile(dv, 0.5)}, quantile(scale, 0.5));
}

/// @return empty where it would come too near to the camera to be projected.
PixelBox box_along_motion(const PixelBox& box, const Vec3& from_cam, const Vec3& to_cam,
                          const Camera& camera) {
  constexpr double kNearest_m = 0.3;
  if (from_cam.z() < kNearest_m || to_cam.z() < kNearest_m) return {};
  if (box.empty()) return box;
  return shifted(box,
                 camera.distort(camera.project(to_cam)) - camera.distort(camera.project(from_cam)),
                 from_cam.z() / to_cam.z());
}

struct SurfaceShare {
  int there = 0, cells = 0, without_depth = 0;
};

/// Cells of the thumbnail in a place's box: all with depth, those at its depth, those without.
/// @param ids if given, those with depth that belong to an instance are not `there`.
SurfaceShare surface_at(const ObjectFrame& frame, const TrackPlace& place, const GreyImage* ids) {
  constexpr int kStep = Thumbnail::kStep;
  const DepthImage& depth_m = frame.in.thumbnail.depth_m;
  const double own_m = frame.depth_m(place.centre_odom);
  const PixelBox& box = place.box;
  SurfaceShare result;
  for (int y = static_cast<int>(std::max(0.0F, box.y0)) / kStep;
       y < depth_m.height() && static_cast<float>(y * kStep) < box.y1; ++y) {
    for (int x = static_cast<int>(std::max(0.0F, box.x0)) / kStep;
         x < depth_m.width() && static_cast<float>(x * kStep) < box.x1; ++x) {
      if (!(depth_m.at(x, y) > 0)) {
        ++result.without_depth;
        continue;
      }
      ++result.cells;
      if (ids && ids->contains(x * kStep, y * kStep) && ids->at(x * kStep, y * kStep) > 0) continue;
      result.there += std::abs(depth_m.at(x, y) - own_m) <= kPresentDepth_m ? 1 : 0;
    }
  }
  return result;
}

/// Whether so much of it is too near for depth that the rest says little about where it is.
bool is_too_near(const ObjectFrame& frame, const TrackPlace& place) {
  if (frame.depth_m(place.centre_odom) > kNear_m) return false;
  const SurfaceShare surface = surface_at(frame, place, nullptr);
  return surface.without_depth > kNearShare * (surface.cells + surface.without_depth);
}

}  // namespace

bool Track::is_confirmed() const {
  if (is_known()) return evidence_ >= kMaskEvidence;
  if (evidence_ < kMoverEvidence || !first_centre_odom_) return false;
  // Points that slide along an edge come from one end and vanish at the other: the thing stays.
  const double way_m = way_m_.norm();
  const double centre_m = (place.centre_odom - *first_centre_odom_).dot(way_m_.normalized());
  return way_m >= kMoverWay_m && way_m >= kMoverStraight * path_m_ &&
         centre_m >= kMoverStraight * way_m;
}

bool Track::is_forgotten(Timestamp now, double keep_s) const {
  // A thing without a class is nothing but its points; a tentative track nobody has been shown.
  if (!is_known() && points == 0) return true;
  if (is_known() && evidence_ < 0) return true;
  return seconds_between(now, seen) > (is_known() && id != kNoObject ? keep_s : kTentative_s);
}

ObjectMotion Track::body() const {
  constexpr double kUnknown = 1e6;
  if (filter_.has_begun()) return filter_.motion();
  return {place.centre_odom, Vec3::Zero(), kUnknown * Mat6::Identity()};
}

TrackedObject Track::in_world(const SE3& T_world_odom, Timestamp now) const {
  const Vec3 min_odom = place.centre_odom + low_m, max_odom = place.centre_odom + high_m;
  const Vec3 middle = T_world_odom * (0.5 * (min_odom + max_odom));
  const Vec3 half = T_world_odom.R().cwiseAbs() * (0.5 * (max_odom - min_odom));
  return {.id = id,
          .class_id = class_id,
          .age_frames = age_frames,
          .missing_frames = missing_frames,
          .resting = resting,
          .faded = seconds_between(now, seen) > kFade_s,
          .points = points,
          .box_px = box_px,
          .centre_world = T_world_odom * place.centre_odom,
          .velocity_world_mps = T_world_odom.R() * velocity_odom_mps,
          .body_world = body().seen_from(T_world_odom),
          .min_world = middle - half,
          .max_world = middle + half};
}

TrackPlace Track::carried(const TrackPlace& before, const ObjectFrame& from, const ObjectFrame& to,
                          const PointIndices& on_it, const Camera& camera) const {
  TrackPlace result = before;
  const std::vector<Vec3> moved = displacements(on_it, from, to);
  result.centre_odom += moved.size() >= kMinTrackPoints
                            ? axis_quantile(moved, 0.5)
                            : Vec3(to.seconds_since(from.in.stamp) * velocity_odom_mps);
  const auto box = box_along_flow(before.box, from, to, on_it);
  result.box = box ? *box
                   : box_along_motion(before.box, from.in.T_camera_odom * before.centre_odom,
                                      to.in.T_camera_odom * result.centre_odom, camera);
  return result;
}

void Track::see(const InstanceView& instance, const ObjectFrame& frame, const GreyImage& ids,
                bool covered, TrackPlace& place_then) {
  class_id = instance.class_id;  // an unknown mover that the network now knows
  missing_frames = 0;
  seen = frame.in.stamp;
  evidence_ += instance.score;
  if (is_confirmed() && instance.box.area() < kPartOfBox * place_then.box.area()) {
    // The network found a part of it. Where depth shows the rest, it is where it was going.
    const SurfaceShare bare = surface_at(frame, place_then, &ids);
    if (bare.cells > 0 && bare.there >= kStillThere * bare.cells) return;
  }
  if (is_confirmed() && is_too_near(frame, place_then)) return;
  if (!covered) appearance.blend(instance.appearance, kAppearanceShare);
  place_then.box = instance.box;
  if (!instance.has_depth) return;
  // What sticks out to one side is not the middle: the whole is where what is seen fits into it.
  const Vec3 expected = place_then.centre_odom;
  const bool is_hidden = covered && evidence_ > kMaskEvidence;
  place_then.centre_odom = instance.centre_odom;
  if (is_hidden) {
    place_then.centre_odom = expected.cwiseMax(instance.max_odom - whole_high_m)
                                 .cwiseMin(instance.min_odom - whole_low_m);
  }
  is_new_ = true;
  low_m = instance.min_odom - place_then.centre_odom;
  high_m = instance.max_odom - place_then.centre_odom;
  if (!is_hidden) remember_whole(low_m, high_m);
}

/// Soon as large as it is seen, later as small: something that is no track may hide a part.
void Track::remember_whole(const Vec3& low, const Vec3& high) {
  if (whole_low_m == whole_high_m) whole_low_m = low, whole_high_m = high;
  for (int axis = 0; axis < 3; ++axis) {
    double& l = whole_low_m[axis];
    double& h = whole_high_m[axis];
    l += (low[axis] < l ? kGrows : kShrinks) * (low[axis] - l);
    h += (high[axis] > h ? kGrows : kShrinks) * (high[axis] - h);
  }
}

void Track::overlook(const ObjectFrame& frame, const TrackPlace& place_then, const GreyImage& ids) {
  if (!is_known()) return;
  const SurfaceShare bare = surface_at(frame, place_then, &ids);
  if (bare.cells > 0 && bare.there >= kPresentShare * bare.cells) evidence_ -= kOverlooked;
}

void Track::see_motion(Timestamp now) {
  missing_frames = 0;
  seen = now;
}

void Track::update(const ObjectFrame& now, const ObjectFrame* before, const PointIndices& on_it,
                   Timestamp masks_seen, const Camera& camera, TrackPlace& place_now) {
  points = static_cast<int>(on_it.size());
  if (!is_known()) measure(now, on_it, place_now);
  place = place_now;
  update_rest(now, on_it);
  update_velocity(now, before, on_it);
  update_motion(now, before, std::exchange(is_new_, false));
  update_box(now, masks_seen, camera);
}

/// What no mask shows is where its points are.
void Track::measure(const ObjectFrame& now, const PointIndices& on_it, TrackPlace& place_now) {
  if (missing_frames == 0) ++evidence_;
  constexpr float kInf = std::numeric_limits<float>::infinity();
  PixelBox box{kInf, kInf, -kInf, -kInf};
  std::vector<Vec3> where;
  for (const std::uint32_t i : on_it) {
    const ObjectPoint& point = now.in.points[i];
    const float u = point.uv_px.x(), v = point.uv_px.y();
    box = box | PixelBox{u, v, u, v};
    if (point.depth_m > 0 && point.p_odom.allFinite()) where.push_back(point.p_odom);
  }
  if (where.size() < kMinTrackPoints) return;
  place_now = {box, axis_quantile(where, 0.5)};
  is_new_ = true;
  if (!first_centre_odom_) first_centre_odom_ = place_now.centre_odom;
  low_m = axis_quantile(where, 0.05) - place_now.centre_odom;
  high_m = axis_quantile(where, 0.95) - place_now.centre_odom;
}

/// At rest only after a while of hardly any movement; one frame of it ends the rest.
void Track::update_rest(const ObjectFrame& now, const PointIndices& on_it) {
  std::size_t moving = 0, judged = 0;
  for (const std::uint32_t i : on_it) {
    moving += now.in.points[i].moves ? 1 : 0;
    judged += now.in.points[i].moves || now.in.points[i].stands ? 1 : 0;
  }
  resting = false;
  if (judged < kMinTrackPoints) {
    judged_frames_ = 0;
    return;
  }
  const double share = static_cast<double>(moving) / static_cast<double>(judged);
  moving_share_ += (share - moving_share_) / std::min(++judged_frames_, kRestFrames);
  resting = judged_frames_ >= kRestFrames && std::max(share, moving_share_) <= kRestMovingShare;
}

/// From how far the followed points came.
void Track::update_velocity(const ObjectFrame& now, const ObjectFrame* before,
                            const PointIndices& on_it) {
  const double dt_s = before ? now.seconds_since(before->in.stamp) : 0;
  if (dt_s > 0) {
    const std::vector<Vec3> moved = displacements(on_it, *before, now);
    if (moved.size() >= kMinTrackPoints) {
      moves_.push_back({dt_s, axis_quantile(moved, 0.5)});
      way_m_ += moves_.back().moved_m;
      path_m_ += moves_.back().moved_m.norm();
    }
  }
  Move sum;
  for (const Move& move : moves_) sum.dt_s += move.dt_s, sum.moved_m += move.moved_m;
  while (!moves_.empty() && sum.dt_s - moves_.front().dt_s >= kVelocityWindow_s) {
    sum.dt_s -= moves_.front().dt_s;
    sum.moved_m -= moves_.front().moved_m;
    moves_.pop_front();
  }
  if (sum.dt_s > 0) velocity_odom_mps = sum.moved_m / sum.dt_s;
  if (now.seconds_since(seen) <= kShowMissed_s) return;
  velocity_odom_mps.setZero();  // out of sight it may have turned or stopped
  moves_.clear();
}

void Track::update_motion(const ObjectFrame& now, const ObjectFrame* before, bool is_measured) {
  if (before)
    filter_.predict(now.seconds_since(before->in.stamp), now.seconds_since(seen) > kShowMissed_s);
  if (!is_measured) return;
  const Vec3 camera_odom = now.in.T_camera_odom.inverse().t();
  const Vec3 towards = (place.centre_odom - camera_odom).normalized();
  const double behind_m = class_id == kPersonClass ? kHalfBody_m : 0;
  filter_.update(place.centre_odom + behind_m * towards);
  if (!moves_.empty()) filter_.update_velocity(velocity_odom_mps);
}

/// The box as far as it is in the image; none of what is out of sight.
void Track::update_box(const ObjectFrame& now, Timestamp masks_seen, const Camera& camera) {
  const PixelBox image{0, 0, static_cast<float>(camera.width()),
                       static_cast<float>(camera.height())};
  const PixelBox inside = place.box & image;
  const double missed_s = seconds_between(is_known() ? masks_seen : now.in.stamp, seen);
  const bool shown = inside.area() > kMinVisibleShare * place.box.area() &&
                     missed_s <= kShowMissed_s && is_present(now);
  box_px = shown ? inside : PixelBox{};
}

/// Whether there is surface at its depth in its box; else it is gone or hidden.
bool Track::is_present(const ObjectFrame& now) const {
  const SurfaceShare surface = surface_at(now, place, nullptr);
  return surface.there >= kPresentShare * surface.cells;
}

}  // namespace ygslam
