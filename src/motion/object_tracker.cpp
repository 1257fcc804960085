#include "motion/object_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/check.hpp"
#include "image/point_grid.hpp"
#include "motion/flow_field.hpp"

namespace ygslam {
namespace {

constexpr double kBoxShare = 0.05;      // of the points left out on either side of the box
constexpr double kInheritShare = 0.25;  // of an instance's points that must come from one object
constexpr double kMaxSpeedMps = 10;     // beyond, the points were not the same

float quantile(std::vector<float>& values, double share) {
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

/// Quantiles per axis. Not to be called without points.
Vec3 quantile(std::span<const Vec3> points, double share) {
  Vec3 result;
  std::vector<float> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < points.size(); ++i) values[i] = static_cast<float>(points[i][axis]);
    result[axis] = quantile(values, share);
  }
  return result;
}

std::vector<Vec3> positions(std::span<const ObjectPoint> points,
                            std::span<const std::uint32_t> members) {
  std::vector<Vec3> result;
  for (const std::uint32_t i : members)
    if (points[i].depth_m > 0 && points[i].p_world.allFinite()) result.push_back(points[i].p_world);
  return result;
}

/// Points that hang together in the image and in depth.
std::vector<std::vector<std::uint32_t>> group(std::span<const ObjectPoint> points,
                                              std::span<const std::uint32_t> members,
                                              double radius_px, double depth_ratio) {
  std::vector<Eigen::Vector2f> uv_px;
  for (const std::uint32_t i : members) uv_px.push_back(points[i].uv_px);
  PointGrid grid(radius_px);
  grid.build(uv_px);
  std::vector<std::uint8_t> seen(members.size(), 0);
  std::vector<std::vector<std::uint32_t>> groups;
  for (std::uint32_t start = 0; start < members.size(); ++start) {
    if (std::exchange(seen[start], 1)) continue;
    std::vector<std::uint32_t> reached{start};
    for (std::size_t next = 0; next < reached.size(); ++next) {
      const std::uint32_t a = reached[next];
      grid.near(uv_px[a], radius_px, [&](std::uint32_t b) {
        const bool near = (uv_px[a] - uv_px[b]).norm() <= radius_px;
        if (seen[b] || !near ||
            !FlowField::same_depth(points[members[a]].depth_m, points[members[b]].depth_m,
                                   depth_ratio))
          return;
        seen[b] = 1;
        reached.push_back(b);
      });
    }
    for (std::uint32_t& i : reached) i = members[i];
    groups.push_back(std::move(reached));
  }
  return groups;
}

}  // namespace

void ObjectTracker::clear() {
  tracks_.clear();
  track_of_.clear();
  before_.clear();
  stamp_.reset();
}

void ObjectTracker::step(Timestamp stamp, std::vector<ObjectPoint> points) {
  const double dt_s = stamp_ ? seconds_between(stamp, *stamp_) : 0;
  stamp_ = stamp;
  for (Track& track : tracks_) {
    ++track.seen.age_frames;
    ++track.seen.missing_frames;
    track.seen.points = 0;
    track.seen.centre_world += dt_s * track.seen.velocity_world_mps;
    track.seen.min_world += dt_s * track.seen.velocity_world_mps;
    track.seen.max_world += dt_s * track.seen.velocity_world_mps;
  }
  std::vector<std::int32_t> track_of = inherited(points);
  take_instances(points, track_of);
  take_unknown_movers(points, track_of);
  update_tracks(points, track_of, dt_s);
  track_of_ = std::move(track_of);
  before_ = std::move(points);
  forget_old_tracks();
}

/// Where the flow takes an object's points, unless a mask has shown them to lie beside it.
std::vector<std::int32_t> ObjectTracker::inherited(Points points) const {
  std::vector<std::int32_t> track_of(points.size(), -1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::int32_t k = points[i].previous;
    if (k < 0 || k >= std::ssize(track_of_) || track_of_[k] < 0) continue;
    const bool known = tracks_[track_of_[k]].seen.class_id != kUnknownClass;
    if (!(known && points[i].outside)) track_of[i] = track_of_[k];
  }
  return track_of;
}

