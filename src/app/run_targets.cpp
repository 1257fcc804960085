#include "app/run_targets.hpp"

#include <algorithm>
#include <array>
#include <set>

#include "bag/bag.hpp"
#include "bag/mcap_writer.hpp"
#include "system/dense_file.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;

/// False also where one of them is not there.
bool is_same_place(const fs::path& a, const fs::path& b) {
  std::error_code code;
  return fs::equivalent(a, b, code);
}

/// The folder of a file that need not be there, behind links.
fs::path folder_behind(const fs::path& file) {
  std::error_code code;
  const fs::path real = fs::weakly_canonical(file, code);
  return (code ? fs::absolute(file, code) : real).parent_path();
}

Status check_recording(const RunOptions& options) {
  const fs::path file = options.mcap;
  // Standard input may be a file too: "run - < FILE".
  const fs::path read = options.sequence == "-" ? "/dev/stdin" : options.sequence;
  if (is_same_place(file, read) ||
      (is_bag(options.sequence) && is_same_place(folder_behind(file), options.sequence)))
    return Error{ErrorKind::kUsage,
                 file.string() + ": is of the recording that is read; give --mcap another file"};
  // The run's own folder will be there.
  std::error_code code;
  const fs::path out = fs::weakly_canonical(fs::absolute(options.out_dir, code), code);
  if (!fs::exists(out, code) && folder_behind(fs::absolute(file, code)) == out) return Ok{};
  return McapWriter::check(file);
}

/// The folders of the images, where they lie in folders.
std::set<fs::path> image_folders(const Sequence& sequence) {
  std::set<fs::path> folders{sequence.root};
  for (const SequencePair& pair : sequence.pairs)
    for (const std::string& file : {pair.colour_file, pair.depth_file})
      folders.insert((sequence.root / fs::path(file).relative_path()).parent_path());
  return folders;
}

Status check_background(const fs::path& folder, const Sequence& sequence) {
  for (const fs::path& read : image_folders(sequence))
    for (const fs::path& written : {folder, folder / "rgb", folder / "depth", folder / "source"})
      if (is_same_place(read, written))
        return Error{ErrorKind::kUsage, folder.string() +
                                            ": is of the recording that is read; give "
                                            "--background another folder"};
  return Ok{};
}

/// A map or recording that a file of the run's own would replace, or be replaced by.
Status check_own_files(const RunOptions& options, const char* option, const fs::path& file) {
  constexpr std::array kOwn = {"trajectory.txt", "trajectory_live.txt",
                               "keyframes.txt",  "frames.csv",
                               "objects.csv",    "loops.csv",
                               "map.ply",        "metrics.json",
                               "config.yaml",    "log.txt",
                               ".lock"};
  const auto folder_of = [](const fs::path& path) {
    std::error_code code;
    return fs::weakly_canonical(fs::absolute(path, code).parent_path(), code);
  };
  if (file.empty() || std::find(kOwn.begin(), kOwn.end(), file.filename()) == kOwn.end() ||
      folder_of(file) != folder_of(fs::path(options.out_dir) / kOwn.front()))
    return Ok{};
  return Error{ErrorKind::kUsage,
               file.string() + ": is the run's own file; give " + option + " another name"};
}

Status check_masks(const RunOptions& options, const Sequence& sequence) {
  constexpr std::string_view kMasks = "masks:";
  std::set<fs::path> read = image_folders(sequence);
  if (options.segmenter.starts_with(kMasks)) read.insert(options.segmenter.substr(kMasks.size()));
  for (const fs::path& folder : read)
    if (is_same_place(folder, options.masks_dir))
      return Error{ErrorKind::kUsage,
                   options.masks_dir + ": is read; give --save-masks another folder"};
  return Ok{};
}

}  // namespace

Status check_targets(const RunOptions& options, const Sequence& sequence) {
  for (const auto& [option, file] :
       {std::pair{"--save-map", options.save_map}, std::pair{"--mcap", options.mcap}})
    if (Status checked = check_own_files(options, option, file); !checked.ok()) return checked;
  if (!options.mcap.empty())
    if (Status checked = check_recording(options); !checked.ok()) return checked;
  if (!options.masks_dir.empty())
    if (Status checked = check_masks(options, sequence); !checked.ok()) return checked;
  if (options.background_dir.empty()) return Ok{};
  return check_background(options.background_dir, sequence);
}

bool replaces_map(const RunOptions& options) {
  std::error_code code;
  return fs::exists(options.save_map, code) &&
         (options.load_map.empty() || !is_same_place(options.save_map, options.load_map));
}

NewFolders::NewFolders(const RunOptions& options) {
  std::error_code code;
  for (const std::string& folder : {options.out_dir, options.export_dir, options.background_dir,
                                    options.debug_dir, options.masks_dir})
    if (!folder.empty() && !fs::exists(folder, code) && !code) folders_.emplace_back(folder);
}

NewFolders::~NewFolders() {
  std::error_code code;
  for (const fs::path& folder : folders_) fs::remove(folder, code);  // if it is empty
}

std::string targets_text(const RunOptions& o, bool has_dense, bool has_background) {
  const std::string map = has_dense && !o.save_map.empty()
                              ? o.save_map + " with " + dense_file_of(o.save_map).string()
                              : o.save_map;
  const std::array<std::pair<std::string, const char*>, 6> others = {
      {{o.export_dir, "--export"},
       {map, "--save-map"},
       {o.mcap, "--mcap"},
       {has_background ? o.background_dir : "", "--background"},
       {o.debug_dir, "--debug-images"},
       {o.masks_dir, "--save-masks"}}};
  std::string text = "written: " + o.out_dir;
  for (const auto& [path, option] : others)
    if (!path.empty()) text += ", " + path + " (" + option + ")";
  return text;
}

}  // namespace ygslam
