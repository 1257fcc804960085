#include <fmt/format.h>

#include "map_file/map_file.hpp"
#include "map_file/map_reader.hpp"
#include "map_file/replace_file.hpp"
#include "map_file/save_new.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMostFaultsTold = 100;

Error saved_map_error(const fs::path& path, const std::string& what) {
  return {ErrorKind::kSavedMap, path.string() + ": " + what};
}

Result<Map> read_all(const fs::path& path, map_file::OpenedMap& opened, const Camera& camera) {
  if (const auto fault = map_file::structure_fault(opened.database); !fault.empty())
    return saved_map_error(path, fault + map_file::kRecoverHint);
  std::string first;
  const map_file::FaultSink stop = [&](const std::string& fault) {
    first = fault;
    return false;
  };
  map_file::MapReader reader(opened, camera, stop);
  auto map = reader.read();
  if (!map) return saved_map_error(path, first + map_file::kRecoverHint);
  return std::move(*map);
}

struct Checked {
  MapCheck check;
  std::optional<Map> map;
};
Result<Checked> read_what_is_good(const fs::path& path) {
  auto opened = map_file::open_map(path, map_file::MetaFaults::kKeep);
  if (!opened) return opened.error();
  Checked checked;
  checked.check.info = opened->meta.info;
  const map_file::FaultSink keep = [&](const std::string& fault) {
    if (checked.check.faults.size() < kMostFaultsTold) checked.check.faults.push_back(fault);
    ++checked.check.faults_in_all;
    return true;
  };
  if (!opened->cut.empty()) keep(opened->cut);
  if (const auto fault = map_file::structure_fault(opened->database); !fault.empty()) keep(fault);
  const Camera camera(opened->meta.info.camera);
  map_file::MapReader reader(*opened, camera, keep);
  checked.map = reader.read();
  return checked;
}

}  // namespace

Result<Map> load_map(const fs::path& path, const Camera& camera, const PyramidScales& scales) {
  auto opened = map_file::open_map(path);
  if (!opened) return opened.error();
  if (const auto differ = map_file::differences(opened->meta.info, camera.config(), scales);
      !differ.empty())
    return saved_map_error(path, "made with " + differ);
  return read_all(path, *opened, camera);
}

Result<Map> load_map(const fs::path& path) {
  auto opened = map_file::open_map(path);
  if (!opened) return opened.error();
  return read_all(path, *opened, Camera(opened->meta.info.camera));
}

Result<MapFileInfo> read_map_info(const fs::path& path) {
  auto opened = map_file::open_map(path);
  if (!opened) return opened.error();
  return opened->meta.info;
}

Result<MapCheck> check_map(const fs::path& path) {
  auto checked = read_what_is_good(path);
  if (!checked) return checked.error();
  return std::move(checked->check);
}

Result<MapRecovery> recover_map(const fs::path& from, const fs::path& to) {
  std::error_code code;
  if (fs::exists(fs::symlink_status(to, code)))
    return Error{ErrorKind::kUsage, to.string() + ": is there already: give a new name"};
  auto checked = read_what_is_good(from);
  if (!checked) return checked.error();
  const bool is_lost =
      !checked->map || (checked->map->keyframes().empty() && checked->check.faults_in_all > 0);
  if (is_lost) return saved_map_error(from, "nothing can be put together of what is left in it");
  MapRecovery recovery;
  recovery.found = std::move(checked->check);
  recovery.keyframes = checked->map->keyframes().size();
  recovery.landmarks = checked->map->landmark_count();
  checked->map->for_each_landmark(
      [&](const Landmark& landmark) { recovery.observations += landmark.observations.size(); });
  MapFileInfo info = map_file::new_info(recovery.found.info.camera, checked->map->scales());
  const auto lock = map_file::lock_map(to);
  if (!lock) return lock.error();
  if (Status saved = map_file::save_new(to, *checked->map, std::move(info)); !saved)
    return saved.error();
  return recovery;
}

}  // namespace ygslam