void ObjectTracker::take_instances(Points points, std::vector<std::int32_t>& track_of) {
  std::map<std::uint64_t, Members> instances;
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (points[i].instance != 0) instances[points[i].instance].push_back(i);
  std::vector<Members> largest_first;
  for (auto& [key, members] : instances) largest_first.push_back(std::move(members));
  std::stable_sort(largest_first.begin(), largest_first.end(),
                   [](const Members& a, const Members& b) { return a.size() > b.size(); });
  for (const Members& members : largest_first) {
    if (std::ssize(members) < config_.min_mask_points) continue;
    const int class_id = points[members.front()].class_id;
    std::int32_t t = match_instance(points, members, class_id, track_of);
    if (t < 0) t = add_track(class_id);
    tracks_[t].seen.class_id = class_id;  // an unknown mover that the network now knows
    tracks_[t].seen.missing_frames = 0;
    for (const std::uint32_t i : members) track_of[i] = t;
  }
}

/// The object most of the points were; failing that, the nearest of the class that is missing.
std::int32_t ObjectTracker::match_instance(Points points, const Members& members, int class_id,
                                           std::span<const std::int32_t> track_of) const {
  const auto fits = [&](const Track& track) {
    return track.seen.missing_frames > 0 &&  // no instance of this mask has it yet
           (track.seen.class_id == class_id || track.seen.class_id == kUnknownClass);
  };
  std::vector<int> votes(tracks_.size(), 0);
  for (const std::uint32_t i : members)
    if (track_of[i] >= 0 && fits(tracks_[track_of[i]])) ++votes[track_of[i]];
  const auto best = std::max_element(votes.begin(), votes.end());
  if (best != votes.end() && *best > kInheritShare * static_cast<double>(members.size()))
    return static_cast<std::int32_t>(best - votes.begin());

  const std::vector<Vec3> where = positions(points, members);
  if (where.empty()) return -1;
  const Vec3 centre_world = quantile(where, 0.5);
  std::int32_t nearest = -1;
  double nearest_m = config_.gate_m;
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    const double m = (tracks_[t].seen.centre_world - centre_world).norm();
    if (tracks_[t].seen.class_id != class_id || !fits(tracks_[t]) || m >= nearest_m) continue;
    nearest_m = m;
    nearest = static_cast<std::int32_t>(t);
  }
  return nearest;
}

std::int32_t ObjectTracker::add_track(int class_id) {
  Track track;
  track.seen.id = ObjectId{next_id_++};
  track.seen.class_id = class_id;
  tracks_.push_back(std::move(track));
  return static_cast<std::int32_t>(tracks_.size()) - 1;
}

/// What moves, has no mask and was on no object yet: points that hang together are a new one.
void ObjectTracker::take_unknown_movers(Points points, std::vector<std::int32_t>& track_of) {
  Members movers;
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (points[i].moves && points[i].instance == 0) movers.push_back(i);
  for (const Members& members :
       group(points, movers, config_.group_radius_px, config_.group_depth_ratio)) {
    std::map<std::int32_t, int> votes;
    for (const std::uint32_t i : members)
      if (track_of[i] >= 0) ++votes[track_of[i]];
    std::int32_t t = -1;
    for (const auto& [track, count] : votes)
      if (t < 0 || count > votes[t]) t = track;
    if (t < 0 && std::ssize(members) < config_.min_mover_points) continue;
    if (t < 0) t = add_track(kUnknownClass);
    tracks_[t].seen.missing_frames = 0;
    // What was taken for several things and turns out to hang together is one.
    for (const std::uint32_t i : members)
      if (track_of[i] < 0 || tracks_[track_of[i]].seen.class_id == kUnknownClass) track_of[i] = t;
  }
}

void ObjectTracker::update_tracks(Points points, std::span<const std::int32_t> track_of,
                                  double dt_s) {
  std::vector<Members> members(tracks_.size());
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (track_of[i] >= 0) members[track_of[i]].push_back(i);
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    if (tracks_[t].seen.missing_frames == 0) ++tracks_[t].confirmations;
    update_rest(points, members[t], tracks_[t]);
    update_motion(points, members[t], dt_s, tracks_[t]);
  }
}

