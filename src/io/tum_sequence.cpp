#include "io/tum_sequence.hpp"
#include "io/folder_calibration.hpp"
#include "io/folder_images.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "io/associated_poses.hpp"
#include "io/folder_truth.hpp"
#include "io/pairing.hpp"
#include "io/sequence_parts.hpp"
#include "io/text.hpp"
#include "io/trajectory_checks.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

Error input_error(const fs::path& path, const std::string& what) {
  return {ErrorKind::kInput, path.string() + ": " + what};
}

/// Warns of each time the list's clock was set back.
template <typename Entry>
void warn_of_resets(const fs::path& path, const ParsedList<Entry>& list, Sequence& sequence) {
  for (const ClockReset& reset : list.resets)
    sequence.warnings.push_back(
        fmt::format("{}: stamps go back by {:.3f} s at entry {} and rise from there: the clock was "
                    "set back; {:.3f} s are added from there on",
                    path.string(), 1e-9 * static_cast<double>(reset.back_ns), reset.place + 1,
                    1e-9 * static_cast<double>(reset.shift_ns)));
}

const char* list_form(const ParsedList<ListedImage>& /*list*/) { return "seconds FILE"; }
const char* list_form(const ParsedList<ListedPair>& /*list*/) {
  return "seconds rgb/FILE seconds depth/FILE";
}

// A list, or why there is none. Adds its counts and a warning to the sequence.
template <typename Entry>
Result<ParsedList<Entry>> read_list(const fs::path& path, Sequence& sequence,
                                    ParsedList<Entry> (*parse)(std::string_view)) {
  const auto text = read_file(path);
  if (!text.ok()) return text.error();
  if (const std::string fault = no_text_fault(*text); !fault.empty())
    return input_error(path, fault);
  if (Status line_ends = check_line_ends(*text, path.string()); !line_ends)
    return line_ends.error();
  ParsedList<Entry> list = parse(*text);
  if (list.counts.lines == 0) return input_error(path, "lists no image");
  if (list.entries.empty()) {
    return Error{ErrorKind::kInput, path.string() + (list.first_fault.empty() ? "" : ":") +
                                        list.first_fault + ": no usable line (" +
                                        list.counts.summary() + "); read are lines `" +
                                        std::string(list_form(list)) + "`"};
  }
  sequence.counts += list.counts;
  if (list.counts.left_out() > 0) {
    sequence.warnings.push_back(path.string() + ": " + list.counts.summary() +
                                (list.first_fault.empty() ? "" : ", first in line ") +
                                list.first_fault);
  }
  if (list.counts.moved > 0)
    sequence.warnings.push_back(path.string() + ": " + std::to_string(list.counts.moved) + " of " +
                                std::to_string(list.counts.lines) +
                                " lines are older than a line before: sorted by their stamps");
  return list;
}

/// Warns once of images that several lines of a list name.
void warn_of_repeats(const fs::path& list, const std::vector<std::string>& files,
                     Sequence& sequence) {
  std::set<std::string_view> seen;
  std::size_t repeats = 0;
  std::string_view first;
  for (const std::string& file : files) {
    if (seen.insert(file).second) continue;
    if (repeats++ == 0) first = file;
  }
  if (repeats == 0) return;
  sequence.warnings.push_back(
      fmt::format("{}: {} of {} listed images are named by a line before, first {}", list.string(),
                  repeats, files.size(), printable(first)));
}

/// Warns once of listed files that do not exist, where others of the list do. @return these files.
std::vector<std::string> absent_files(const fs::path& list, const std::vector<std::string>& files,
                                      Sequence& sequence) {
  warn_of_repeats(list, files, sequence);
  std::vector<std::string> absent;
  for (const std::string& file : files) {
    std::error_code code;
    if (!fs::exists(sequence.root / file, code)) absent.push_back(file);
  }
  if (absent.empty() || absent.size() == files.size()) return {};
  sequence.warnings.push_back(list.string() + ": " + std::to_string(absent.size()) + " of " +
                              std::to_string(files.size()) + " listed files do not exist, first " +
                              printable(absent.front()));
  return absent;
}

std::vector<std::string> absent_files(const char* list, const std::vector<ListedImage>& images,
                                      Sequence& sequence) {
  std::vector<std::string> files;
  for (const ListedImage& image : images) files.push_back(image.file);
  return absent_files(sequence.root / list, files, sequence);
}

/// Who reads a pair tells of its files; the others are told of here.
void add_unpaired(const std::vector<std::string>& absent, std::string SequencePair::*file,
                  Sequence& sequence) {
  std::set<std::string_view> paired;
  for (const SequencePair& pair : sequence.pairs) paired.insert(pair.*file);
  for (const std::string& name : absent)
    if (!paired.contains(name)) sequence.absent.push_back({name, "no such file"});
}

