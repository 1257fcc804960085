#include "io/image_folders.hpp"
#include "io/folder_images.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <map>

#include "io/folder_cameras.hpp"
#include "io/folder_truth.hpp"
#include "io/named_images.hpp"
#include "io/sequence_parts.hpp"
#include "io/text.hpp"
#include "io/tum_sequence.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

struct Pattern {
  ImagePlace colour, depth;
};
constexpr std::array<Pattern, 10> kPatterns = {
    {{{"results", "frame"}, {"results", "depth"}},
     {{"", "frame-", ".color"}, {"", "frame-", ".depth"}},
     {{"rgb"}, {"depth"}},
     {{"color"}, {"depth"}},
     {{"colour"}, {"depth"}},
     {{"image"}, {"depth"}},
     {{"images"}, {"depth"}},
     {{"images"}, {"depths"}},
     {{"rgb"}, {"depths"}},
     {{"color"}, {"depths"}}}};

bool is_recording(const fs::path& folder) {
  std::error_code code;
  for (const char* list : {"associations.txt", "rgb.txt"})
    if (fs::is_regular_file(folder / list, code)) return true;
  return has_image_folders(folder);
}

/// "depth/, img/, 24 .jpg, 1 .txt": what a folder holds, of much the first.
std::string contents_of(const fs::path& root) {
  constexpr std::size_t kMost = 6;
  constexpr std::size_t kMostEntries = 10'000;
  std::vector<std::string> folders;
  std::map<std::string, std::size_t> files;
  std::error_code code;
  std::size_t seen = 0;
  for (fs::directory_iterator at(root, code), end; !code && at != end && seen++ < kMostEntries;
       at.increment(code)) {
    std::error_code ignored;
    if (at->is_directory(ignored))
      folders.push_back(printable(at->path().filename().string(), 24) + "/");
    else
      ++files[printable(at->path().extension().string(), 12)];
  }
  std::sort(folders.begin(), folders.end());
  if (folders.size() > kMost) folders.resize(kMost), folders.emplace_back("...");
  for (const auto& [extension, count] : files)
    if (folders.size() < 2 * kMost)
      folders.push_back(std::to_string(count) + (extension.empty() ? " files" : " " + extension));
  std::string text;
  for (const std::string& entry : folders) text += (text.empty() ? "" : ", ") + entry;
  return text.empty() ? "nothing" : text;
}

/// "; did you mean its parent X?" where that is a recording.
std::string parent_meant(const fs::path& path) {
  std::error_code code;
  const fs::path full = fs::weakly_canonical(path, code);
  if (code || !full.has_parent_path() || !is_recording(full.parent_path())) return {};
  return "; did you mean its parent " + full.parent_path().string() + "?";
}

