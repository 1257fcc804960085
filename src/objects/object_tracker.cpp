#include "objects/object_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/assignment.hpp"
#include "core/check.hpp"
#include "objects/mover_groups.hpp"
#include "objects/quantile.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kViews = 30;     // a mask of an older frame comes too late
constexpr std::size_t kMinPoints = 4;  // that say how a thing moves
constexpr double kMaxSpeedMps = 5;     // beyond, the points were not the same
constexpr double kVelocityWindow_s = 0.5;

// Who is who in a mask.
constexpr double kMinAffinity = 0.05;  // of overlap and common points, 0 to 1
constexpr double kFar_m = 0.6;         // depths that differ so much are not alike at all
constexpr double kMinScore = 1.5;      // sum of affinity, likeness of colours and of depths
constexpr double kReach_m = 0.4;       // an instance farther from where an object should be ...
constexpr double kReachMps = 1.2;      // ... growing with the time it was out of sight ...
constexpr double kMaxReach_m = 4;      // ... is another one
constexpr double kAway_s = 1;          // who came back is not taken for new after so long
constexpr double kMinLikeness = 0.7;   // of the colours, to know an object again
constexpr float kMinNewScore = 0.5F;   // a weaker instance only continues what is known
constexpr double kLookShare = 0.1;     // of a new look in the remembered one ...
constexpr double kCoveredShare = 0.1;  // ... unless another covers so much of its box

// When an object is shown.
constexpr double kMaskEvidence = 1.5;     // sum of the scores of its masks
constexpr double kOnKnownShare = 0.2;     // of the points of a mover: it is part of a known thing
constexpr double kMoverEvidence = 10;     // frames of motion
constexpr double kMoverWay_m = 0.05;      // that a mover has come ...
constexpr double kMoverStraight = 0.5;    // ... of its path: noise goes to and fro
constexpr double kShowMissed_s = 0.5;     // masks may overlook it for so long
constexpr double kPresentDepth_m = 0.4;   // surface so near to its depth ...
constexpr double kPresentShare = 0.15;    // ... fills so much of its box while it is in sight
constexpr double kMinVisibleShare = 0.1;  // of its box in the image

constexpr double kRestMovingShare = 0.1;  // fewer of its judged points move: it rests ...
constexpr int kRestFrames = 15;           // ... once that has held for so long

PixelBox shifted(const PixelBox& box, const Vec2& by_px, double scale) {
  const double cx = (box.x0 + box.x1) / 2 + by_px.x();
  const double cy = (box.y0 + box.y1) / 2 + by_px.y();
  const double w = scale * box.width() / 2, h = scale * box.height() / 2;
  return {static_cast<float>(cx - w), static_cast<float>(cy - h), static_cast<float>(cx + w),
          static_cast<float>(cy + h)};
}

/// How far from where it should be an object may be found after so long out of sight.
double reach_m(double away_s) {
  return std::min(kMaxReach_m, kReach_m + std::max(0.0, away_s) * kReachMps);
}

}  // namespace

void ObjectTracker::clear() {
  views_.clear();
  tracks_.clear();
  stamp_.reset();
  newest_mask_ = kNoFrame;
}

std::vector<TrackedObject> ObjectTracker::step(ObjectInput input) {
  const double dt_s = stamp_ ? std::max(0.0, seconds_between(input.stamp, *stamp_)) : 0;
  stamp_ = input.stamp;
  for (auto& [key, track] : tracks_) ++track.object.age_frames, ++track.object.missing_frames;
  View now{std::move(input), {}, {}};
  now.track_of.assign(now.in.points.size(), -1);
  if (views_.empty()) {
    for (auto& [key, track] : tracks_) now.place[key] = track.place;
  } else {
    carry(views_.back(), now);
  }
  views_.push_back(std::move(now));
  if (views_.size() > kViews) views_.pop_front();
  for (const SegmentationPtr& masks : views_.back().in.masks)
    if (masks) take_mask(*masks);
  take_movers(views_.back());
  update_tracks(views_.back(), dt_s);
  forget(views_.back().in.stamp);
  std::vector<TrackedObject> result;
  for (const auto& [key, track] : tracks_)
    if (track.object.id != kNoObject) result.push_back(track.object);
  std::sort(result.begin(), result.end(),
            [](const TrackedObject& a, const TrackedObject& b) { return a.id < b.id; });
  return result;
}

