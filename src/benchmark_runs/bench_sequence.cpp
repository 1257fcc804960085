#include "benchmark_runs/bench_sequence.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <regex>
#include <set>

#include "benchmark_runs/fingerprint.hpp"
#include "io/calibration.hpp"
#include "io/image_folders.hpp"
#include "io/json_text.hpp"
#include "io/text.hpp"
#include "io/trajectory_formats.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr int kDeepest = 6;
constexpr std::array kWorldRows = {"walking_xyz", "walking_static", "walking_rpy",
                                   "walking_halfsphere", "sitting_static"};
// First line of a calibration.txt written by `ygslam simulate`.
constexpr std::string_view kRenderedMark = "# made by ygslam simulate";

bool is_there(const fs::path& path) {
  std::error_code code;
  return fs::exists(path, code);
}

bool is_folder(const fs::path& path) {
  std::error_code code;
  return fs::is_directory(path, code);
}

bool is_meant_as_sequence(const fs::path& folder) {
  return is_there(folder / "associations.txt") || is_there(folder / "rgb.txt") ||
         is_there(folder / "depth.txt") ||
         (is_folder(folder / "rgb") && is_folder(folder / "depth"));
}

void search(const fs::path& folder, int depth, std::set<fs::path>& seen,
            std::vector<fs::path>& found) {
  std::error_code code;
  if (depth > kDeepest || !seen.insert(fs::canonical(folder, code)).second) return;
  if (is_meant_as_sequence(folder)) {
    found.push_back(folder);
    return;
  }
  if (is_there(folder / "sweep.json")) return;
  for (fs::directory_iterator at(folder, code), end; !code && at != end; at.increment(code)) {
    const std::string name = at->path().filename().string();
    if (!name.starts_with(".") && is_folder(at->path())) search(at->path(), depth + 1, seen, found);
  }
}

// Letters, digits, '.', '-' and '_'; '/' becomes "__".
std::string safe_id(const std::string& name) {
  std::string id;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '/') {
      id += "__";
    } else if (byte < 0x80 && (std::isalnum(byte) != 0 || c == '.' || c == '-')) {
      id.push_back(c);
    } else if (id.empty() || id.back() != '_' || c == '_') {
      id.push_back('_');
    }
  }
  if (id.empty() || id.front() == '.' || id.front() == '-') id.insert(id.begin(), '_');
  return id;
}

std::string last_part(const std::string& name) { return name.substr(name.rfind('/') + 1); }

bool is_rendered(const fs::path& folder) {
  if (is_there(folder / "simulation.json")) return true;
  const auto text = read_file(folder / "calibration.txt", std::size_t{1} << 20);
  return text.ok() && text->starts_with(kRenderedMark);
}

// The rendered world stands in the paper's row only with its people and without faults.
std::optional<std::string> rendered_row(const BenchSequence& sequence) {
  std::string world = last_part(sequence.name);
  if (const auto json = read_json(sequence.folder / "simulation.json"); json.ok()) {
    const auto empty = [&](const char* key) {
      return !json->contains(key) || (*json)[key].empty();
    };
    if (!json->is_object() || !empty("without") || !empty("faults")) return std::nullopt;
    if (json->contains("world") && (*json)["world"].is_string()) world = (*json)["world"];
  }
  const auto row = std::find(kWorldRows.begin(), kWorldRows.end(), world);
  if (row == kWorldRows.end()) return std::nullopt;
  return std::string("fr3_") + *row;
}

std::string kind_of(const BenchSequence& sequence) {
  if (is_rendered(sequence.folder)) return "rendered";
  if (sequence.name.find("rgbd_bonn") != std::string::npos) return "bonn";
  static const std::regex tum("(^|[/_-])(freiburg|fr)[123]([_/-]|$)");
  return std::regex_search(sequence.name, tum) ? "tum" : "folder";
}

std::string bytes_of(const fs::path& path) {
  std::error_code code;
  const auto bytes = fs::file_size(path, code);
  return code ? "none" : std::to_string(bytes);
}

std::string fingerprint_of(const Sequence& tum) {
  Fingerprint print;
  for (const SequencePair& pair : tum.pairs) {
    print.add(std::to_string(pair.stamp.ns));
    print.add(std::to_string(pair.depth_stamp.ns));
    for (const std::string& file : {pair.colour_file, pair.depth_file}) {
      print.add(file);
      print.add(bytes_of(tum.root / file));
    }
  }
  for (const CameraKey& key : camera_keys()) print.add(std::to_string(tum.camera.*key.value));
  if (tum.groundtruth) {
    const auto text = read_file(*tum.groundtruth);
    print.add(text.ok() ? *text : text.error().message);
  }
  return print.text();
}

bool matches(const BenchSequence& sequence, const std::string& name) {
  return name == sequence.name || name == sequence.id || name == last_part(sequence.name);
}

}  // namespace