Status pair_lists(Sequence& sequence) {
  const fs::path colour_path = sequence.root / "rgb.txt";
  auto colour = read_list<ListedImage>(colour_path, sequence, parse_image_list);
  if (!colour.ok()) return colour.error();
  auto depth = read_list<ListedImage>(sequence.root / "depth.txt", sequence, parse_image_list);
  if (!depth.ok()) return depth.error();
  if (!align_resets(*colour, *depth))
    return input_error(sequence.root, "stamps of rgb.txt go back " +
                                          std::to_string(colour->resets.size()) +
                                          " times, those of depth.txt " +
                                          std::to_string(depth->resets.size()) + " times");
  warn_of_resets(colour_path, *colour, sequence);
  const auto absent_colour = absent_files("rgb.txt", colour->entries, sequence);
  const auto absent_depth = absent_files("depth.txt", depth->entries, sequence);
  if (Status paired = pair_images(colour->entries, depth->entries, sequence); !paired.ok())
    return paired;
  add_unpaired(absent_colour, &SequencePair::colour_file, sequence);
  add_unpaired(absent_depth, &SequencePair::depth_file, sequence);
  return Ok{};
}

/// Warns where associations are of a part of the images that the lists beside them name.
void warn_of_longer_list(const fs::path& associations, Sequence& sequence) {
  const fs::path list = sequence.root / "rgb.txt";
  std::error_code code;
  if (!fs::exists(list, code)) return;
  const auto text = read_file(list);
  const std::size_t lines = text.ok() ? data_lines(*text).size() : 0;
  if (lines > 2 * sequence.pairs.size())
    sequence.warnings.push_back(fmt::format(
        "{}: has {} pairs, rgb.txt beside it {} images: without this file all would be paired",
        associations.string(), sequence.pairs.size(), lines));
}

Status read_associations(const fs::path& path, Sequence& sequence) {
  const auto pairs = read_list<ListedPair>(path, sequence, parse_associations);
  if (!pairs.ok()) return pairs.error();
  warn_of_resets(path, *pairs, sequence);
  std::vector<std::string> files;
  for (const auto& [colour, depth] : pairs->entries) {
    sequence.pairs.push_back({colour.stamp, colour.decimals, depth.stamp, colour.file, depth.file});
    files.push_back(colour.file);
    files.push_back(depth.file);
  }
  (void)absent_files(path, files, sequence);
  warn_of_longer_list(path, sequence);
  const std::int64_t median_ns = median_difference_ns(sequence.pairs);
  if (median_ns > kMaxPairDifference_ns) {
    sequence.warnings.push_back(path.string() + ": colour and depth stamps lie " +
                                std::to_string(median_ns / 1'000'000) + " ms apart");
  }
  return Ok{};
}

/// ICL-NUIM's lists number their frames, and so does its truth: the numbers stay what they are.
void note_numbered_frames(Sequence& sequence) {
  constexpr std::size_t kFewest = 10;
  constexpr std::int64_t kFrameStep_ns = 1'000'000'000;
  if (sequence.pairs.size() < kFewest) return;
  for (std::size_t i = 0; i < sequence.pairs.size(); ++i) {
    const std::int64_t before_ns = i == 0 ? -1 : sequence.pairs[i - 1].stamp.ns;
    const std::int64_t stamp_ns = sequence.pairs[i].stamp.ns;
    if (stamp_ns % kFrameStep_ns != 0 || (i > 0 && stamp_ns != before_ns + kFrameStep_ns)) return;
  }
  sequence.notes.push_back(
      "stamps are whole numbers, one apart (numbers of frames?), and are taken as seconds, as "
      "those "
      "of the truth are");
}

/// Poses in the lines of associations.txt.
void find_associated_truth(const fs::path& associations, Sequence& sequence) {
  const auto text = read_file(associations);
  if (!text.ok() || !poses_of_associations(*text)) return;
  sequence.groundtruth = associations;
  sequence.notes.push_back("associations.txt has a pose in each line, taken as true poses");
}

/// As given, calibrated or preset; width and height may still be 0.
Result<CameraConfig> find_camera(const GivenCameras& given, Sequence& sequence) {
  if (given.colour) {
    sequence.camera_source = given.colour_source;
    return *given.colour;
  }
  for (const auto look : {calibration_of_folder, json_camera_of_folder}) {
    const auto found = look(sequence);
    if (!found.ok()) return found.error();
    if (*found) return **found;
  }
  if (const auto preset = preset_of_folder(sequence)) return *preset;
  return Error{ErrorKind::kConfig,
               sequence.root.string() +
                   ": no calibration.txt, camera_intrinsic.json or transforms.json and no preset "
                   "camera for this folder name; write calibration.txt or give --camera FILE.yaml"};
}

}  // namespace

Result<Sequence> open_tum_sequence(const fs::path& root, const GivenCameras& cameras) {
  std::error_code code;
  if (!fs::exists(root, code)) return input_error(root, "no such file or folder");
  if (!fs::is_directory(root, code))
    return input_error(root, "no recording that can be read (docs/inputs.md)");
  Sequence sequence;
  sequence.root = root;
  sequence.images = images_of_folder(root);
  const fs::path associations = root / "associations.txt";
  const Status listed = fs::exists(associations, code) ? read_associations(associations, sequence)
                                                       : pair_lists(sequence);
  if (!listed.ok()) return listed.error();
  note_numbered_frames(sequence);
  sequence.groundtruth = truth_of_folder(root);
  if (!sequence.groundtruth) find_associated_truth(associations, sequence);
  const auto found = find_camera(cameras, sequence);
  if (!found.ok()) return found.error();
  const Status completed = complete_sequence(*found, sequence);
  if (!completed.ok()) return completed.error();
  const Status placed = find_depth_camera(cameras, sequence);
  if (!placed.ok()) return placed.error();
  return sequence;
}

}  // namespace ygslam
