#include "map/map_bytes.hpp"

#include <zlib.h>

#include "map/descriptor_sights.hpp"
#include "map/map_assembly.hpp"
#include "map/map_fields.hpp"

namespace ygslam {
namespace {

constexpr std::uint32_t kMagic = 0x504d4759;  // "YGMP"
constexpr std::uint32_t kSchema = 5;

std::uint32_t checksum(std::span<const char> bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(crc32_z(0, nullptr, 0), reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

void write(ArchiveWriter& out, const Map& map) {
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
  map_fields::landmarks(out, landmarks, DescriptorSights(map).of(landmarks));
  map_fields::observations(out, landmarks);
}

/// @return what is wrong with a part that was read or put into the map.
MapAssembly::Fault read_parts(ArchiveReader& in, MapAssembly& assembly) {
  std::uint32_t n = 0;
  in.number(n);
  for (std::uint32_t i = 0; i < n && in.ok(); ++i) {
    auto data = std::make_shared<KeyframeData>();
    SE3 T_camera_world;
    KeyframeId parent = kNoKeyframe;
    std::vector<float> weight;
    in.number(data->id);
    in.number(data->stamp.ns);
    map_fields::seen(in, *data, nullptr);
    map_fields::pose(in, T_camera_world);
    in.number(parent);
    map_fields::static_weight(in, weight);
    if (!in.ok()) break;
    if (auto fault = assembly.add_keyframe(std::move(data), T_camera_world, parent, weight))
      return fault;
  }
  in.number(n);
  for (std::uint32_t i = 0; i < n && in.ok(); ++i) {
    RemovedKeyframe removed;
    map_fields::removed_keyframe(in, removed);
    if (!in.ok()) break;
    if (auto fault = assembly.add_removed(removed)) return fault;
  }
  std::vector<Landmark> landmarks;
  map_fields::LandmarkExtras extras;
  map_fields::landmarks(in, landmarks, extras);
  if (in.ok()) map_fields::observations(in, landmarks);
  in.check_end();
  if (!in.ok()) return in.fault();
  for (std::size_t i = 0; i < landmarks.size(); ++i)
    if (auto fault = assembly.add_landmark(std::move(landmarks[i]), extras.sights[i])) return fault;
  return assembly.parent_fault();
}

}  // namespace

std::string to_bytes(const Map& map) {
  ArchiveWriter body;
  write(body, map);
  ArchiveWriter out;
  out.number(kMagic);
  out.number(kSchema);
  out.number(checksum(body.bytes()));
  return out.bytes() + body.bytes();
}

Result<Map> map_from_bytes(std::span<const char> bytes, const std::array<double, 4>& bounds) {
  const auto fault = [](const std::string& what) {
    return Error{ErrorKind::kSavedMap, "saved map: " + what};
  };
  std::uint32_t magic = 0;
  std::uint32_t schema = 0;
  std::uint32_t expected = 0;
  ArchiveReader header(bytes);
  header.number(magic);
  header.number(schema);
  header.number(expected);
  if (!header.ok() || magic != kMagic) return fault("these bytes are no map");
  if (schema != kSchema) return fault("written by another version of the program");
  const auto body = bytes.subspan(3 * sizeof(std::uint32_t));
  if (checksum(body) != expected) return fault("damaged: the checksum does not match");
  ArchiveReader in(body);
  std::uint32_t levels = 0;
  double factor = 0;
  MapAssembly::Numbers numbers;
  in.number(levels);
  in.number(factor);
  in.number(numbers.next_keyframe);
  in.number(numbers.next_landmark);
  in.number(numbers.version);
  auto scales = MapAssembly::scales(levels, factor);
  if (!in.ok() || !scales) return fault("damaged: no image pyramid");
  if (!numbers.are_possible()) return fault("damaged: no numbers are left");
  MapAssembly assembly(std::move(*scales), numbers, bounds);
  if (const auto wrong = read_parts(in, assembly)) return fault("damaged: " + *wrong);
  return assembly.finish();
}

}  // namespace ygslam