std::vector<std::uint8_t> ObjectTracker::resting_points() const {
  if (views_.empty()) return {};
  std::vector<std::uint8_t> rests;
  for (const int key : views_.back().track_of)
    rests.push_back(key >= 0 && tracks_.at(key).object.resting ? 1 : 0);
  return rests;
}

/// Takes points, boxes and places from one frame to the next. Also when done again, after a mask
/// has told more about the earlier frame: what a point without a link was found to be then stays.
void ObjectTracker::carry(const View& from, View& to) const {
  std::map<int, Members> members;
  for (std::uint32_t i = 0; i < to.track_of.size(); ++i) {
    int& key = to.track_of[i];
    const std::int32_t k = to.in.points[i].previous;
    if (k < 0 || k >= std::ssize(from.track_of)) continue;
    const int before = from.track_of[k];
    if (before >= 0) {
      key = before;
      members[key].push_back(i);
    } else if (key >= 0 && is_known(key)) {
      key = -1;
    }
  }
  for (const auto& [key, place] : from.place)
    to.place[key] = carried(key, place, from, to, members[key]);
}

/// Along the flow of the thing's points; without enough of them along its velocity.
ObjectTracker::Place ObjectTracker::carried(int key, const Place& place, const View& from,
                                            const View& to,
                                            std::span<const std::uint32_t> members) const {
  std::vector<double> du, dv, scale;
  std::vector<Vec3> moved;
  const double dt_s = seconds_between(to.in.stamp, from.in.stamp);
  for (const std::uint32_t i : members) {
    const ObjectPoint& b = to.in.points[i];
    const ObjectPoint& a = from.in.points[b.previous];
    du.push_back(b.uv_px.x() - a.uv_px.x());
    dv.push_back(b.uv_px.y() - a.uv_px.y());
    if (!(a.depth_m > 0 && b.depth_m > 0) || !a.p_odom.allFinite() || !b.p_odom.allFinite())
      continue;
    scale.push_back(a.depth_m / b.depth_m);
    if ((b.p_odom - a.p_odom).norm() <= kMaxSpeedMps * dt_s) moved.push_back(b.p_odom - a.p_odom);
  }
  Place result = place;
  result.centre_odom += moved.size() >= kMinPoints
                            ? axis_quantile(moved, 0.5)
                            : Vec3(dt_s * tracks_.at(key).object.velocity_world_mps);
  if (scale.size() >= kMinPoints) {
    result.box = shifted(place.box, {quantile(du, 0.5), quantile(dv, 0.5)},
                         std::clamp(quantile(scale, 0.5), 0.9, 1.1));
    return result;
  }
  const Vec3 a = from.in.T_camera_odom * place.centre_odom;
  const Vec3 b = to.in.T_camera_odom * result.centre_odom;
  constexpr double kNearest_m = 0.3;
  if (a.z() < kNearest_m || b.z() < kNearest_m) {
    result.box = {};
  } else if (!place.box.empty()) {
    result.box = shifted(place.box,
                         camera_.distort(camera_.project(b)) - camera_.distort(camera_.project(a)),
                         std::clamp(a.z() / b.z(), 0.9, 1.1));
  }
  return result;
}

void ObjectTracker::take_mask(const Segmentation& masks) {
  const auto at = std::find_if(views_.begin(), views_.end(),
                               [&](const View& view) { return view.in.frame == masks.frame; });
  if (at == views_.end() || masks.ids.empty()) return;
  if (newest_mask_ != kNoFrame && masks.frame <= newest_mask_) return;
  newest_mask_ = masks.frame;
  View& view = *at;
  mask_stamp_ = view.in.stamp;
  const auto seen = view_instances(masks, view.in.thumbnail, camera_,
                                   view.in.T_camera_odom.inverse(), config_.movable_classes);
  std::vector<int> thing_of(256, -1);  // instance by value of ids
  for (std::size_t s = 0; s < seen.size(); ++s)
    for (const std::uint8_t id : seen[s].ids) thing_of[id] = static_cast<int>(s);
  std::vector<int> thing(view.in.points.size(), -1);
  std::vector<Members> members(seen.size());
  for (std::uint32_t i = 0; i < thing.size(); ++i) {
    const auto& uv = view.in.points[i].uv_px;
    if (!uv.allFinite() || uv.cwiseAbs().maxCoeff() > 1e5F) continue;
    const int u = static_cast<int>(std::lround(uv.x())), v = static_cast<int>(std::lround(uv.y()));
    if (masks.ids.contains(u, v)) thing[i] = thing_of[masks.ids.at(u, v)];
    if (thing[i] >= 0) members[thing[i]].push_back(i);
  }
  std::vector<int> key_of = match(seen, members, view);
  for (std::size_t s = 0; s < seen.size(); ++s) {
    int& key = key_of[s];
    if (key < 0 && seen[s].score >= kMinNewScore) {
      key = add_track(seen[s].class_id, view.in.stamp);
      tracks_.at(key).look = seen[s].look;
    }
    if (key < 0) continue;
    update(seen[s], view, view.place[key], tracks_.at(key));
    for (int& other : view.track_of)
      if (other == key) other = -1;
    for (const std::uint32_t i : members[s]) view.track_of[i] = key;
  }
  for (auto next = at + 1; next != views_.end(); ++next) carry(*(next - 1), *next);
}

