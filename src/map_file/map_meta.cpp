#include "map_file/map_meta.hpp"

#include <charconv>
#include <map>

#include <fmt/format.h>

#include "core/utc_time.hpp"
#include "io/calibration.hpp"
#include "map_file/row_hash.hpp"

namespace ygslam::map_file {
namespace {

constexpr const char* kCameraChecksum = "camera_checksum";
constexpr const char* kChecksum = "checksum";

bool is_camera(const std::string& name) {
  return name.starts_with("camera") || name.starts_with("pyramid");
}

/// @param accept names that count.
template <typename Accept>
std::string checksum_of(const MetaEntries& entries, Accept&& accept) {
  std::string all;
  for (const auto& [name, value] : entries)
    if (accept(name)) all += name + '\0' + value + '\0';
  return fmt::format("{:016x}", hash_of(all));
}

/// Sets a Meta from its entries, or makes the entries of one.
class MetaFields {
 public:
  explicit MetaFields(MetaEntries* written) : written_(written) {}
  explicit MetaFields(const std::map<std::string, std::string>* read) : read_(read) {}

  void text(const std::string& name, std::string& value) {
    constexpr std::size_t kLongest = 100;
    if (written_) return written_->emplace_back(name, value), void();
    value = find(name);
    if (value.size() > kLongest) blame(name);
  }
  /// In every locale, and such that the same number comes back.
  template <typename T>
  void number(const std::string& name, T& value, int base = 10) {
    if (written_) {
      std::string text = fmt::format("{}", value);
      if constexpr (std::is_unsigned_v<T>)
        if (base == 16) text = fmt::format("{:016x}", value);
      written_->emplace_back(name, std::move(text));
      return;
    }
    const std::string text = find(name);
    std::from_chars_result end{};
    if constexpr (std::is_floating_point_v<T>) {
      end = std::from_chars(text.data(), text.data() + text.size(), value);
    } else {
      end = std::from_chars(text.data(), text.data() + text.size(), value, base);
    }
    if (end.ec != std::errc() || end.ptr != text.data() + text.size()) blame(name);
  }
  [[nodiscard]] const std::string& fault() const { return fault_; }
  [[nodiscard]] const std::string& camera_fault() const { return camera_fault_; }

 private:
  std::string find(const std::string& name) {
    const auto it = read_->find(name);
    if (it == read_->end()) blame(name);
    return it == read_->end() ? "" : it->second;
  }
  void blame(const std::string& name) {
    std::string& fault = is_camera(name) ? camera_fault_ : fault_;
    if (fault.empty()) fault = "meta: " + name + ": missing or without sense";
  }

  MetaEntries* written_ = nullptr;
  const std::map<std::string, std::string>* read_ = nullptr;
  std::string fault_;
  std::string camera_fault_;
};

void visit(MetaFields& fields, Meta& meta) {
  MapFileInfo& info = meta.info;
  fields.text("uuid", info.uuid);
  fields.text("created", info.created);
  fields.text("program_version", info.program_version);
  fields.number("camera.width", info.camera.width);
  fields.number("camera.height", info.camera.height);
  for (const CameraNumber& number : kCameraNumbers)
    fields.number(std::string("camera.") + number.name, info.camera.*number.value);
  fields.number("pyramid.levels", info.pyramid_levels);
  fields.number("pyramid.factor", info.pyramid_factor);
  fields.number("generation", info.generation);
  fields.number("keyframes", info.keyframes);
  fields.number("removed_keyframes", info.removed_keyframes);
  fields.number("landmarks", info.landmarks);
  fields.number("observations", info.observations);
  fields.number("next_keyframe", meta.numbers.next_keyframe);
  fields.number("next_landmark", meta.numbers.next_landmark);
  fields.number("map_version", meta.numbers.version);
  fields.number("rows_digest", meta.rows_digest, 16);
}

}  // namespace

MetaEntries entries_of(const Meta& meta) {
  MetaEntries entries;
  MetaFields fields(&entries);
  Meta copy = meta;
  visit(fields, copy);
  entries.emplace_back(kCameraChecksum, checksum_of(entries, is_camera));
  entries.emplace_back(kChecksum, checksum_of(entries, [](const auto&) { return true; }));
  return entries;
}

Result<Meta> meta_of(const MetaEntries& entries) {
  const auto refuse = [](std::string what) { return Error{ErrorKind::kSavedMap, std::move(what)}; };
  const std::map<std::string, std::string> by_name(entries.begin(), entries.end());
  Meta meta;
  MetaFields fields(&by_name);
  visit(fields, meta);
  if (!fields.camera_fault().empty()) return refuse(fields.camera_fault());
  const MetaEntries again = entries_of(meta);  // in the order of writing
  meta.fault = fields.fault();
  if (by_name.size() != entries.size() || by_name.size() != again.size())
    meta.fault = "meta: entries that no map has, or too few";
  for (const auto& [name, value] : again) {
    const auto there = by_name.find(name);
    if (there != by_name.end() && there->second == value) continue;
    const std::string fault = "meta: " + name + ": damaged";
    if (is_camera(name)) return refuse(fault);
    if (meta.fault.empty()) meta.fault = fault;
  }
  if (meta.fault.empty() && !meta.numbers.are_possible())
    meta.fault = "meta: next_keyframe, next_landmark, map_version: no numbers are left";
  constexpr std::int64_t kMostPixels = 1 << 24;
  const CameraConfig& camera = meta.info.camera;
  if (camera.width < 1 || camera.height < 1 ||
      std::int64_t{camera.width} * camera.height > kMostPixels)
    return refuse("meta: camera: no such image size");
  if (const auto faults = camera_faults(camera); !faults.empty())
    return refuse("meta: camera." + faults.front().key + ": " + faults.front().reason);
  if (meta.info.pyramid_levels < 1 ||
      !MapAssembly::scales(static_cast<std::uint32_t>(meta.info.pyramid_levels),
                           meta.info.pyramid_factor))
    return refuse("meta: pyramid: no pyramid has such levels");
  return meta;
}

std::string differences(const MapFileInfo& info, const CameraConfig& camera,
                        const PyramidScales& scales) {
  std::string text;
  const auto compare = [&](const std::string& name, double made_with, double here) {
    if (made_with == here) return;
    text += (text.empty() ? "" : ", ") + fmt::format("{} {} (here {})", name, made_with, here);
  };
  compare("width", info.camera.width, camera.width);
  compare("height", info.camera.height, camera.height);
  for (const CameraNumber& number : kCameraNumbers)
    compare(number.name, info.camera.*number.value, camera.*number.value);
  compare("pyramid levels", info.pyramid_levels, scales.levels());
  compare("pyramid factor", info.pyramid_factor, scales.factor());
  return text;
}

MapFileInfo new_info(const CameraConfig& camera, const PyramidScales& scales) {
  MapFileInfo info;
  info.uuid = to_string(random_identity());
  info.created = utc_time_now();
  info.program_version = program_version();
  info.camera.width = camera.width;
  info.camera.height = camera.height;
  for (const CameraNumber& number : kCameraNumbers)
    info.camera.*number.value = camera.*number.value;
  info.pyramid_levels = scales.levels();
  info.pyramid_factor = scales.factor();
  return info;
}

const char* program_version() { return YGSLAM_VERSION; }

}  // namespace ygslam::map_file
