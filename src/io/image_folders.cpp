#include "io/image_folders.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>

#include "io/depth_calibration.hpp"
#include "io/image_file.hpp"
#include "io/json_text.hpp"
#include "io/name_times.hpp"
#include "io/sequence_parts.hpp"
#include "io/text.hpp"
#include "io/tum_sequence.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr double kReplicaScale = 6553.5;
constexpr double kScannetScale = 1000;

/// Where images of a kind lie: in a folder, with names that begin and end so.
struct Place {
  std::string_view folder, start = "", end = "";
};
struct Pattern {
  Place colour, depth;
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

/// Stems of the images at a place, with their paths relative to the root.
std::map<std::string, std::string> images_in(const fs::path& root, const Place& place) {
  std::map<std::string, std::string> found;
  std::error_code code;
  for (fs::directory_iterator at(root / place.folder, code), end; !code && at != end;
       at.increment(code)) {
    const fs::path name = at->path().filename();
    std::string extension = name.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const bool is_image = extension == ".png" || extension == ".jpg" || extension == ".jpeg";
    const std::string stem = name.stem().string();
    if (is_image && stem.starts_with(place.start) && stem.ends_with(place.end))
      found[stem] = (fs::path(place.folder) / name).string();
  }
  return found;
}

/// Images with the times that their names tell, and what these were taken as.
struct NamedImages {
  std::vector<ListedImage> images;
  std::string told;  // "numbers of frames at 30 Hz: rgb/2.png at 0.066666 s"
  bool is_frames = false;
};

Result<NamedImages> named_images(const fs::path& root,
                                 const std::map<std::string, std::string>& files,
                                 ListCounts& counts) {
  std::vector<std::string> stems;
  for (const auto& [stem, file] : files) stems.push_back(stem);
  const fs::path folder = (root / files.begin()->second).parent_path();
  const auto times = times_of_names(stems);
  if (!times.ok())
    return Error{ErrorKind::kInput, folder.string() + ": " + times.error().message +
                                        "; write rgb.txt and depth.txt with lines `seconds file`"};
  NamedImages named;
  std::size_t i = 0;
  for (const auto& [stem, file] : files) {
    const auto& stamp = times->stamps[i++];
    counts.malformed += stamp ? 0 : 1;
    if (stamp) named.images.push_back({*stamp, times->decimals, file});
  }
  counts.lines += files.size();
  named.images = in_time_order(std::move(named.images), counts);
  named.is_frames = times->is_frames;
  const ListedImage& last = named.images.back();
  named.told = times->taken_as + ": " + printable(last.file) + " at " +
               format_stamp(last.stamp, last.decimals) + " s";
  return named;
}

/// Replica's cam_params.json, beside the images or one folder up.
Result<std::optional<CameraConfig>> replica_camera(Sequence& sequence) {
  for (const char* place : {"cam_params.json", "../cam_params.json"}) {
    const fs::path path = sequence.root / place;
    std::error_code code;
    if (!fs::exists(path, code)) continue;
    const auto json = read_json(path);
    if (!json.ok()) return Error{ErrorKind::kConfig, json.error().message};
    const auto camera = json->is_object() ? json->find("camera") : json->end();
    CameraConfig config;
    config.width = config.height = 0;
    config.depth_scale = kReplicaScale;
    const std::array<std::pair<const char*, double*>, 5> keys = {{{"fx", &config.fx},
                                                                  {"fy", &config.fy},
                                                                  {"cx", &config.cx},
                                                                  {"cy", &config.cy},
                                                                  {"scale", &config.depth_scale}}};
    for (const auto& [key, value] : keys) {
      const bool is_there = camera != json->end() && camera->is_object() && camera->contains(key) &&
                            (*camera)[key].is_number();
      if (!is_there) return Error{ErrorKind::kConfig, path.string() + ": no number camera." + key};
      *value = (*camera)[key].get<double>();
    }
    for (const auto& [key, side_px] :
         {std::pair{"w", &config.width}, std::pair{"h", &config.height}}) {
      const auto side = camera->find(key);
      if (side != camera->end() && side->is_number_unsigned() && *side <= kMaxImageSide_px)
        *side_px = side->get<int>();
    }
    sequence.camera_source = place;
    return std::optional(config);
  }
  return std::optional<CameraConfig>();
}

using Matrix4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

/// @return nothing where there is no such file.
Result<std::optional<Matrix4>> read_matrix(const fs::path& path) {
  std::error_code code;
  if (!fs::exists(path, code)) return std::optional<Matrix4>();
  const auto text = read_file(path, std::size_t{1} << 16);
  if (!text.ok()) return Error{ErrorKind::kConfig, text.error().message};
  std::vector<double> numbers;
  for (const std::string_view word : words_of(*text, "\r\n")) {
    const auto number = parse_number(word);
    if (!number)
      return Error{ErrorKind::kConfig,
                   path.string() + ": '" + printable(word) + "' is not a finite number"};
    numbers.push_back(*number);
  }
  if (numbers.size() != 16) return Error{ErrorKind::kConfig, path.string() + ": is no 4x4 matrix"};
  return std::optional<Matrix4>(Eigen::Map<const Matrix4>(numbers.data()));
}

CameraConfig scannet_lens(const Matrix4& K) {
  CameraConfig camera;
  camera.fx = K(0, 0), camera.cx = K(0, 2), camera.fy = K(1, 1), camera.cy = K(1, 2);
  camera.width = camera.height = 0;
  camera.depth_scale = kScannetScale;
  return camera;
}

/// ScanNet's 4x4 matrix beside the exported images.
Result<std::optional<CameraConfig>> scannet_camera(Sequence& sequence) {
  constexpr const char* kName = "intrinsic/intrinsic_color.txt";
  const auto K = read_matrix(sequence.root / kName);
  if (!K.ok()) return K.error();
  if (!K.value()) return std::optional<CameraConfig>();
  sequence.camera_source = kName;
  return std::optional(scannet_lens(**K));
}

/// ScanNet's depth camera: its own matrix, and where both cameras stand in their device.
Status find_scannet_depth_camera(Sequence& sequence) {
  const fs::path lens = sequence.root / "intrinsic/intrinsic_depth.txt";
  const auto K = read_matrix(lens);
  if (!K.ok()) return K.error();
  if (!K.value()) return Ok{};
  std::array<SE3, 2> T_device_camera;
  constexpr std::array kPlacements = {"intrinsic/extrinsic_color.txt",
                                      "intrinsic/extrinsic_depth.txt"};
  for (std::size_t i = 0; i < kPlacements.size(); ++i) {
    const fs::path path = sequence.root / kPlacements[i];
    const auto T = read_matrix(path);
    if (!T.ok()) return T.error();
    if (!T.value()) continue;
    const Mat3 R = (**T).topLeftCorner<3, 3>();
    if (!((R * R.transpose()).isIdentity(1e-3) && R.determinant() > 0))
      return Error{ErrorKind::kConfig, path.string() + ": is no rigid motion"};
    T_device_camera[i] = {Eigen::Quaterniond(R), (**T).topRightCorner<3, 1>()};
  }
  const SE3 T_colour_depth = T_device_camera[0].inverse() * T_device_camera[1];
  if (const auto wrong = fault_of_placement(T_colour_depth.quaternion(), T_colour_depth.t());
      !wrong.empty())
    return Error{ErrorKind::kConfig, (sequence.root / kPlacements[1]).string() + ": " + wrong};
  CameraConfig camera = scannet_lens(**K);
  camera.depth_scale = 0;  // a --camera may give one
  return set_depth_camera({camera, T_colour_depth}, lens.string(), sequence);
}

Status find_folder_depth_camera(const GivenCameras& given, Sequence& sequence) {
  if (Status found = find_depth_camera(given, sequence); !found.ok() || given.depth) return found;
  // A calibration.txt is of somebody who prepared the images, registered depth.
  if (!sequence.depth_camera_source.empty() || sequence.camera_source == "calibration.txt")
    return Ok{};
  return find_scannet_depth_camera(sequence);
}

Result<CameraConfig> find_folder_camera(const GivenCameras& given, Sequence& sequence) {
  if (given.colour) {
    sequence.camera_source = given.colour_source;
    return *given.colour;
  }
  for (const auto look : {camera_of_folder, replica_camera, scannet_camera}) {
    const auto found = look(sequence);
    if (!found.ok()) return found.error();
    if (found.value()) return *found.value();
  }
  return Error{ErrorKind::kConfig, sequence.root.string() +
                                       ": no calibration.txt, cam_params.json or intrinsic/ tells "
                                       "of the camera; write calibration.txt or give --camera "
                                       "FILE.yaml"};
}

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

/// Why a path cannot be read: what it holds, and where a recording may be meant.
Error no_recording(const fs::path& root) {
  const auto refuse = [&](const std::string& what) {
    return Error{ErrorKind::kInput, root.string() + ": " + what};
  };
  std::error_code code;
  if (!fs::exists(root, code)) return refuse("no such file or folder");
  if (!fs::is_directory(root, code))
    return refuse("no recording that can be read (docs/inputs.md)" + parent_meant(root));
  if (const auto names = recordings_in(root); !names.empty())
    return refuse("no recording; it contains " + listed_names(names) +
                  (names.size() > 1 ? std::string()
                                    : "; did you mean " + (root / names.front()).string() + "?"));
  return refuse("no recording: it holds " + contents_of(root) +
                "; read are rgb.txt and depth.txt, or associations.txt, or images in rgb (color, "
                "colour, image, images) and depth (depths), docs/inputs.md" +
                parent_meant(root));
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
  return pair_images(colours->images, depths->images, sequence);
}

}  // namespace