/// Per instance the key of the track that it shows, -1 = none.
std::vector<int> ObjectTracker::match(std::span<const InstanceView> seen,
                                      const std::vector<Members>& members, const View& view) {
  std::vector<int> key_of(seen.size(), -1);
  match_near(seen, members, view, key_of);
  const std::vector<int> near = key_of;
  match_lost(seen, view, key_of);
  for (std::size_t s = 0; s < near.size(); ++s)  // who seemed to be new has come back
    if (near[s] >= 0 && near[s] != key_of[s]) tracks_.erase(near[s]);
  drop_erased();
  return key_of;
}

/// By overlap in the image and by common points, where depth and place do not speak against it.
void ObjectTracker::match_near(std::span<const InstanceView> seen,
                               const std::vector<Members>& members, const View& view,
                               std::vector<int>& key_of) const {
  std::vector<int> keys;
  for (const auto& [key, place] : view.place) keys.push_back(key);
  Eigen::MatrixXd cost = Eigen::MatrixXd::Zero(std::ssize(seen), std::ssize(keys));
  for (std::size_t s = 0; s < seen.size(); ++s) {
    std::map<int, int> votes;
    for (const std::uint32_t i : members[s]) ++votes[view.track_of[i]];
    for (std::size_t t = 0; t < keys.size(); ++t) {
      const Track& track = tracks_.at(keys[t]);
      if (track.object.class_id != seen[s].class_id && is_known(keys[t])) continue;
      const Place& place = view.place.at(keys[t]);
      if (way(seen[s], place, track, view.in.stamp) > 1) continue;
      // As who comes in or out of a corner grows or shrinks, the smaller box counts too.
      const double both = (seen[s].box & place.box).area();
      const double inside = both > 0 ? both / std::min(seen[s].box.area(), place.box.area()) : 0;
      double affinity = (iou(seen[s].box, place.box) + inside) / 2;
      if (members[s].size() >= kMinPoints)
        affinity = (affinity + votes[keys[t]] / static_cast<double>(members[s].size())) / 2;
      const double depth_m = (view.in.T_camera_odom * place.centre_odom).z();
      const double nearness =
          seen[s].has_depth ? std::max(0.0, 1 - std::abs(seen[s].depth_m - depth_m) / kFar_m) : 0.5;
      const double score = affinity + track.look.likeness(seen[s].look) + nearness;
      if (affinity < kMinAffinity || score < kMinScore) continue;
      cost(static_cast<Eigen::Index>(s), static_cast<Eigen::Index>(t)) = -score;
    }
  }
  const std::vector<int> column_of = assign(cost);
  for (std::size_t s = 0; s < seen.size(); ++s)
    if (column_of[s] >= 0 && cost(static_cast<Eigen::Index>(s), column_of[s]) < 0)
      key_of[s] = keys[column_of[s]];
}

/// How far it is from where the track should be, as a share of how far it may be. Between their
/// boxes, as centres jump where something hides a part.
double ObjectTracker::way(const InstanceView& seen, const Place& place, const Track& track,
                          Timestamp stamp) const {
  if (!seen.has_depth) return 0;
  const Vec3 gap = (seen.min_odom - place.centre_odom - track.high_m)
                       .cwiseMax(place.centre_odom + track.low_m - seen.max_odom)
                       .cwiseMax(0.0);
  return gap.norm() / reach_m(seconds_between(stamp, track.seen));
}

