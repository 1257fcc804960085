#include "objects/object_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "objects/instance_split.hpp"
#include "objects/mover_groups.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kFrames = 30;    // a mask of an older frame comes too late
constexpr float kMinNewScore = 0.5F;   // a weaker instance only continues what is known
constexpr float kCoveredShare = 0.1F;  // of an instance's box in another track's: it may be hidden
constexpr double kOnKnownShare = 0.2;  // of the points of a mover: it is part of a known thing

std::map<int, PointIndices> points_by_track(const ObjectFrame& frame) {
  std::map<int, PointIndices> result;
  for (std::uint32_t i = 0; i < frame.track_of.size(); ++i)
    if (frame.track_of[i] >= 0) result[frame.track_of[i]].push_back(i);
  return result;
}

/// Per instance the points inside its mask.
std::vector<PointIndices> points_by_instance(std::span<const InstanceView> instances,
                                             const GreyImage& ids, const ObjectFrame& frame) {
  std::vector<int> instance_of(256, -1);  // by value of ids
  for (std::size_t s = 0; s < instances.size(); ++s)
    for (const std::uint8_t id : instances[s].ids) instance_of[id] = static_cast<int>(s);
  std::vector<PointIndices> result(instances.size());
  for (std::uint32_t i = 0; i < frame.in.points.size(); ++i) {
    const auto& uv = frame.in.points[i].uv_px;
    if (!uv.allFinite() || uv.cwiseAbs().maxCoeff() > 1e5F) continue;
    const int u = static_cast<int>(std::lround(uv.x())), v = static_cast<int>(std::lround(uv.y()));
    const int s = ids.contains(u, v) ? instance_of[ids.at(u, v)] : -1;
    if (s >= 0) result[s].push_back(i);
  }
  return result;
}

}  // namespace

std::vector<TrackedObject> ObjectTracker::step(ObjectInput input) {
  add_frame(std::move(input));
  ObjectFrame& now = frames_.back();
  // Theirs is the memory of an image each: nobody asks for them again.
  for (const SegmentationPtr& masks : std::exchange(now.in.masks, {}))
    if (masks) take_mask(*masks);
  take_movers(now);
  update_tracks(now);
  forget(now.in.stamp);
  std::vector<TrackedObject> result;
  for (const auto& [key, track] : tracks_)
    if (track.id != kNoObject) result.push_back(track.in_world(now.in.T_world_odom, now.in.stamp));
  std::sort(result.begin(), result.end(),
            [](const TrackedObject& a, const TrackedObject& b) { return a.id < b.id; });
  return result;
}

std::vector<std::uint8_t> ObjectTracker::resting_points() const {
  std::vector<std::uint8_t> rests;
  if (frames_.empty()) return rests;
  for (const int key : frames_.back().track_of)
    rests.push_back(key >= 0 && tracks_.at(key).resting ? 1 : 0);
  return rests;
}

void ObjectTracker::add_frame(ObjectInput input) {
  ObjectFrame now{std::move(input), {}, {}};
  now.track_of.assign(now.in.points.size(), -1);
  for (auto& [key, track] : tracks_) {
    ++track.age_frames, ++track.missing_frames;
    if (frames_.empty()) now.place[key] = track.place;
  }
  if (!frames_.empty()) carry(frames_.back(), now);
  frames_.push_back(std::move(now));
  if (frames_.size() > kFrames) frames_.pop_front();
}

/// Takes points, boxes and places from one frame to the next. Also when done again, after a mask
/// has told more about the earlier frame: what a point without a link was found to be then stays.
void ObjectTracker::carry(const ObjectFrame& from, ObjectFrame& to) const {
  std::map<int, PointIndices> continued;
  for (std::uint32_t i = 0; i < to.track_of.size(); ++i) {
    int& key = to.track_of[i];
    const std::int32_t k = to.in.points[i].previous;
    if (k < 0 || k >= std::ssize(from.track_of)) continue;
    if (from.track_of[k] >= 0) {
      key = from.track_of[k];
      continued[key].push_back(i);
    } else if (key >= 0 && tracks_.at(key).is_known()) {
      key = -1;
    }
  }
  for (const auto& [key, place] : from.place)
    to.place[key] = tracks_.at(key).carried(place, from, to, continued[key], camera_);
}

void ObjectTracker::take_mask(const Segmentation& masks) {
  const auto frame = std::find_if(frames_.begin(), frames_.end(),
                                  [&](const ObjectFrame& f) { return f.in.frame == masks.frame; });
  if (frame == frames_.end() || masks.ids.empty()) return;
  if (newest_mask_ != kNoFrame && masks.frame <= newest_mask_) return;
  newest_mask_ = masks.frame;
  mask_stamp_ = frame->in.stamp;
  const auto [instances, ids] = merge_fragments(
      split_merged_instances(view_instances(masks, frame->in.thumbnail, camera_,
                                            frame->in.T_camera_odom.inverse(), config_.movable),
                             masks.ids, *frame, tracks_, camera_),
      *frame, tracks_, camera_);
  const auto points_on = points_by_instance(instances, ids, *frame);
  const Association association = associate(instances, points_on, *frame, tracks_);
  for (const int key : association.duplicates) tracks_.erase(key);
  if (!association.duplicates.empty()) drop_erased();
  for (std::size_t s = 0; s < instances.size(); ++s) {
    int key = association.track_of[s];
    if (key < 0 && instances[s].score >= kMinNewScore)
      key = add_track(instances[s].class_id, instances[s].appearance, frame->in.stamp);
    if (key >= 0) see(instances[s], points_on[s], ids, key, *frame);
  }
  for (auto& [key, track] : tracks_)
    if (track.seen != frame->in.stamp && frame->place.contains(key))
      track.overlook(*frame, frame->place.at(key), ids);
  for (auto next = frame + 1; next != frames_.end(); ++next) carry(*(next - 1), *next);
}

