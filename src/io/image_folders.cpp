#include "io/image_folders.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>

#include "io/depth_calibration.hpp"
#include "io/image_file.hpp"
#include "io/json_text.hpp"
#include "io/sequence_parts.hpp"
#include "io/text.hpp"
#include "io/tum_sequence.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kFramesPerSecond = 30;
constexpr double kReplicaScale = 6553.5;
constexpr double kScannetScale = 1000;

/// Where images of a kind lie: in a folder, with names that begin so.
struct Pattern {
  std::string_view colour_folder, colour_start, depth_folder, depth_start;
};
constexpr std::array<Pattern, 9> kPatterns = {{{"results", "frame", "results", "depth"},
                                               {"rgb", "", "depth", ""},
                                               {"color", "", "depth", ""},
                                               {"colour", "", "depth", ""},
                                               {"image", "", "depth", ""},
                                               {"images", "", "depth", ""},
                                               {"images", "", "depths", ""},
                                               {"rgb", "", "depths", ""},
                                               {"color", "", "depths", ""}}};

/// Stems of the images in a folder that begin so, with their paths relative to the root.
std::map<std::string, std::string> images_in(const fs::path& root, std::string_view folder,
                                             std::string_view start) {
  std::map<std::string, std::string> found;
  std::error_code code;
  for (fs::directory_iterator at(root / folder, code), end; !code && at != end;
       at.increment(code)) {
    const fs::path name = at->path().filename();
    std::string extension = name.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const bool is_image = extension == ".png" || extension == ".jpg" || extension == ".jpeg";
    if (is_image && name.string().starts_with(start))
      found[name.stem().string()] = (fs::path(folder) / name).string();
  }
  return found;
}

/// The last number in a name; nothing where there is none that fits.
std::optional<std::int64_t> number_in(const std::string& stem) {
  constexpr std::size_t kMostDigits = 9;  // as a time at 30 Hz: a year
  const std::size_t last = stem.find_last_of("0123456789");
  if (last == std::string::npos) return std::nullopt;
  const std::size_t before = stem.find_last_not_of("0123456789", last);
  std::string digits = stem.substr(before == std::string::npos ? 0 : before + 1);
  digits.resize(digits.find_last_of("0123456789") + 1);
  digits.erase(0, std::min(digits.find_first_not_of('0'), digits.size() - 1));
  if (digits.size() > kMostDigits) return std::nullopt;
  return std::stoll(digits);
}

/// When an image was taken, as far as its name says so.
std::optional<ListedImage> listed(const std::string& stem, const std::string& file) {
  if (stem.find('.') != std::string::npos) {
    if (const auto stamp = parse_stamp(stem); stamp && stamp->stamp.ns >= 0)
      return ListedImage{stamp->stamp, stamp->decimals, file};
  }
  const auto number = number_in(stem);
  if (!number) return std::nullopt;
  constexpr std::int64_t kMicroseconds = 1'000'000;
  return ListedImage{{*number * kMicroseconds / kFramesPerSecond * 1000}, 6, file};
}

std::vector<ListedImage> in_order(const std::map<std::string, std::string>& images,
                                  ListCounts& counts) {
  std::vector<ListedImage> all;
  for (const auto& [stem, file] : images) {
    if (auto image = listed(stem, file)) {
      all.push_back(std::move(*image));
    } else {
      ++counts.malformed;
    }
  }
  counts.lines += images.size();
  return in_time_order(std::move(all), counts);
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

}  // namespace

bool has_image_folders(const fs::path& root) {
  return std::any_of(kPatterns.begin(), kPatterns.end(), [&](const Pattern& pattern) {
    return !images_in(root, pattern.colour_folder, pattern.colour_start).empty() &&
           !images_in(root, pattern.depth_folder, pattern.depth_start).empty();
  });
}

Result<Sequence> open_folder_sequence(const fs::path& root, const GivenCameras& cameras) {
  for (const char* list : {"associations.txt", "rgb.txt", "depth.txt"}) {
    std::error_code code;
    if (fs::exists(root / list, code)) return open_tum_sequence(root, cameras);
  }
  for (const Pattern& pattern : kPatterns) {
    const auto colour = images_in(root, pattern.colour_folder, pattern.colour_start);
    const auto depth = images_in(root, pattern.depth_folder, pattern.depth_start);
    if (colour.empty() || depth.empty()) continue;
    Sequence sequence;
    sequence.root = root;
    sequence.images = images_of_folder(root);
    const auto colours = in_order(colour, sequence.counts);
    const auto depths = in_order(depth, sequence.counts);
    if (const std::size_t left_out = sequence.counts.left_out(); left_out > 0)
      sequence.warnings.push_back(root.string() + ": " + std::to_string(left_out) +
                                  " images are left out: no number in their names, or another's");
    if (Status paired = pair_images(colours, depths, sequence); !paired.ok()) return paired.error();
    std::error_code code;
    if (fs::exists(root / "groundtruth.txt", code)) sequence.groundtruth = root / "groundtruth.txt";
    const auto found = find_folder_camera(cameras, sequence);
    if (!found.ok()) return found.error();
    if (Status completed = complete_sequence(*found, sequence); !completed.ok())
      return completed.error();
    if (Status placed = find_folder_depth_camera(cameras, sequence); !placed.ok())
      return placed.error();
    return sequence;
  }
  if (const auto names = recordings_in(root); !names.empty())
    return Error{ErrorKind::kInput,
                 root.string() + ": no recording; it contains " + listed_names(names)};
  return open_tum_sequence(root, cameras);
}

}  // namespace ygslam