/// Those out of sight, by place and by what they wear.
void ObjectTracker::match_lost(std::span<const InstanceView> seen, const View& view,
                               std::vector<int>& key_of) const {
  std::vector<int> keys;
  for (const auto& [key, track] : tracks_)
    if (is_known(key) && std::find(key_of.begin(), key_of.end(), key) == key_of.end())
      keys.push_back(key);
  Eigen::MatrixXd cost = Eigen::MatrixXd::Zero(std::ssize(seen), std::ssize(keys));
  for (std::size_t s = 0; s < seen.size(); ++s) {
    if (key_of[s] >= 0 && !is_young(tracks_.at(key_of[s]))) continue;
    for (std::size_t t = 0; t < keys.size(); ++t) {
      const Track& track = tracks_.at(keys[t]);
      const double away_s = seconds_between(view.in.stamp, track.seen);
      if (track.object.class_id != seen[s].class_id || is_young(track)) continue;
      if (key_of[s] >= 0 && away_s < kAway_s) continue;
      const auto at = view.place.find(keys[t]);
      const double share =
          way(seen[s], at != view.place.end() ? at->second : track.place, track, view.in.stamp);
      const double likeness = track.look.likeness(seen[s].look);
      if (share > 1 || likeness < kMinLikeness) continue;
      cost(static_cast<Eigen::Index>(s), static_cast<Eigen::Index>(t)) = share - 1 - likeness;
    }
  }
  const std::vector<int> column_of = assign(cost);
  for (std::size_t s = 0; s < seen.size(); ++s)
    if (column_of[s] >= 0 && cost(static_cast<Eigen::Index>(s), column_of[s]) < 0)
      key_of[s] = keys[column_of[s]];
}

void ObjectTracker::update(const InstanceView& seen, const View& view, Place& place,
                           Track& track) const {
  track.object.class_id = seen.class_id;  // an unknown mover that the network now knows
  track.object.missing_frames = 0;
  track.seen = view.in.stamp;
  track.evidence += seen.score;
  const bool alone = std::all_of(view.place.begin(), view.place.end(), [&](const auto& entry) {
    const PixelBox& other = entry.second.box;
    return &entry.second == &place || (other & seen.box).area() < kCoveredShare * seen.box.area();
  });
  if (alone) track.look.blend(seen.look, kLookShare);
  place.box = seen.box;
  if (!seen.has_depth) return;
  place.centre_odom = seen.centre_odom;
  track.low_m = seen.min_odom - seen.centre_odom;
  track.high_m = seen.max_odom - seen.centre_odom;
}
int ObjectTracker::add_track(int class_id, Timestamp stamp) {
  Track& track = tracks_[next_key_];
  track.object.class_id = class_id;
  track.seen = stamp;
  return next_key_++;
}

/// Moving points on a person, at its depth, belong to it: an arm beside the mask, a bag, a kettle.
bool ObjectTracker::is_on_known(const ObjectPoint& point, const View& now) const {
  constexpr float kMargin = 0.15F;
  constexpr double kDepth_m = 0.6;
  for (const auto& [key, place] : now.place) {
    if (!is_known(key) || place.box.empty()) continue;
    const float du = kMargin * place.box.width() + 20, dv = kMargin * place.box.height();
    const PixelBox near{place.box.x0 - du, place.box.y0 - dv, place.box.x1 + du, place.box.y1 + dv};
    const bool inside = point.uv_px.x() >= near.x0 && point.uv_px.x() <= near.x1 &&
                        point.uv_px.y() >= near.y0 && point.uv_px.y() <= near.y1;
    const double depth_m = (now.in.T_camera_odom * place.centre_odom).z();
    if (inside && (!(point.depth_m > 0) || std::abs(point.depth_m - depth_m) < kDepth_m))
      return true;
  }
  return false;
}