/// At rest only after a while of hardly any movement; one frame of it ends the rest.
void ObjectTracker::update_rest(Points points, const Members& members, Track& track) const {
  int moving = 0;
  int judged = 0;
  for (const std::uint32_t i : members) {
    moving += points[i].moves ? 1 : 0;
    judged += points[i].moves || points[i].stands ? 1 : 0;
  }
  if (judged < config_.min_mask_points) {
    track.seen.resting = false;
    track.judged_frames = 0;
    return;
  }
  const double share = static_cast<double>(moving) / judged;
  const int window = std::min(++track.judged_frames, config_.rest_frames);
  track.moving_share += (share - track.moving_share) / window;
  track.seen.resting = track.judged_frames >= config_.rest_frames &&
                       std::max(share, track.moving_share) <= config_.rest_moving_share;
}

/// Place and box from the points seen now, velocity from how far the followed ones came.
void ObjectTracker::update_motion(Points points, const Members& members, double dt_s,
                                  Track& track) const {
  TrackedObject& seen = track.seen;
  seen.points = static_cast<int>(members.size());
  seen.box_px = {};
  if (std::ssize(members) >= config_.min_mask_points) {
    std::vector<float> u, v;
    for (const std::uint32_t i : members) {
      u.push_back(points[i].uv_px.x());
      v.push_back(points[i].uv_px.y());
    }
    seen.box_px = {quantile(u, 0), quantile(v, 0), quantile(u, 1), quantile(v, 1)};
  }
  const std::vector<Vec3> where = positions(points, members);
  if (std::ssize(where) >= config_.min_mask_points) {
    seen.centre_world = quantile(where, 0.5);
    seen.min_world = quantile(where, kBoxShare);
    seen.max_world = quantile(where, 1 - kBoxShare);
  }
  if (!(dt_s > 0)) return;
  std::vector<Vec3> moved;
  for (const std::uint32_t i : members) {
    const std::int32_t k = points[i].previous;
    if (k < 0 || k >= std::ssize(before_) || points[i].depth_m <= 0 || before_[k].depth_m <= 0)
      continue;
    const Vec3 d = points[i].p_world - before_[k].p_world;
    if (d.norm() <= kMaxSpeedMps * dt_s) moved.push_back(d);
  }
  if (std::ssize(moved) >= config_.min_mask_points)
    track.moves.push_back({dt_s, quantile(moved, 0.5)});
  Move sum;
  for (const Move& move : track.moves) sum.dt_s += move.dt_s, sum.moved_m += move.moved_m;
  while (!track.moves.empty() && sum.dt_s - track.moves.front().dt_s >= config_.velocity_window_s) {
    sum.dt_s -= track.moves.front().dt_s;
    sum.moved_m -= track.moves.front().moved_m;
    track.moves.pop_front();
  }
  if (sum.dt_s > 0) seen.velocity_world_mps = sum.moved_m / sum.dt_s;
}

void ObjectTracker::forget_old_tracks() {
  std::vector<std::int32_t> renamed(tracks_.size(), -1);
  std::size_t kept = 0;
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    const TrackedObject& seen = tracks_[t].seen;
    // A thing without a class is nothing but its points.
    const bool gone = seen.class_id == kUnknownClass && seen.points == 0;
    const int keep_frames = std::min(config_.keep_frames, 2 * tracks_[t].confirmations);
    if (gone || seen.missing_frames > keep_frames) continue;
    renamed[t] = static_cast<std::int32_t>(kept);
    if (kept != t) tracks_[kept] = std::move(tracks_[t]);
    ++kept;
  }
  tracks_.resize(kept);
  for (std::int32_t& t : track_of_)
    if (t >= 0) t = renamed[t];
}

std::vector<TrackedObject> ObjectTracker::objects() const {
  std::vector<TrackedObject> result;
  for (const Track& track : tracks_)
    if (track.confirmations >= config_.confirm_frames) result.push_back(track.seen);
  return result;
}

const TrackedObject* ObjectTracker::object_at(std::size_t point) const {
  if (point >= track_of_.size() || track_of_[point] < 0) return nullptr;
  return &tracks_[track_of_[point]].seen;
}

}  // namespace ygslam
