#include "map/map.hpp"

#include <algorithm>
#include <set>

#include "core/check.hpp"

namespace ygslam {
namespace {

// The observed descriptor that is most like all others (least median distance).
Descriptor most_typical(std::span<const Descriptor> descriptors) {
  std::size_t best = 0;
  int best_median = 257;
  std::vector<int> distances(descriptors.size());
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    for (std::size_t j = 0; j < descriptors.size(); ++j) {
      distances[j] = distance(descriptors[i], descriptors[j]);
    }
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>((distances.size() - 1) / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    if (*middle < best_median) {
      best_median = *middle;
      best = i;
    }
  }
  return descriptors[best];
}

/// A motion to a keyframe, as one to another that vision tied to it.
KeyframeMotion moved_on(const KeyframeMotion& motion, const SE3& T_other_keyframe) {
  const Mat6 adjoint = T_other_keyframe.adjoint();
  return {motion.from, T_other_keyframe * motion.T_keyframe_from,
          adjoint * motion.covariance * adjoint.transpose()};
}

}  // namespace

void Map::add_keyframe(KeyframeDataPtr data, const SE3& T_camera_world, KeyframeId parent,
                       std::vector<float> static_weight) {
  const KeyframeId id = data->id;
  CHECK(index(id) >= next_keyframe_, "keyframe ids ascend");
  next_keyframe_ = index(id) + 1;
  ++version_;
  if (parent == kNoKeyframe) ++roots_;
  if (origin_ == kNoKeyframe) origin_ = id;
  if (!identity_) identity_ = identity_of(*data);
  if (data->frame != kNoFrame) {
    CHECK(keyframe_of_.empty() || keyframe_of_.back().first < data->frame, "frame ids ascend");
    keyframe_of_.emplace_back(data->frame, id);
  }
  Keyframe& keyframe = keyframes_[id];
  keyframe.landmarks.assign(data->features->size(), kNoLandmark);
  CHECK(static_weight.size() == data->features->size());
  keyframe.data = std::move(data);
  keyframe.T_camera_world = T_camera_world;
  keyframe.parent = parent;
  keyframe.static_weight = std::move(static_weight);
}

void Map::remove_keyframe(KeyframeId id) {
  const Keyframe& keyframe = keyframes_.at(id);
  for (const LandmarkId landmark : std::vector<LandmarkId>(keyframe.landmarks)) {
    if (landmark != kNoLandmark) remove_observation(landmark, id);
  }
  const KeyframeId parent = keyframe.parent;
  CHECK(parent != kNoKeyframe, "the first keyframe of a submap stays");
  const SE3 T_camera_parent = keyframe.T_camera_world * resolved_pose(parent).inverse();
  for (auto& [other_id, other] : keyframes_) {
    if (other.parent == id) {
      other.parent = parent;
      if (keyframe.motion && !other.motion)
        other.motion =
            moved_on(*keyframe.motion, other.T_camera_world * keyframe.T_camera_world.inverse());
    }
    if (!other.motion || other.motion->from != id) continue;
    other.motion->from = parent;
    other.motion->T_keyframe_from = other.motion->T_keyframe_from * T_camera_parent;
  }
  // No way through removed parents grows longer with every generation.
  for (RemovedKeyframe& child : removed_keyframes_) {
    if (child.parent != id) continue;
    child.parent = parent;
    child.T_camera_parent = PackedPose(child.T_camera_parent.unpacked() * T_camera_parent);
  }
  const auto place = std::ranges::lower_bound(removed_keyframes_, id, {}, &RemovedKeyframe::id);
  removed_keyframes_.insert(place, {id, parent, PackedPose(T_camera_parent)});
  keyframes_.erase(id);
  ++version_;
}

KeyframeId Map::keyframe_of(FrameId frame) const {
  using Entry = std::pair<FrameId, KeyframeId>;
  const auto it = std::ranges::lower_bound(keyframe_of_, frame, {}, &Entry::first);
  return it == keyframe_of_.end() || it->first != frame ? kNoKeyframe : it->second;
}

void Map::forget_frames() {
  keyframe_of_.clear();
  for (auto& [id, keyframe] : keyframes_) {
    if (keyframe.data->frame == kNoFrame) continue;
    auto data = std::make_shared<KeyframeData>(*keyframe.data);
    data->frame = kNoFrame;
    data->gravity.reset();
    data->turn.reset();
    keyframe.data = std::move(data);
    keyframe.motion.reset();
  }
}

const RemovedKeyframe* Map::removed(KeyframeId id) const {
  const auto it = std::ranges::lower_bound(removed_keyframes_, id, {}, &RemovedKeyframe::id);
  return it == removed_keyframes_.end() || it->id != id ? nullptr : &*it;
}

const Keyframe& Map::keyframe(KeyframeId id) const {
  const auto it = keyframes_.find(id);
  CHECK(it != keyframes_.end());
  return it->second;
}

void Map::set_pose(KeyframeId id, const SE3& T_camera_world) {
  keyframes_.at(id).T_camera_world = T_camera_world;
  ++version_;
}

void Map::set_motion(KeyframeId id, const KeyframeMotion& motion) {
  const KeyframeId from = motion.from == kNoKeyframe ? origin_ : nearest_kept(motion.from);
  CHECK(index(from) < index(id), "the camera came from an older keyframe");
  const SE3 T_gone_from = resolved_pose(motion.from) * resolved_pose(from).inverse();
  keyframes_.at(id).motion = {from, motion.T_keyframe_from * T_gone_from, motion.covariance};
}

void Map::set_static_weight(KeyframeId id, std::vector<float> weight) {
  Keyframe& keyframe = keyframes_.at(id);
  CHECK(weight.size() == keyframe.static_weight.size());
  keyframe.static_weight = std::move(weight);
}

void Map::set_data(KeyframeId id, KeyframeDataPtr data) {
  Keyframe& keyframe = keyframes_.at(id);
  CHECK(data->id == id && data->features->size() == keyframe.landmarks.size());
  keyframe.data = std::move(data);
  ++version_;
}

KeyframeId Map::nearest_kept(KeyframeId id) const {
  if (id == kNoKeyframe) id = origin_;
  while (!keyframes_.contains(id)) {
    const RemovedKeyframe* gone = removed(id);
    CHECK(gone, "keyframe ids are never forgotten");
    id = gone->parent;
  }
  return id;
}

KeyframeId Map::root_of(KeyframeId id) const {
  if (roots_ == 1) return origin_;
  while (keyframe(id).parent != kNoKeyframe) id = nearest_kept(keyframe(id).parent);
  return id;
}

std::map<KeyframeId, KeyframeId> Map::roots() const {
  std::map<KeyframeId, KeyframeId> roots;  // parents are older
  for (const auto& [id, keyframe] : keyframes_)
    roots[id] = keyframe.parent == kNoKeyframe ? id : roots.at(nearest_kept(keyframe.parent));
  return roots;
}

KeyframeId Map::main_root() const {
  const bool is_of_earlier_run = roots_ > 0 && keyframe(origin_).data->frame == kNoFrame;
  return is_of_earlier_run ? origin_ : largest_root();
}

KeyframeId Map::largest_root() const {
  if (roots_ <= 1) return origin_;
  std::map<KeyframeId, int> keyframes;
  for (const auto& [id, root] : roots()) ++keyframes[root];
  return std::ranges::max_element(keyframes, {}, &std::pair<const KeyframeId, int>::second)->first;
}

void Map::join(KeyframeId root, KeyframeId parent) {
  CHECK(keyframe(root).parent == kNoKeyframe && parent < root && root_of(parent) != root);
  keyframes_.at(root).parent = parent;
  --roots_;
  ++version_;
}

SE3 Map::resolved_pose(KeyframeId id) const {
  if (id == kNoKeyframe) id = origin_;
  SE3 T_camera_ancestor;
  while (!keyframes_.contains(id)) {
    const RemovedKeyframe* gone = removed(id);
    CHECK(gone, "keyframe ids are never forgotten");
    T_camera_ancestor = T_camera_ancestor * gone->T_camera_parent.unpacked();
    id = gone->parent;
  }
  return T_camera_ancestor * keyframes_.at(id).T_camera_world;
}

LandmarkId Map::add_landmark(const Vec3& p_world, KeyframeId keyframe, std::uint32_t feature) {
  const LandmarkId id{next_landmark_++};
  ++version_;
  Landmark& landmark = landmarks_[id];
  landmark.id = id;
  landmark.p_world = p_world;
  landmark.first_keyframe = keyframe;
  const bool added = add_observation(id, keyframe, feature);
  CHECK(added, "the feature must be free");
  refresh(id);
  return id;
}

void Map::remove_landmark(LandmarkId id) {
  Landmark& landmark = mutable_landmark(id);
  while (!landmark.observations.empty()) {
    const LandmarkObservation last = landmark.observations.back();
    landmark.observations.pop_back();
    change_covisibility(landmark, last.keyframe, -1);
    keyframes_.at(last.keyframe).landmarks[last.feature] = kNoLandmark;
  }
  landmarks_.erase(id);
  ++version_;
}

const Landmark& Map::landmark(LandmarkId id) const {
  const auto it = landmarks_.find(id);
  CHECK(it != landmarks_.end());
  return it->second;
}

Landmark& Map::mutable_landmark(LandmarkId id) {
  const auto it = landmarks_.find(id);
  CHECK(it != landmarks_.end());
  return it->second;
}

void Map::set_position(LandmarkId id, const Vec3& p_world) {
  mutable_landmark(id).p_world = p_world;
  ++version_;
}

void Map::count_seen(LandmarkId id, int visible, int found) {
  Landmark& landmark = mutable_landmark(id);
  landmark.visible += visible;
  landmark.found += found;
}

void Map::set_seen_through(LandmarkId id, int keyframes) {
  mutable_landmark(id).seen_through = keyframes;
}

bool Map::add_observation(LandmarkId id, KeyframeId keyframe_id, std::uint32_t feature) {
  Landmark& landmark = mutable_landmark(id);
  Keyframe& keyframe = keyframes_.at(keyframe_id);
  if (keyframe.landmarks[feature] != kNoLandmark) return false;
  const auto position =
      std::lower_bound(landmark.observations.begin(), landmark.observations.end(), keyframe_id,
                       [](const LandmarkObservation& o, KeyframeId k) { return o.keyframe < k; });
  if (position != landmark.observations.end() && position->keyframe == keyframe_id) return false;
  change_covisibility(landmark, keyframe_id, +1);
  landmark.observations.insert(position, {keyframe_id, feature});
  keyframe.landmarks[feature] = id;
  return true;
}

void Map::remove_observation(LandmarkId id, KeyframeId keyframe_id) {
  Landmark& landmark = mutable_landmark(id);
  const auto it =
      std::find_if(landmark.observations.begin(), landmark.observations.end(),
                   [&](const LandmarkObservation& o) { return o.keyframe == keyframe_id; });
  if (it == landmark.observations.end()) return;
  keyframes_.at(keyframe_id).landmarks[it->feature] = kNoLandmark;
  landmark.observations.erase(it);
  change_covisibility(landmark, keyframe_id, -1);
  if (!landmark.observations.empty()) return;
  landmarks_.erase(id);
  ++version_;
}

void Map::fuse(LandmarkId from, LandmarkId into) {
  CHECK(from != into);
  const std::vector<LandmarkObservation> moved = landmark(from).observations;
  const int visible = landmark(from).visible;
  const int found = landmark(from).found;
  remove_landmark(from);
  for (const LandmarkObservation& o : moved) add_observation(into, o.keyframe, o.feature);
  count_seen(into, visible, found);
  refresh(into);
  fused_[from] = {into, ++version_};
}

void Map::forget_fusions(std::uint64_t up_to_version) {
  std::erase_if(fused_, [&](const auto& entry) { return entry.second.version <= up_to_version; });
}

LandmarkId Map::current_id(LandmarkId id) const {
  while (!landmarks_.contains(id)) {
    const auto it = fused_.find(id);
    if (it == fused_.end()) return kNoLandmark;
    id = it->second.into;
  }
  return id;
}

void Map::refresh(LandmarkId id) {
  Landmark& landmark = mutable_landmark(id);
  std::vector<Descriptor> descriptors;
  descriptors.reserve(landmark.observations.size());
  Vec3 normal = Vec3::Zero();
  for (const LandmarkObservation& o : landmark.observations) {
    const Keyframe& keyframe = keyframes_.at(o.keyframe);
    descriptors.push_back(keyframe.data->features->descriptors[o.feature]);
    normal += (landmark.p_world - keyframe.position_world()).normalized();
  }
  if (normal.norm() > 1e-9) landmark.normal_world = normal.normalized();
  landmark.descriptor = most_typical(descriptors);
  const LandmarkObservation& first = landmark.observations.front();
  const Keyframe& reference = keyframes_.at(first.keyframe);
  const int octave = reference.data->features->points[first.feature].octave;
  const double distance_m = (landmark.p_world - reference.position_world()).norm();
  landmark.max_distance_m = distance_m * scales_.of(octave);
  landmark.min_distance_m = landmark.max_distance_m / scales_.of(scales_.levels() - 1);
}

void Map::change_covisibility(const Landmark& landmark, KeyframeId keyframe, int change) {
  auto& mine = keyframes_.at(keyframe).covisible;
  for (const LandmarkObservation& o : landmark.observations) {
    if (o.keyframe == keyframe) continue;
    auto& theirs = keyframes_.at(o.keyframe).covisible;
    if ((mine[o.keyframe] += change) <= 0) mine.erase(o.keyframe);
    if ((theirs[keyframe] += change) <= 0) theirs.erase(keyframe);
  }
}

std::vector<KeyframeId> Map::covisible(KeyframeId id, int min_shared, std::size_t max_count) const {
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const auto& [other, shared] : keyframe(id).covisible) {
    if (shared >= min_shared) ranked.emplace_back(-shared, other);
  }
  std::sort(ranked.begin(), ranked.end());
  if (ranked.size() > max_count) ranked.resize(max_count);
  std::vector<KeyframeId> ids;
  for (const auto& [negative_shared, other] : ranked) ids.push_back(other);
  return ids;
}

std::vector<KeyframeId> Map::with_covisible(KeyframeId id, int min_shared,
                                            std::size_t max_count) const {
  std::vector<KeyframeId> ids = covisible(id, min_shared, max_count);
  ids.insert(ids.begin(), id);
  return ids;
}

std::vector<LandmarkId> Map::landmarks_of(std::span<const KeyframeId> keyframes) const {
  std::set<LandmarkId> seen;
  for (const KeyframeId id : keyframes)
    for (const LandmarkId landmark : keyframe(id).landmarks)
      if (landmark != kNoLandmark) seen.insert(landmark);
  return {seen.begin(), seen.end()};
}

}  // namespace ygslam
