#include "mapping/mapper.hpp"

#include <algorithm>
#include <cmath>

#include "core/trace.hpp"

namespace ygslam {
namespace {

// A mask that leaves fewer features outside says nothing about the static world: the keyframe keeps
// what tracking knew, or the map would lose its ground.
constexpr std::ptrdiff_t kMinOutside = 30;
// A frame may refer to the focus of any view since its own; more messages than this never wait.
constexpr std::size_t kRememberedFoci = 128;

FreeSpaceImage free_space_of(const KeyframeCandidate& candidate) {
  std::vector<Vec3> movers;
  for (std::size_t i = 0; i < candidate.features->size(); ++i) {
    const Feature& f = candidate.features->points[i];
    if (candidate.static_weight[i] <= 0 && f.depth_m > 0)
      movers.emplace_back(f.uv_px.x(), f.uv_px.y(), f.depth_m);
  }
  return FreeSpaceImage(candidate.frame->depth_m, movers);
}

bool is_masked(const GreyImage& mask, const Eigen::Vector2f& uv_px) {
  const auto u = static_cast<int>(std::lround(uv_px.x()));
  const auto v = static_cast<int>(std::lround(uv_px.y()));
  return mask.contains(u, v) && mask.at(u, v) != 0;
}

bool forget_pixels_of(Map& map, KeyframeId id, const GreyImage& mask) {
  const Features& features = *map.keyframe(id).data->features;
  std::vector<float> weight = map.keyframe(id).static_weight;
  bool changed = false;
  for (std::uint32_t i = 0; i < features.size(); ++i) {
    if (weight[i] <= 0 || !is_masked(mask, features.points[i].uv_px)) continue;
    changed = true;
    weight[i] = 0;
    const LandmarkId landmark = map.keyframe(id).landmarks[i];
    if (landmark != kNoLandmark) map.remove_observation(landmark, id);
  }
  if (changed) map.set_static_weight(id, std::move(weight));
  return changed;
}

}  // namespace

Mapper::Mapper(const MapperConfig& config, const Camera& camera, Map map)
    : config_(config), camera_(camera), map_(std::move(map)) {
  if (map_.keyframes().empty()) return;
  map_.forget_frames();
  newest_ = map_.keyframes().rbegin()->first;
  look_around(newest_);
}

KeyframeId Mapper::insert(const KeyframeCandidate& candidate) {
  const trace::Span span("insert keyframe");
  const KeyframeId id = map_.next_keyframe_id();
  auto data = std::make_shared<KeyframeData>(KeyframeData{
      id, candidate.frame->id, candidate.frame->stamp, candidate.features,
      FeatureGrid(*candidate.features, camera_.ideal_bounds()), free_space_of(candidate),
      candidate.read_out, candidate.gravity, candidate.turn});
  SE3 T_camera_world = candidate.pose.T_camera_reference;
  if (newest_ != kNoKeyframe)
    T_camera_world = T_camera_world * map_.resolved_pose(candidate.pose.reference);
  map_.add_keyframe(std::move(data), T_camera_world.normalized(), parent_of(candidate),
                    candidate.static_weight);
  if (candidate.motion) map_.set_motion(id, *candidate.motion);
  newest_ = id;
  look_around(id);
  associate(candidate, id);
  make_from_depth(map_, camera_, id, config_.landmarks, recent_landmarks_);
  return id;
}

/// The newest keyframe, if the camera has not come back to another submap since.
KeyframeId Mapper::parent_of(const KeyframeCandidate& candidate) const {
  if (newest_ == kNoKeyframe || candidate.submap_reach_m) return kNoKeyframe;
  const KeyframeId reference = map_.nearest_kept(candidate.pose.reference);
  return map_.root_of(newest_) == map_.root_of(reference) ? newest_ : reference;
}

void Mapper::join(KeyframeId root, KeyframeId parent, const MapPatch& patch) {
  correct(patch);
  map_.join(root, parent);
}

void Mapper::associate(const KeyframeCandidate& candidate, KeyframeId id) {
  for (const KeyframeCandidate::Seen& seen : candidate.seen) {
    const LandmarkId landmark = map_.current_id(seen.id);
    if (landmark != kNoLandmark) map_.count_seen(landmark, seen.visible, seen.found);
  }
  for (std::uint32_t i = 0; i < candidate.landmarks.size(); ++i) {
    if (candidate.landmarks[i] == kNoLandmark) continue;
    const LandmarkId landmark = map_.current_id(candidate.landmarks[i]);
    if (landmark != kNoLandmark && map_.add_observation(landmark, id, i)) map_.refresh(landmark);
  }
  map_.forget_fusions(candidate.map_version);
}

std::vector<KeyframeId> Mapper::refine(const std::atomic<bool>* abort) {
  if (newest_ == kNoKeyframe) return {};
  {
    const trace::Span span("landmarks");
    cull_landmarks(map_, recent_landmarks_, config_.culling);
    cull_seen_through(map_, camera_, newest_, config_.culling);
    make_by_triangulation(map_, camera_, newest_, config_.landmarks, recent_landmarks_);
    fuse_with_neighbours(map_, camera_, newest_, config_.fusion);
  }
  if (config_.local_bundle && map_.keyframes().size() > 1 && !(abort && abort->load())) {
    const trace::Span span("bundle adjustment");
    const BundleWindow window =
        make_bundle_window(map_, newest_, config_.noise, config_.window, gravity_);
    apply_bundle(map_, window, adjust_bundle(camera_, window.problem, config_.bundle, abort));
  }
  const trace::Span span("cull keyframes");
  return cull_keyframes(map_, newest_, config_.culling);
}

void Mapper::correct(const MapPatch& patch) {
  if (map_.apply(patch)) ++deformations_;
  gravity_.forget();
}

bool Mapper::forget_imu(const ImuRetraction& retraction) {
  gravity_.forget();
  return ygslam::forget_imu(map_, retraction);
}

void Mapper::fuse_visits(std::span<const KeyframeId> keyframes,
                         const std::vector<KeyframeId>& place) {
  for (const KeyframeId id : keyframes) fuse_with(map_, camera_, id, place, config_.fusion);
}

bool Mapper::apply_mask(KeyframeId id, std::span<const SemanticLabel> labels) {
  if (!map_.has_keyframe(id)) return false;
  const auto on_movables = std::count(labels.begin(), labels.end(), SemanticLabel::kMovable);
  const auto outside = std::ssize(labels) - on_movables;
  if (outside < std::min<std::ptrdiff_t>(kMinOutside, std::ssize(labels))) return false;
  std::vector<float> weight = map_.keyframe(id).static_weight;
  for (std::uint32_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == SemanticLabel::kStatic && weight[i] > 0) weight[i] = 1.0F;
    if (labels[i] != SemanticLabel::kMovable) continue;
    weight[i] = 0.0F;
    const LandmarkId landmark = map_.keyframe(id).landmarks[i];
    if (landmark != kNoLandmark) map_.remove_observation(landmark, id);
  }
  map_.set_static_weight(id, std::move(weight));
  make_from_depth(map_, camera_, id, config_.landmarks, recent_landmarks_);
  return true;
}

bool Mapper::forget_pixels(const GreyImage& mask) {
  std::vector<KeyframeId> of_this_run;
  for (const auto& [id, keyframe] : map_.keyframes())
    if (keyframe.data->frame != kNoFrame) of_this_run.push_back(id);
  bool changed = false;
  for (const KeyframeId id : of_this_run) changed |= forget_pixels_of(map_, id, mask);
  return changed;
}

LocalViewPtr Mapper::view() const {
  const trace::Span span("make local view");
  if (foci_.empty()) return std::make_shared<LocalView>();
  const bool kept = map_.has_keyframe(foci_.back());
  const std::vector<KeyframeId> foci(foci_.begin(), foci_.end());
  auto view = build_view(map_, kept ? foci_.back() : newest_, foci, config_.view);
  view->deformations = deformations_;
  return view;
}

bool Mapper::look_around(KeyframeId focus) {
  if (!foci_.empty() && foci_.back() == focus) return false;
  foci_.push_back(focus);
  if (foci_.size() > kRememberedFoci) foci_.pop_front();
  return true;
}

}  // namespace ygslam
