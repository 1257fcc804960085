#include "system/mapping_stage.hpp"

#include <algorithm>

#include "loop/map_straightening.hpp"
#include "system/dense_marks.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kRememberedAttempts = 20000;  // of loops
constexpr std::size_t kPlaceKeyframes = 10;         // besides the one that was found, to be fused

std::vector<KeyframeId> submap_of(const Map& map, KeyframeId keyframe) {
  const KeyframeId root = map.root_of(keyframe);
  std::vector<KeyframeId> submap;
  for (const auto& [id, its_root] : map.roots())
    if (its_root == root) submap.push_back(id);
  return submap;
}

}  // namespace

MappingStageConfig mapping_config(const SlamConfig& config, bool expects_masks, bool frozen) {
  return {config.mapping, config.loop, config.close_loops, frozen, config.dynamic.masks.mask,
          expects_masks};
}

MappingStage::MappingStage(const MappingStageConfig& config, const Camera& camera, Map map)
    : config_(config),
      camera_(camera),
      mapper_(config.mapper, camera, std::move(map)),
      index_(config.loop.index),
      place_finder_(config.loop.finder, camera),
      loop_closer_(config.loop, camera),
      submap_joiner_({config.loop.index, config.loop.finder}) {
  index_.rebuild(this->map());
}

void MappingStage::insert(const KeyframeMessage& message) {
  CHECK(!config_.frozen, "nobody proposes keyframes for a map that stays as it is");
  const KeyframeId id = mapper_.insert(message.candidate);
  if (message.candidate.submap_reach_m) submap_joiner_.begin(id, *message.candidate.submap_reach_m);
  Waiting waiting{id, message.candidate.frame, message.candidate.features, message.labels};
  if (!config_.expects_masks) {
    integrate(waiting, nullptr);
    return;
  }
  waiting_.emplace(waiting.frame->id, std::move(waiting));
  while (waiting_.size() > static_cast<std::size_t>(config_.max_waiting_keyframes)) {
    integrate(waiting_.begin()->second, nullptr);
    waiting_.erase(waiting_.begin());
  }
}

void MappingStage::look_at(const DenseFrameMessage& message) {
  if (!config_.expects_masks || config_.frozen || map().keyframes().empty()) return;
  const KeyframeId newest{index(map().next_keyframe_id()) - 1};
  waiting_frames_.emplace(message.frame->id, WaitingFrame{newest, message});
  while (waiting_frames_.size() > static_cast<std::size_t>(config_.max_waiting_frames))
    waiting_frames_.erase(waiting_frames_.begin());
}

DenseAnchor MappingStage::anchor_of(const KeyframeRelativePose& pose) const {
  const KeyframeId kept = map().nearest_kept(pose.reference);
  const Keyframe& keyframe = map().keyframe(kept);
  if (kept == pose.reference) return {kept, keyframe.data->stamp, pose.T_camera_reference};
  return {kept, keyframe.data->stamp,
          pose.T_camera_reference * map().resolved_pose(pose.reference) *
              keyframe.T_camera_world.inverse()};
}

void MappingStage::refine(const std::atomic<bool>* abort) {
  for (const KeyframeId culled : mapper_.refine(abort)) culled_.push_back(culled);
}

bool MappingStage::look_for(const Features& features, std::span<const float> static_weight) {
  const FeatureGrid grid(features, camera_.ideal_bounds());
  const auto place = place_finder_.find_one(map(), index_, {features, grid, static_weight}, 0);
  return place && mapper_.look_around(place->place);
}

bool MappingStage::look_for(const Features& features, std::span<const float> static_weight,
                            const KeyframeRelativePose& pose) {
  if (!config_.close_loops) return false;
  const KeyframeId reference = map().nearest_kept(pose.reference);
  const SE3 T_camera_reference = pose.T_camera_reference * map().resolved_pose(pose.reference) *
                                 map().keyframe(reference).T_camera_world.inverse();
  const FeatureGrid grid(features, camera_.ideal_bounds());
  const auto own = submap_of(map(), reference);
  for (const FoundPlace& place :
       place_finder_.find(map(), index_, {features, grid, static_weight}, own, 0)) {
    if (place.match.verdict != PlaceVerdict::kAgrees) continue;
    const auto found = submap_joiner_.step(map(), reference, T_camera_reference, place.match);
    if (!found) continue;
    join(*found);
    return true;
  }
  return false;
}

void MappingStage::correct_shutter(const ShutterReport& report) {
  if (config_.frozen || !mapper_.correct_shutter(report.in_use_s, report.times)) return;
  constexpr int kAdjustments = 2;  // the first begins where residuals of all rows are wrong
  for (int round = 0; round < kAdjustments; ++round)
    if (const auto patch = solve(camera_, full_adjustment(), config_.mapper.bundle))
      correct(*patch);
}

