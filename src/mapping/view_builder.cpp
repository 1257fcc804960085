#include "mapping/view_builder.hpp"

#include <algorithm>

#include "mapping/neighbour_fusion.hpp"

namespace ygslam {
namespace {

std::vector<KeyframeId> choose_keyframes(const Map& map, KeyframeId focus, KeyframeId root,
                                         const ViewConfig& config) {
  std::vector<KeyframeId> chosen = {focus};
  for (const KeyframeId id : neighbours(map, focus, static_cast<std::size_t>(config.keyframes))) {
    chosen.push_back(id);
  }
  int recent = 0;
  for (auto it = map.keyframes().rbegin();
       it != map.keyframes().rend() && recent < config.recent_keyframes; ++it, ++recent) {
    const bool is_new = std::find(chosen.begin(), chosen.end(), it->first) == chosen.end();
    if (is_new && map.root_of(it->first) == root) chosen.push_back(it->first);
  }
  return chosen;
}

void add_landmarks(const Map& map, const Keyframe& keyframe, const ViewConfig& config,
                   LocalView& view) {
  for (const LandmarkId id : keyframe.landmarks) {
    if (id == kNoLandmark) continue;
    if (view.landmarks.size() >= static_cast<std::size_t>(config.landmarks)) return;
    const auto [it, is_new] =
        view.landmark_index.emplace(id, static_cast<std::uint32_t>(view.landmarks.size()));
    if (!is_new) continue;
    const Landmark& l = map.landmark(id);
    view.landmarks.push_back(
        {id, l.p_world, l.normal_world, l.descriptor, l.min_distance_m, l.max_distance_m});
  }
}

/// @param well_observed landmarks are found again by the tracker: seen by so many keyframes.
ViewKeyframe view_of(const Map& map, const Keyframe& keyframe, const LocalView& view,
                     std::size_t well_observed) {
  ViewKeyframe result{keyframe.data, keyframe.T_camera_world, {}, 0};
  result.landmarks.reserve(keyframe.landmarks.size());
  for (const LandmarkId id : keyframe.landmarks) {
    result.landmarks.push_back(id == kNoLandmark ? -1 : view.find(id));
    if (id != kNoLandmark && map.landmark(id).observations.size() >= well_observed) {
      ++result.tracked_landmarks;
    }
  }
  return result;
}

}  // namespace

std::shared_ptr<LocalView> build_view(const Map& map, KeyframeId focus,
                                      std::span<const KeyframeId> poses_of,
                                      const ViewConfig& config) {
  auto view = std::make_shared<LocalView>();
  view->map_version = map.version();
  view->origin = map.origin();
  view->others = {{map.origin(), map.resolved_pose(map.origin())}};
  for (const KeyframeId id : poses_of) view->others.push_back({id, map.resolved_pose(id)});
  const KeyframeId root = map.root_of(focus);
  view->placed = root == map.origin();
  const auto chosen = choose_keyframes(map, focus, root, config);
  const std::size_t well_observed = std::min<std::size_t>(3, chosen.size());
  for (const KeyframeId id : chosen) add_landmarks(map, map.keyframe(id), config, *view);
  for (const KeyframeId id : chosen) {
    view->keyframes.push_back(view_of(map, map.keyframe(id), *view, well_observed));
  }
  return view;
}

}  // namespace ygslam
