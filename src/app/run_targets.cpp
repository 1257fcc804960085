#include "app/run_targets.hpp"

#include <array>

#include "app/file_uses.hpp"
#include "bag/mcap_writer.hpp"
#include "io/inner_folder.hpp"
#include "io/trace_writer.hpp"
#include "system/dense_file.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;

/// False also where one of them is not there.
bool is_same_place(const fs::path& a, const fs::path& b) {
  std::error_code code;
  return fs::equivalent(a, b, code);
}

constexpr std::string_view kMasks = "masks:";

/// Everything that a run reads from the disk while it goes on, or writes.
FileUses uses_of(const RunOptions& o, const Sequence& sequence) {
  FileUses uses;
  uses.reads_sequence(o.sequence, sequence);
  const auto reads_file = [&](const char* option, const std::string& given) {
    std::error_code code;  // else it is a topic
    if (fs::is_regular_file(given, code)) uses.reads(option, given);
  };
  reads_file("--imu", o.imu);
  reads_file("--imu-calibration", o.imu_calibration);
  reads_file("--odometry", o.odometry);
  reads_file("--odometry-calibration", o.odometry_calibration);
  if (o.segmenter.starts_with(kMasks))
    uses.reads_in("--segmenter", o.segmenter.substr(kMasks.size()),
                  {"*", "*.png", "instances.json"});
  // A map may go on in its own file.
  if (!is_same_place(o.load_map, o.save_map))
    uses.reads_map(o.localize ? "--map" : "--load-map", o.load_map);
  uses.writes_in("--out", o.out_dir, run_files());
  uses.writes_map("--save-map", o.save_map);
  uses.writes("--mcap", o.mcap);
  uses.writes("--trace", o.trace);
  uses.writes_in("--export", o.export_dir, scene_files());
  uses.writes_in("--background", o.background_dir,
                 {"rgb/*.png", "depth/*.png", "source/*.png", "rgb.txt", "depth.txt",
                  "associations.txt", "calibration.txt"});
  uses.writes_in("--debug-images", o.debug_dir, {"frame_*.jpg"});
  uses.writes_in("--save-masks", o.masks_dir, {"*.png", "instances.json"});
  return uses;
}

/// The run's own folder will be there.
bool lies_in_new_out(const RunOptions& options, const fs::path& file) {
  std::error_code code;
  const auto real = [&](const fs::path& path) {
    return fs::weakly_canonical(fs::absolute(path, code), code);
  };
  const fs::path out = real(options.out_dir);
  return !fs::exists(out, code) && real(file).parent_path() == out;
}

/// What lies beside a map is found out before the run.
Status check_map_name(const fs::path& map) {
  constexpr std::size_t kLongestName = 255 - 6;  // of a file, in bytes, and ".dense"
  if (map.filename().string().size() <= kLongestName) return Ok{};
  return Error{ErrorKind::kOutput,
               map.string() + ": the name is too long for what lies beside a map (.dense)"};
}

}  // namespace

Status check_targets(const RunOptions& options, const Sequence& sequence) {
  if (Status checked = uses_of(options, sequence).check(); !checked.ok()) return checked;
  if (is_same_place(options.out_dir, options.sequence))
    return Error{ErrorKind::kUsage,
                 "--out " + options.out_dir + ": is the recording itself; choose another folder"};
  if (!options.background_dir.empty())
    for (const char* part : {"rgb", "depth", "source"})
      if (Status checked = check_inner_folder(options.background_dir, part); !checked.ok())
        return checked;
  if (Status checked = check_map_name(options.save_map); !checked.ok()) return checked;
  Status checked = Ok{};
  if (!options.mcap.empty() && !lies_in_new_out(options, options.mcap))
    checked = McapWriter::check(options.mcap);
  if (checked.ok() && !options.trace.empty() && !lies_in_new_out(options, options.trace))
    checked = TraceWriter::check(options.trace);
  return checked;
}

bool replaces_map(const RunOptions& options) {
  std::error_code code;
  return fs::exists(options.save_map, code) &&
         (options.load_map.empty() || !is_same_place(options.save_map, options.load_map));
}

NewFolders::NewFolders(const RunOptions& options)
    : NewFolders({options.out_dir, options.export_dir, options.background_dir, options.debug_dir,
                  options.masks_dir}) {}

NewFolders::NewFolders(std::initializer_list<std::string> folders) {
  std::error_code code;
  for (const std::string& folder : folders)
    if (!folder.empty() && fs::symlink_status(folder, code).type() == fs::file_type::not_found)
      folders_.emplace_back(folder);
}

NewFolders::~NewFolders() {
  std::error_code code;
  for (const fs::path& folder : folders_) fs::remove(folder, code);  // if it is empty
}

std::string targets_text(const RunOptions& o, bool has_dense, bool has_background) {
  const std::string map = has_dense && !o.save_map.empty()
                              ? o.save_map + " with " + dense_file_of(o.save_map).string()
                              : o.save_map;
  const std::array<std::pair<std::string, const char*>, 7> others = {
      {{o.export_dir, "--export"},
       {map, "--save-map"},
       {o.mcap, "--mcap"},
       {o.trace, "--trace"},
       {has_background ? o.background_dir : "", "--background"},
       {o.debug_dir, "--debug-images"},
       {o.masks_dir, "--save-masks"}}};
  std::string text = "written: " + o.out_dir;
  for (const auto& [path, option] : others)
    if (!path.empty()) text += ", " + path + " (" + option + ")";
  return text;
}

}  // namespace ygslam