bool MappingStage::close_loops() {
  bool changed = false;
  while (!complete_.empty()) {
    const KeyframeId id = complete_.front();
    complete_.pop_front();
    if (!map().has_keyframe(id)) continue;
    const LoopResult result = loop_closer_.step(map(), index_, id);
    append_attempts(result.attempts, kRememberedAttempts, attempts_);
    if (result.closure) {
      ++closed_loops_;
      mapper_.correct(result.closure->patch);
      mapper_.fuse_visits(result.closure->window, result.closure->place);
      changed = true;
    }
    if (const auto found = submap_joiner_.step(map(), result.attempts)) {
      join(*found);
      changed = true;
    }
    index_.add(map(), id);
  }
  return changed;
}

void MappingStage::join(const SubmapJoin& join) {
  ++closed_loops_;
  mapper_.join(join.root, join.parent, join.patch);
  for (const MapPair& pair : join.pairs) {
    std::vector<KeyframeId> place = map().covisible(pair.match.place, 1, kPlaceKeyframes);
    place.push_back(pair.match.place);
    std::erase(place, pair.in_b);
    mapper_.fuse_visits({&pair.in_b, 1}, place);
  }
}

bool MappingStage::apply(const Segmentation& masks) {
  if (const auto frame = waiting_frames_.find(masks.frame); frame != waiting_frames_.end()) {
    const auto& [newest, message] = frame->second;
    DenseFrame dense{newest, message.frame, message.read_out, {}, {}, {}, anchor_of(message.pose)};
    mark_movers_and_things(&masks, *message.features, message.labels, config_.mask.movable, dense);
    offer(std::move(dense));
    waiting_frames_.erase(frame);
    return false;
  }
  const auto at = waiting_.find(masks.frame);
  if (at == waiting_.end()) return false;
  const Waiting& keyframe = at->second;
  std::vector<SemanticLabel> labels;
  for (const PointMask& point :
       label_by_mask(*keyframe.features, masks, CoarseDepth(keyframe.frame->depth_m), config_.mask))
    labels.push_back(point.label);
  const bool changed = mapper_.apply_mask(keyframe.keyframe, labels);
  integrate(keyframe, &masks);
  waiting_.erase(at);
  return changed;
}

void MappingStage::finish(const std::atomic<bool>* abort) {
  for (const auto& [frame, waiting] : waiting_) integrate(waiting, nullptr);
  waiting_.clear();
  waiting_frames_.clear();
  if (config_.frozen || closed_loops_ > 0) return;  // loops know better
  if (const auto patch = straightened(map(), config_.loop.min_shared, kLargerThanARoom_m, abort))
    correct(*patch);
}

void MappingStage::integrate(const Waiting& waiting, const Segmentation* masks) {
  if (!map().has_keyframe(waiting.keyframe)) return;  // culled before its mask came
  DenseFrame dense{
      waiting.keyframe, waiting.frame, map().keyframe(waiting.keyframe).data->read_out, {}, {}, {}};
  mark_movers_and_things(masks, *waiting.features, waiting.labels, config_.mask.movable, dense);
  offer(std::move(dense));
  if (config_.close_loops) complete_.push_back(waiting.keyframe);
}

void MappingStage::offer(DenseFrame frame) {
  std::vector<DenseFrame>& offered = dense_update_.added;
  offered.push_back(std::move(frame));
  if (offered.size() <= config_.max_dense_frames) return;
  const auto between =
      std::ranges::find_if(offered, [](const DenseFrame& f) { return f.anchor.has_value(); });
  offered.erase(between != offered.end() ? between : offered.begin());
  ++dense_skipped_;
}

std::vector<FramePtr> MappingStage::waiting() const {
  std::vector<FramePtr> frames;
  for (const auto& [id, waiting] : waiting_) frames.push_back(waiting.frame);
  for (const auto& [id, waiting] : waiting_frames_) frames.push_back(waiting.message.frame);
  return frames;
}

DenseUpdate MappingStage::take_dense_update() {
  for (const KeyframeId culled : culled_)
    dense_update_.removed.push_back({culled, anchor_of({culled, SE3()})});
  culled_.clear();
  const KeyframeId main_root = map().main_root();
  for (const auto& [id, root] : map().roots())
    if (root == main_root)
      dense_update_.T_world_camera[id] = map().keyframe(id).T_camera_world.inverse();
  return std::exchange(dense_update_, {});
}

}  // namespace ygslam