/// What moves and is on nothing known: points that hang together are a thing.
void ObjectTracker::take_movers(View& now) {
  Members movers;
  std::vector<char> on_known(now.in.points.size(), 0);
  for (std::uint32_t i = 0; i < now.in.points.size(); ++i) {
    const ObjectPoint& point = now.in.points[i];
    const int key = now.track_of[i];
    if ((key >= 0 && is_known(key)) || !point.uv_px.allFinite()) continue;
    if (!point.moves && key < 0) continue;
    on_known[i] = is_on_known(point, now) ? 1 : 0;
    movers.push_back(i);
  }
  for (const Members& members : hang_together(now.in.points, movers)) {
    const auto inside = std::count_if(members.begin(), members.end(),
                                      [&](std::uint32_t i) { return on_known[i] != 0; });
    if (static_cast<double>(inside) > kOnKnownShare * static_cast<double>(members.size())) {
      for (const std::uint32_t i : members) now.track_of[i] = -1;
      continue;
    }
    if (std::none_of(members.begin(), members.end(),
                     [&](std::uint32_t i) { return now.in.points[i].moves; }))
      continue;
    std::map<int, int> votes;
    for (const std::uint32_t i : members)
      if (now.track_of[i] >= 0) ++votes[now.track_of[i]];
    int best = -1;
    for (const auto& [key, count] : votes)
      if (best < 0 || count > votes[best]) best = key;
    if (best < 0 && std::ssize(members) < kMinMoverPoints) continue;
    if (best < 0) best = add_track(kUnknownClass, now.in.stamp);
    Track& track = tracks_.at(best);
    track.object.missing_frames = 0;
    track.seen = now.in.stamp;
    for (const std::uint32_t i : members) now.track_of[i] = best;
  }
}

void ObjectTracker::update_tracks(View& now, double dt_s) {
  std::map<int, Members> members;
  for (std::uint32_t i = 0; i < now.track_of.size(); ++i)
    if (now.track_of[i] >= 0) members[now.track_of[i]].push_back(i);
  for (auto& [key, track] : tracks_) {
    TrackedObject& object = track.object;
    const Members& points = members[key];
    object.points = static_cast<int>(points.size());
    if (!is_known(key)) {
      if (object.missing_frames == 0) ++track.evidence;
      std::vector<double> u, v;
      std::vector<Vec3> where;
      for (const std::uint32_t i : points) {
        const ObjectPoint& point = now.in.points[i];
        u.push_back(point.uv_px.x());
        v.push_back(point.uv_px.y());
        if (point.depth_m > 0 && point.p_odom.allFinite()) where.push_back(point.p_odom);
      }
      if (u.size() >= kMinPoints && where.size() >= kMinPoints) {
        Place& place = now.place[key];
        place.box = {static_cast<float>(quantile(u, 0)), static_cast<float>(quantile(v, 0)),
                     static_cast<float>(quantile(u, 1)), static_cast<float>(quantile(v, 1))};
        place.centre_odom = axis_quantile(where, 0.5);
        track.low_m = axis_quantile(where, 0.05) - place.centre_odom;
        track.high_m = axis_quantile(where, 0.95) - place.centre_odom;
      }
    }
    track.place = now.place[key];
    update_rest(now, points, track);
    update_motion(now, points, dt_s, track);
    object.centre_world = track.place.centre_odom;
    object.min_world = object.centre_world + track.low_m;
    object.max_world = object.centre_world + track.high_m;
    if (object.id == kNoObject && is_confirmed(track)) object.id = ObjectId{next_id_++};
    set_box(now, track);
  }
}

/// At rest only after a while of hardly any movement; one frame of it ends the rest.
void ObjectTracker::update_rest(const View& now, const Members& members, Track& track) const {
  std::size_t moving = 0, judged = 0;
  for (const std::uint32_t i : members) {
    moving += now.in.points[i].moves ? 1 : 0;
    judged += now.in.points[i].moves || now.in.points[i].stands ? 1 : 0;
  }
  if (judged < kMinPoints) {
    track.object.resting = false;
    track.judged_frames = 0;
    return;
  }
  const double share = static_cast<double>(moving) / static_cast<double>(judged);
  track.moving_share += (share - track.moving_share) / std::min(++track.judged_frames, kRestFrames);
  track.object.resting =
      track.judged_frames >= kRestFrames && std::max(share, track.moving_share) <= kRestMovingShare;
}