Result<std::vector<BenchSequence>> find_sequences(const fs::path& root) {
  if (!is_folder(root)) return Error{ErrorKind::kInput, root.string() + ": no such folder"};
  std::error_code code;
  const fs::path base = fs::canonical(root, code);
  std::vector<fs::path> folders;
  std::set<fs::path> seen;
  search(base, 0, seen, folders);
  if (folders.empty()) {
    return Error{
        ErrorKind::kInput,
        root.string() +
            ": no sequence in it (a folder with associations.txt, or rgb.txt and depth.txt)"};
  }
  std::sort(folders.begin(), folders.end());
  std::vector<BenchSequence> found;
  std::set<std::string> ids;
  for (const fs::path& folder : folders) {
    BenchSequence sequence;
    sequence.folder = folder;
    sequence.name = folder == base ? folder.filename().string()
                                   : folder.lexically_relative(base).generic_string();
    const std::string id = safe_id(sequence.name);
    sequence.id = id;
    for (int n = 2; !ids.insert(sequence.id).second; ++n)
      sequence.id = id + "_" + std::to_string(n);
    found.push_back(std::move(sequence));
  }
  return found;
}

Result<std::vector<BenchSequence>> select_sequences(const std::vector<BenchSequence>& found,
                                                    const std::vector<std::string>& names) {
  if (names.empty()) return found;
  std::vector<std::string_view> known;
  known.reserve(found.size());
  for (const BenchSequence& sequence : found) known.push_back(sequence.name);
  for (const std::string& name : names) {
    if (std::any_of(found.begin(), found.end(), [&](const auto& s) { return matches(s, name); })) {
      continue;
    }
    const std::string_view near = nearest_word(name, known);
    return Error{ErrorKind::kUsage,
                 "--sequences: none is named '" + printable(name) + "'" +
                     (near.empty() ? " (" + std::to_string(found.size()) +
                                         " found, the first is '" + found.front().name + "')"
                                   : ", did you mean '" + std::string(near) + "'?")};
  }
  std::vector<BenchSequence> chosen;
  std::copy_if(found.begin(), found.end(), std::back_inserter(chosen), [&](const auto& sequence) {
    return std::any_of(names.begin(), names.end(),
                       [&](const auto& name) { return matches(sequence, name); });
  });
  return chosen;
}

void inspect_sequence(BenchSequence& sequence) {
  sequence.kind = kind_of(sequence);
  sequence.paper_row = sequence.kind == "rendered" ? rendered_row(sequence)
                       : sequence.kind == "tum"    ? paper_row_of(sequence.name)
                                                   : std::nullopt;
  const auto tum = open_folder_sequence(sequence.folder);
  if (!tum.ok()) {
    sequence.error = without_folder(tum.error().message, sequence);
    return;
  }
  sequence.frames = tum->pairs.size();
  sequence.duration_s = seconds_between(tum->pairs.back().stamp, tum->pairs.front().stamp);
  std::error_code code;  // a folder of poses is not copied
  if (tum->groundtruth && fs::is_regular_file(*tum->groundtruth, code))
    sequence.groundtruth = tum->groundtruth;
  sequence.fingerprint = fingerprint_of(*tum);
  if (!sequence.groundtruth) return;
  const auto truth = read_stamped_trajectory(*sequence.groundtruth);
  if (truth.ok()) {
    sequence.truth = path_statistics(*truth, tum->pairs.front().stamp, tum->pairs.back().stamp);
  }
}

std::string fingerprint_of_masks(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code code;
  for (fs::directory_iterator at(folder, code), end; !code && at != end; at.increment(code)) {
    const fs::path& file = at->path();
    if (file.extension() == ".png" || file.filename() == "instances.json") files.push_back(file);
  }
  if (files.empty()) return "none";
  std::sort(files.begin(), files.end());
  Fingerprint print;
  for (const fs::path& file : files) {
    const auto bytes = read_file(file);
    print.add(file.filename().string());
    print.add(bytes.ok() ? *bytes : "unreadable");
  }
  return print.text();
}

std::optional<std::string> paper_row_of(const std::string& name) {
  std::string flat = name;
  std::transform(flat.begin(), flat.end(), flat.begin(), [](char c) {
    return c == '/' || c == '-' ? '_'
                                : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  });
  static const std::regex pattern(
      "(?:.*_)?(?:freiburg3|fr3|f3)_(?:(?:w|walking)_(xyz|x|static|rpy|r|halfsphere|half|h)|"
      "(?:s|sitting)_(static))");
  std::smatch match;
  if (!std::regex_match(flat, match, pattern)) return std::nullopt;
  if (match[2].matched) return "fr3_sitting_static";
  const std::string motion = match[1].str();
  return "fr3_walking_" + (motion == "x"                       ? "xyz"
                           : motion == "r"                     ? "rpy"
                           : motion == "half" || motion == "h" ? "halfsphere"
                                                               : motion);
}

std::string without_folder(std::string text, const BenchSequence& sequence) {
  const std::string folder = sequence.folder.string();
  for (std::size_t at = 0; !folder.empty() && (at = text.find(folder, at)) != std::string::npos;) {
    text.replace(at, folder.size(), sequence.name);
    at += sequence.name.size();
  }
  return text;
}

}  // namespace ygslam