/// An instance of the mask of this frame shows this track.
void ObjectTracker::see(const InstanceView& instance, const PointIndices& points_on,
                        const GreyImage& ids, int key, ObjectFrame& frame) {
  const bool covered = std::any_of(frame.place.begin(), frame.place.end(), [&](const auto& other) {
    return other.first != key &&
           (other.second.box & instance.box).area() >= kCoveredShare * instance.box.area() &&
           frame.depth_m(other.second.centre_odom) < instance.depth_m;
  });
  tracks_.at(key).see(instance, frame, ids, covered, frame.place[key]);
  std::replace(frame.track_of.begin(), frame.track_of.end(), key, -1);
  for (const std::uint32_t i : points_on) frame.track_of[i] = key;
}

int ObjectTracker::add_track(int class_id, const Appearance& appearance, Timestamp stamp) {
  Track& track = tracks_[next_key_];
  track.class_id = class_id;
  track.appearance = appearance;
  track.seen = stamp;
  return next_key_++;
}

/// What moves and is on nothing known: points that hang together are a thing.
void ObjectTracker::take_movers(ObjectFrame& now) {
  const auto& points = now.in.points;
  PointIndices movers;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const int key = now.track_of[i];
    const bool moves = key >= 0 ? !tracks_.at(key).is_known() : points[i].moves;
    if (moves && points[i].uv_px.allFinite()) movers.push_back(i);
  }
  for (const PointIndices& group : connected_groups(points, movers)) {
    const auto on_known = std::count_if(
        group.begin(), group.end(), [&](std::uint32_t i) { return is_on_known(points[i], now); });
    int key = -1;
    if (static_cast<double>(on_known) <= kOnKnownShare * static_cast<double>(group.size())) {
      if (std::none_of(group.begin(), group.end(), [&](auto i) { return points[i].moves; }))
        continue;
      key = track_of_group(group, now);
      if (key >= 0) tracks_.at(key).see_motion(now.in.stamp);
    }
    for (const std::uint32_t i : group) now.track_of[i] = key;
  }
}

/// The track that most of its points are on already; a new one if there is none and they are many.
int ObjectTracker::track_of_group(const PointIndices& group, const ObjectFrame& now) {
  std::map<int, int> votes;
  for (const std::uint32_t i : group)
    if (now.track_of[i] >= 0) ++votes[now.track_of[i]];
  const auto best = std::max_element(
      votes.begin(), votes.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (best != votes.end()) return best->first;
  return std::ssize(group) < kMinMoverPoints ? -1 : add_track(kUnknownClass, {}, now.in.stamp);
}

/// Moving points on a person, at its depth, belong to it: an arm beside the mask, a bag, a kettle.
bool ObjectTracker::is_on_known(const ObjectPoint& point, const ObjectFrame& now) const {
  constexpr float kMargin = 0.15F;
  constexpr double kDepth_m = 0.6;
  const float u = point.uv_px.x(), v = point.uv_px.y();
  return std::any_of(now.place.begin(), now.place.end(), [&](const auto& entry) {
    const auto& [box, centre_odom] = entry.second;
    if (!tracks_.at(entry.first).is_known() || box.empty()) return false;
    const float du = kMargin * box.width() + 20, dv = kMargin * box.height();
    return u >= box.x0 - du && u <= box.x1 + du && v >= box.y0 - dv && v <= box.y1 + dv &&
           (!(point.depth_m > 0) || std::abs(point.depth_m - now.depth_m(centre_odom)) < kDepth_m);
  });
}

void ObjectTracker::update_tracks(ObjectFrame& now) {
  const ObjectFrame* before = frames_.size() >= 2 ? &frames_[frames_.size() - 2] : nullptr;
  auto points = points_by_track(now);
  for (auto& [key, track] : tracks_) {
    track.update(now, before, points[key], mask_stamp_, camera_, now.place[key]);
    if (track.id == kNoObject && track.is_confirmed() &&
        !may_be_known(track, tracks_, now.in.stamp))
      track.id = ObjectId{next_id_++};
  }
}

void ObjectTracker::forget(Timestamp now) {
  const auto forgotten = std::erase_if(
      tracks_, [&](const auto& entry) { return entry.second.is_forgotten(now, config_.keep_s); });
  if (forgotten > 0) drop_erased();
}

void ObjectTracker::drop_erased() {
  for (ObjectFrame& frame : frames_) {
    std::erase_if(frame.place, [&](const auto& entry) { return !tracks_.contains(entry.first); });
    for (int& key : frame.track_of)
      if (key >= 0 && !tracks_.contains(key)) key = -1;
  }
}

}  // namespace ygslam