bool has_image_folders(const fs::path& root) {
  return std::any_of(kPatterns.begin(), kPatterns.end(), [&](const Pattern& pattern) {
    return !images_in(root, pattern.colour).empty() && !images_in(root, pattern.depth).empty();
  });
}

Result<Sequence> open_folder_sequence(const fs::path& root, const GivenCameras& cameras) {
  std::error_code code;
  for (const char* list : {"associations.txt", "rgb.txt", "depth.txt"})
    if (fs::exists(root / list, code)) return open_tum_sequence(root, cameras);
  for (const Pattern& pattern : kPatterns) {
    const auto colour = images_in(root, pattern.colour);
    const auto depth = images_in(root, pattern.depth);
    if (colour.empty() || depth.empty()) continue;
    Sequence sequence;
    sequence.root = root;
    sequence.images = images_of_folder(root);
    if (Status paired = pair_named_images(colour, depth, sequence); !paired.ok())
      return paired.error();
    if (fs::exists(root / "groundtruth.txt", code)) sequence.groundtruth = root / "groundtruth.txt";
    const auto found = find_folder_camera(cameras, sequence);
    if (!found.ok()) return found.error();
    if (Status completed = complete_sequence(*found, sequence); !completed.ok())
      return completed.error();
    if (Status placed = find_folder_depth_camera(cameras, sequence); !placed.ok())
      return placed.error();
    return sequence;
  }
  return no_recording(root);
}

}  // namespace ygslam
