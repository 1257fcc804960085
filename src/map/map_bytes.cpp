#include "map/map_bytes.hpp"

#include "map/descriptor_sources.hpp"
#include "map/map_fields.hpp"

namespace ygslam {

std::string to_bytes(const Map& map) {
  ArchiveWriter out;
  out.number(static_cast<std::uint32_t>(map.scales().levels()));
  out.number(map.scales().factor());
  out.number(map.next_keyframe_id());
  out.number(map.next_landmark_id());
  out.number(map.version());
  out.count(map.keyframes());
  for (const auto& [id, keyframe] : map.keyframes()) {
    out.number(id);
    out.number(keyframe.data->stamp.ns);
    map_fields::seen(out, *keyframe.data, nullptr);
    map_fields::pose(out, keyframe.T_camera_world);
    out.number(keyframe.parent);
    map_fields::static_weight(out, keyframe.static_weight);
  }
  out.count(map.removed_keyframes());
  for (const RemovedKeyframe& removed : map.removed_keyframes())
    map_fields::removed_keyframe(out, removed);
  std::vector<const Landmark*> landmarks;
  map.for_each_landmark([&](const Landmark& landmark) { landmarks.push_back(&landmark); });
  std::ranges::sort(landmarks, {}, &Landmark::id);  // the same map gives the same bytes
  map_fields::landmarks(out, landmarks, DescriptorSources(map).of(landmarks));
  map_fields::observations(out, landmarks);
  return out.bytes();
}

}  // namespace ygslam
