#include "app/file_uses.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <set>

#include "bag/bag.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr const char* kSequence = "SEQUENCE";
// The dense map, SQLite's log and index, the lock.
constexpr std::array kBesideMaps = {".dense", "-wal", "-shm", "-journal", ".lock"};

/// Without links as far as it is there.
fs::path without_links(const fs::path& path) {
  std::error_code code;
  const fs::path absolute = fs::absolute(path, code);
  fs::path found = fs::weakly_canonical(absolute, code);
  if (code) found = absolute.lexically_normal();
  return found.has_filename() ? found : found.parent_path();  // "folder/"
}

/// None where nothing is there.
std::optional<std::pair<std::uint64_t, std::uint64_t>> identity_of(const fs::path& file) {
  struct stat found {};
  if (::stat(file.c_str(), &found) != 0) return std::nullopt;
  return std::pair<std::uint64_t, std::uint64_t>(found.st_dev, found.st_ino);
}

/// Whether a name could be said by both of two patterns with at most one star each.
bool names_meet(std::string_view a, std::string_view b) {
  const auto star_a = a.find('*');
  const auto star_b = b.find('*');
  if (star_a == a.npos && star_b == b.npos) return a == b;
  if (star_a == a.npos) return names_meet(b, a);
  const std::string_view begin = a.substr(0, star_a), end = a.substr(star_a + 1);
  if (star_b == b.npos)
    return b.size() >= begin.size() + end.size() && b.starts_with(begin) && b.ends_with(end);
  const std::string_view other_begin = b.substr(0, star_b), other_end = b.substr(star_b + 1);
  return (begin.starts_with(other_begin) || other_begin.starts_with(begin)) &&
         (end.ends_with(other_end) || other_end.ends_with(end));
}

/// Every name of an image that is read, and anything that comes in numbers.
void add_image_folders(const Sequence& sequence, std::set<std::pair<fs::path, std::string>>& to) {
  for (const SequencePair& pair : sequence.pairs)
    for (const std::string& file : {pair.colour_file, pair.depth_file}) {
      const fs::path path = sequence.root / fs::path(file).relative_path();
      to.emplace(path.parent_path(), "*" + path.extension().string());
      to.emplace(path.parent_path(), "*");
    }
}

}  // namespace

FileUses::Place FileUses::place_of_file(const std::string& what, const fs::path& file) {
  const fs::path found = without_links(file);
  return {what, file, found.parent_path(), found.filename().string(), identity_of(found)};
}

std::vector<FileUses::Place> FileUses::places_of_map(const std::string& what, const fs::path& map) {
  if (map.empty()) return {};
  std::vector<Place> places{place_of_file(what, map)};
  for (const char* ending : kBesideMaps)
    places.push_back(place_of_file(what, without_links(map).string() + ending));
  return places;
}

std::vector<FileUses::Place> FileUses::places_in(const std::string& what, const fs::path& folder,
                                                 const Names& names) {
  std::vector<Place> places;
  for (const std::string_view name : names) {
    const fs::path path = folder / name;
    places.push_back({what, folder, without_links(path.parent_path()), path.filename().string(),
                      identity_of(path), true});
  }
  return places;
}

void FileUses::reads(const std::string& what, const fs::path& file) {
  if (!file.empty()) read_.push_back(place_of_file(what, file));
}

void FileUses::reads_map(const std::string& what, const fs::path& map) {
  const auto places = places_of_map(what, map);
  read_.insert(read_.end(), places.begin(), places.end());
}

void FileUses::reads_in(const std::string& what, const fs::path& folder, const Names& names) {
  const auto places = places_in(what, folder, names);
  read_.insert(read_.end(), places.begin(), places.end());
}

void FileUses::reads_sequence(const std::string& given, const Sequence& sequence) {
  if (given.starts_with("unix:")) return;
  if (given == "-") return reads(kSequence, "/dev/stdin");  // which may be a file: `run - < FILE`
  std::error_code code;
  if (!fs::is_directory(given, code)) return reads(kSequence, given);
  if (is_bag(given))
    return reads_in(kSequence, given, {"*", "*.mcap", "*.db3", "*.bag", "metadata.yaml"});
  reads_in(kSequence, given,
           {"associations.txt", "rgb.txt", "depth.txt", "groundtruth.txt", "calibration.txt",
            "calibration_depth.txt", "imu.csv", "imu.yaml", "odom.csv", "odom.yaml"});
  std::set<std::pair<fs::path, std::string>> images;
  add_image_folders(sequence, images);
  for (const auto& [folder, names] : images) reads_in(kSequence, folder, {names});
}

void FileUses::writes(const std::string& what, const fs::path& file) {
  if (!file.empty()) written_.push_back(place_of_file(what, file));
}

void FileUses::writes_map(const std::string& what, const fs::path& map) {
  const auto places = places_of_map(what, map);
  written_.insert(written_.end(), places.begin(), places.end());
}

void FileUses::writes_in(const std::string& what, const fs::path& folder, const Names& names) {
  if (folder.empty()) return;
  const auto places = places_in(what, folder, names);
  written_.insert(written_.end(), places.begin(), places.end());
}

bool FileUses::meet(const Place& a, const Place& b) {
  if (a.identity && a.identity == b.identity) return true;
  if (a.folder != b.folder) return false;
  // A folder that is read is no place for results, whatever they are called; a single file that is
  // named itself may lie there.
  if (a.name == "*" || b.name == "*") return a.is_of_folder && b.is_of_folder;
  return names_meet(a.name, b.name);
}

bool FileUses::is_in_the_way(const Place& file, const Place& other) {
  std::error_code code;  // that a folder is there already is told by whoever wants a file
  if (!file.is_one() || fs::is_directory(file.path(), code)) return false;
  const fs::path path = file.path();
  const auto [end, at] =
      std::mismatch(path.begin(), path.end(), other.folder.begin(), other.folder.end());
  return end == path.end();
}

Status FileUses::check() const {
  for (const Place& written : written_) {
    for (const Place& read : read_) {
      if (!meet(written, read)) continue;
      const std::string use = read.what == kSequence ? "is of the recording that is read"
                                                     : "is read (" + read.what + ")";
      return Error{ErrorKind::kUsage, written.given.string() + ": " + use + "; give " +
                                          written.what + " another name"};
    }
    for (const Place& other : written_) {
      if (other.what == written.what) continue;
      if (!meet(written, other) && !is_in_the_way(written, other)) continue;
      const std::string name = written.is_one() ? written.path().string() : written.given.string();
      return Error{ErrorKind::kUsage, name + ": " + written.what + " and " + other.what +
                                          " would both write it; give one of them another name"};
    }
  }
  return Ok{};
}

}  // namespace ygslam