/// Names of the recordings that a folder contains, in order.
std::vector<std::string> recordings_in(const fs::path& root) {
  std::vector<std::string> names;
  std::error_code code;
  for (fs::directory_iterator at(root, code), end; !code && at != end; at.increment(code)) {
    if (is_recording(at->path())) names.push_back(at->path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// "3: one, two, three", of many the first.
std::string listed_names(const std::vector<std::string>& names) {
  constexpr std::size_t kMostNames = 8;
  std::string text = std::to_string(names.size()) + ": ";
  for (std::size_t i = 0; i < std::min(names.size(), kMostNames); ++i)
    text += (i == 0 ? "" : ", ") + printable(names[i]);
  return text + (names.size() > kMostNames ? ", ..." : "");
}

/// What a file of another recorder is; empty where it is none.
std::string other_recording(const fs::path& path) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const char* vendor : {".sens", ".r3d", ".mkv"})
    if (ending == vendor)
      return "tools/convert_recording.py makes an MCAP recording of " + ending +
             " files (docs/inputs.md)";
  for (const char* video : {".mp4", ".mov", ".avi", ".webm"})
    if (ending == video) return "is a video; recordings need depth, too (docs/inputs.md)";
  for (const char* other : {".oni", ".klg", ".svo", ".svo2", ".zip", ".tar", ".gz", ".tgz", ".7z"})
    if (ending == other)
      return "a " + ending + " file is not read: unpack or convert it to one of docs/inputs.md";
  return {};
}

/// Why a path cannot be read: what it holds, and where a recording may be meant.
Error no_recording(const fs::path& root) {
  const auto refuse = [&](const std::string& what) {
    return Error{ErrorKind::kInput, root.string() + ": " + what};
  };
  std::error_code code;
  if (!fs::exists(root, code)) return refuse("no such file or folder");
  if (const std::string other = other_recording(root); !other.empty()) return refuse(other);
  if (!fs::is_directory(root, code))
    return refuse("no recording that can be read" +
                  (fs::is_empty(root, code) ? std::string(": the file is empty") : std::string()) +
                  " (docs/inputs.md)" + parent_meant(root));
  if (const auto names = recordings_in(root); !names.empty())
    return refuse("no recording; it contains " + listed_names(names) +
                  (names.size() > 1 ? std::string()
                                    : "; did you mean " + (root / names.front()).string() + "?"));
  return refuse("no recording: it holds " + contents_of(root) +
                "; read are rgb.txt and depth.txt, or associations.txt, or images in rgb (color, "
                "colour, image, images) and depth (depths), docs/inputs.md" +
                parent_meant(root));
}

/// Whether depth is numbered from another number on, or by another step, than colour.
bool are_numbered_otherwise(const std::vector<ListedImage>& colour,
                            const std::vector<ListedImage>& depth) {
  constexpr std::int64_t kRounding_ns = 5000;  // of stamps in whole microseconds
  const auto apart_ns = [&](std::size_t i) { return depth[i].stamp.ns - colour[i].stamp.ns; };
  const std::size_t last = colour.size() - 1;
  if (apart_ns(0) == 0 && apart_ns(last) == 0) return false;
  for (std::size_t i = 2; i <= last; ++i)
    if (std::llabs(apart_ns(i) - 2 * apart_ns(i - 1) + apart_ns(i - 2)) > kRounding_ns)
      return false;
  return true;
}

/// Warns of as many images of depth as of colour that are numbered otherwise.
void warn_of_other_numbers(const NamedImages& colours, const NamedImages& depths,
                           Sequence& sequence) {
  const auto &colour = colours.images, &depth = depths.images;
  if (!colours.is_frames || colour.size() != depth.size() || !are_numbered_otherwise(colour, depth))
    return;
  const auto range = [](const std::vector<ListedImage>& images) {
    return printable(images.front().file) + " to " + printable(images.back().file);
  };
  sequence.warnings.push_back(sequence.root.string() + ": " + range(colour) + " and " +
                              range(depth) +
                              " are as many, but numbered otherwise: the same number is one pair; "
                              "else write rgb.txt and depth.txt with lines `seconds file`");
}

/// Pairs the images that lie as a pattern says, by the times that their names tell.
Status pair_named_images(const std::map<std::string, std::string>& colour,
                         const std::map<std::string, std::string>& depth, Sequence& sequence) {
  const auto colours = named_images(sequence.root, colour, sequence.counts);
  if (!colours.ok()) return colours.error();
  const auto depths = named_images(sequence.root, depth, sequence.counts);
  if (!depths.ok()) return depths.error();
  if (colours->is_frames != depths->is_frames)
    return Error{ErrorKind::kInput, sequence.root.string() +
                                        ": the names of colour images would be " + colours->told +
                                        ", those of depth images " + depths->told +
                                        "; write rgb.txt and depth.txt with lines `seconds file`"};
  sequence.notes.push_back("names of images are taken as " + colours->told +
                           (depths->told == colours->told ? "" : "; " + depths->told));
  if (const std::size_t left_out = sequence.counts.left_out(); left_out > 0)
    sequence.warnings.push_back(sequence.root.string() + ": " + std::to_string(left_out) +
                                " images are left out: their names are of another form, or their "
                                "times another's");
  warn_of_other_numbers(*colours, *depths, sequence);
  return pair_images(colours->images, depths->images, sequence);
}

}  // namespace

bool has_image_folders(const fs::path& root) {
  const auto has_images = [&](const ImagePlace& place) {
    const auto found = images_at(root, place);
    return !found.ok() || !found->empty();  // also where they are not clear
  };
  return std::any_of(kPatterns.begin(), kPatterns.end(), [&](const Pattern& pattern) {
    return has_images(pattern.colour) && has_images(pattern.depth);
  });
}

namespace {

/// The sequence of a pattern's images, which are there.
Result<Sequence> open_pattern(const fs::path& root, const GivenCameras& cameras,
                              const std::map<std::string, std::string>& colour,
                              const std::map<std::string, std::string>& depth) {
  Sequence sequence;
  sequence.root = root;
  sequence.images = images_of_folder(root);
  if (Status paired = pair_named_images(colour, depth, sequence); !paired.ok())
    return paired.error();
  sequence.groundtruth = truth_of_folder(root);
  const auto found = find_folder_camera(cameras, sequence);
  if (!found.ok()) return found.error();
  if (Status completed = complete_sequence(*found, sequence); !completed.ok())
    return completed.error();
  if (Status placed = find_folder_depth_camera(cameras, sequence); !placed.ok())
    return placed.error();
  return sequence;
}

}  // namespace

Result<Sequence> open_folder_sequence(const fs::path& root, const GivenCameras& cameras) {
  std::error_code code;
  for (const char* list : {"associations.txt", "rgb.txt", "depth.txt"})
    if (fs::exists(root / list, code)) return open_tum_sequence(root, cameras);
  for (const Pattern& pattern : kPatterns) {
    const auto colour = images_at(root, pattern.colour);
    const auto depth = images_at(root, pattern.depth);
    if (colour.ok() && colour->empty()) continue;
    if (depth.ok() && depth->empty()) continue;
    if (!colour.ok()) return colour.error();
    if (!depth.ok()) return depth.error();
    return open_pattern(root, cameras, *colour, *depth);
  }
  return no_recording(root);
}

}  // namespace ygslam
