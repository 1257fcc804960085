#include "mapping/mapper.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

// A mask that leaves fewer features outside says nothing about the static world: the keyframe keeps
// what tracking knew, or the map would lose its ground.
constexpr std::ptrdiff_t kMinOutside = 30;

NearestDepth nearest_static_depth(const KeyframeCandidate& candidate) {
  std::vector<Vec3> movers;
  for (std::size_t i = 0; i < candidate.features->size(); ++i) {
    const Feature& f = candidate.features->points[i];
    if (candidate.static_weight[i] <= 0 && f.depth_m > 0)
      movers.emplace_back(f.uv_px.x(), f.uv_px.y(), f.depth_m);
  }
  return NearestDepth(candidate.frame->depth_m, movers);
}

}  // namespace

Mapper::Mapper(const MapperConfig& config, const Camera& camera, int pyramid_levels,
               double pyramid_scale)
    : config_(config), camera_(camera), map_(pyramid_levels, pyramid_scale) {}

KeyframeId Mapper::insert(const KeyframeCandidate& candidate) {
  const KeyframeId id{static_cast<std::uint32_t>(map_.next_keyframe_id())};
  auto data = std::make_shared<KeyframeData>(KeyframeData{
      id, candidate.frame->id, candidate.frame->stamp, candidate.features,
      FeatureGrid(*candidate.features, camera_.ideal_bounds()), nearest_static_depth(candidate)});
  SE3 T_camera_world = candidate.T_camera_reference;
  KeyframeId parent = kNoKeyframe;
  if (!map_.keyframes().empty()) {
    const KeyframeId reference =
        candidate.reference == kNoKeyframe ? KeyframeId{0} : candidate.reference;
    T_camera_world = candidate.T_camera_reference * map_.resolved_pose(reference);
    parent = newest_;
  }
  map_.add_keyframe(std::move(data), T_camera_world.normalized(), parent, candidate.static_weight);
  newest_ = id;
  associate(candidate, id);
  make_from_depth(map_, camera_, id, config_.landmarks, on_probation_);
  return id;
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
}

std::vector<KeyframeId> Mapper::refine(const std::atomic<bool>* abort) {
  if (newest_ == kNoKeyframe) return {};
  cull_landmarks(map_, on_probation_, config_.culling);
  make_by_triangulation(map_, camera_, newest_, config_.landmarks, on_probation_);
  fuse_with_neighbours(map_, camera_, newest_, config_.fusion);
  if (config_.local_bundle && map_.keyframes().size() > 1 && !(abort && abort->load())) {
    const BundleWindow window = make_bundle_window(map_, newest_, config_.noise, config_.window);
    apply_bundle(map_, window, adjust_bundle(camera_, window.problem, config_.bundle, abort));
  }
  return cull_keyframes(map_, newest_, config_.culling);
}

bool Mapper::apply_mask(FrameId frame, const GreyImage& movable) {
  const auto& keyframes = map_.keyframes();
  const auto it = std::find_if(keyframes.rbegin(), keyframes.rend(), [&](const auto& entry) {
    return entry.second.data->frame <= frame;
  });
  if (it == keyframes.rend() || it->second.data->frame != frame) return false;
  const KeyframeId id = it->first;
  const auto& points = it->second.data->features->points;
  std::vector<std::uint8_t> inside(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const int u = static_cast<int>(std::lround(points[i].uv_px.x()));
    const int v = static_cast<int>(std::lround(points[i].uv_px.y()));
    inside[i] = movable.contains(u, v) && movable.at(u, v) != 0 ? 1 : 0;
  }
  const auto outside = std::count(inside.begin(), inside.end(), std::uint8_t{0});
  if (outside < std::min<std::ptrdiff_t>(kMinOutside, std::ssize(points))) return false;
  std::vector<float> weight = it->second.static_weight;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (!inside[i]) {
      if (weight[i] > 0) weight[i] = 1.0F;
      continue;
    }
    weight[i] = 0.0F;
    const LandmarkId landmark = map_.keyframe(id).landmarks[i];
    if (landmark != kNoLandmark) map_.remove_observation(landmark, id);
  }
  map_.set_static_weight(id, std::move(weight));
  make_from_depth(map_, camera_, id, config_.landmarks, on_probation_);
  return true;
}

LocalViewPtr Mapper::view() {
  if (newest_ == kNoKeyframe) return std::make_shared<LocalView>();
  return build_view(map_, newest_, ++version_, config_.view);
}

}  // namespace ygslam