/// Velocity from how far the followed points came.
void ObjectTracker::update_motion(const View& now, const Members& members, double dt_s,
                                  Track& track) const {
  if (!(dt_s > 0)) return;
  std::vector<Vec3> moved;
  if (views_.size() >= 2) {
    const auto& before = views_[views_.size() - 2].in.points;
    for (const std::uint32_t i : members) {
      const ObjectPoint& point = now.in.points[i];
      const std::int32_t k = point.previous;
      if (k < 0 || k >= std::ssize(before) || !(point.depth_m > 0) || !(before[k].depth_m > 0))
        continue;
      const Vec3 d = point.p_odom - before[k].p_odom;
      if (d.norm() <= kMaxSpeedMps * dt_s) moved.push_back(d);
    }
  }
  if (moved.size() >= kMinPoints) {
    track.moves.push_back({dt_s, axis_quantile(moved, 0.5)});
    track.way_m += track.moves.back().moved_m;
    track.path_m += track.moves.back().moved_m.norm();
  }
  Move sum;
  for (const Move& move : track.moves) sum.dt_s += move.dt_s, sum.moved_m += move.moved_m;
  while (!track.moves.empty() && sum.dt_s - track.moves.front().dt_s >= kVelocityWindow_s) {
    sum.dt_s -= track.moves.front().dt_s;
    sum.moved_m -= track.moves.front().moved_m;
    track.moves.pop_front();
  }
  if (sum.dt_s > 0) track.object.velocity_world_mps = sum.moved_m / sum.dt_s;
  // Out of sight it may have turned or stopped.
  if (seconds_between(now.in.stamp, track.seen) > kShowMissed_s) {
    track.object.velocity_world_mps.setZero();
    track.moves.clear();
  }
}

bool ObjectTracker::is_confirmed(const Track& track) const {
  if (track.object.class_id != kUnknownClass) return track.evidence >= kMaskEvidence;
  const double way_m = track.way_m.norm();
  return track.evidence >= kMoverEvidence && way_m >= kMoverWay_m &&
         way_m >= kMoverStraight * track.path_m;
}

/// The box as far as it is in the image; none of what is out of sight.
void ObjectTracker::set_box(const View& now, Track& track) const {
  const PixelBox& box = track.place.box;
  const PixelBox image{0, 0, static_cast<float>(camera_.width()),
                       static_cast<float>(camera_.height())};
  const PixelBox inside = box & image;
  const double missed_s = seconds_between(
      track.object.class_id == kUnknownClass ? now.in.stamp : mask_stamp_, track.seen);
  const bool shown = inside.area() > kMinVisibleShare * box.area() && missed_s <= kShowMissed_s &&
                     is_present(now, track);
  track.object.box_px = shown ? inside : PixelBox{};
}

/// Whether there is surface at its depth in its box; else it is gone or hidden.
bool ObjectTracker::is_present(const View& now, const Track& track) const {
  const DepthImage& depth_m = now.in.thumbnail.depth_m;
  const double own_m = (now.in.T_camera_odom * track.place.centre_odom).z();
  const PixelBox& box = track.place.box;
  int there = 0, all = 0;
  for (int y = static_cast<int>(std::max(0.0F, box.y0)) / Thumbnail::kStep;
       y < depth_m.height() && static_cast<float>(y * Thumbnail::kStep) < box.y1; ++y) {
    for (int x = static_cast<int>(std::max(0.0F, box.x0)) / Thumbnail::kStep;
         x < depth_m.width() && static_cast<float>(x * Thumbnail::kStep) < box.x1; ++x) {
      if (!(depth_m.at(x, y) > 0)) continue;
      ++all;
      there += std::abs(depth_m.at(x, y) - own_m) <= kPresentDepth_m ? 1 : 0;
    }
  }
  return there >= kPresentShare * all;
}

void ObjectTracker::forget(Timestamp now) {
  std::erase_if(tracks_, [&](const auto& entry) {
    const Track& track = entry.second;
    const double away_s = seconds_between(now, track.seen);
    // A thing without a class is nothing but its points; what nobody has been shown is nobody's
    // loss.
    if (track.object.class_id == kUnknownClass) return track.object.points == 0 || away_s > 1;
    return away_s > (track.object.id == kNoObject ? 1 : config_.keep_s);
  });
  drop_erased();
}

void ObjectTracker::drop_erased() {
  for (View& view : views_) {
    std::erase_if(view.place, [&](const auto& entry) { return !tracks_.contains(entry.first); });
    for (int& key : view.track_of)
      if (key >= 0 && !tracks_.contains(key)) key = -1;
  }
}

}  // namespace ygslam
