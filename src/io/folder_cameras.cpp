#include "io/folder_cameras.hpp"

#include <array>

#include "io/camera_matrix.hpp"
#include "io/depth_calibration.hpp"
#include "io/folder_calibration.hpp"
#include "io/fusion_info.hpp"
#include "io/json_text.hpp"
#include "io/sequence_parts.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr double kReplicaScale = 6553.5;
constexpr double kMillimetreScale = 1000;  // ScanNet, 7-Scenes

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

Result<CameraConfig> scannet_lens(const Matrix4& K, const fs::path& path) {
  CameraConfig camera;
  const std::string fault = set_camera_matrix(camera, {K.data(), 16});
  if (!fault.empty()) return Error{ErrorKind::kConfig, path.string() + ": " + fault};
  camera.width = camera.height = 0;
  camera.depth_scale = kMillimetreScale;
  return camera;
}

/// ScanNet's 4x4 matrix beside the exported images.
Result<std::optional<CameraConfig>> scannet_camera(Sequence& sequence) {
  constexpr const char* kName = "intrinsic/intrinsic_color.txt";
  const auto K = read_matrix(sequence.root / kName);
  if (!K.ok()) return K.error();
  if (!K.value()) return std::optional<CameraConfig>();
  const auto camera = scannet_lens(**K, sequence.root / kName);
  if (!camera.ok()) return camera.error();
  sequence.camera_source = kName;
  return std::optional(*camera);
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
  auto camera = scannet_lens(**K, lens);
  if (!camera.ok()) return camera.error();
  camera->depth_scale = 0;  // a --camera may give one
  return set_depth_camera({*camera, T_colour_depth}, lens.string(), sequence);
}

/// BundleFusion's info.txt.
Result<std::optional<CameraConfig>> fusion_camera(Sequence& sequence) {
  const auto info = read_fusion_info(sequence.root);
  if (!info.ok()) return info.error();
  if (!info.value()) return std::optional<CameraConfig>();
  sequence.camera_source = (*info)->file;
  return std::optional((*info)->colour);
}

/// 7-Scenes (Shotton et al. 2013) has no file of its camera, but names of its own: the figures are
/// those of its page, of depth and colour alike.
Result<std::optional<CameraConfig>> seven_scenes_camera(Sequence& sequence) {
  const std::string& file = sequence.pairs.front().colour_file;
  if (!file.starts_with("frame-") || !file.ends_with(".color.png"))
    return std::optional<CameraConfig>();
  const auto header = sequence.images->header(file);
  if (!header.ok() || header->size != ImageSize{640, 480}) return std::optional<CameraConfig>();
  CameraConfig camera;
  camera.fx = camera.fy = 585;
  camera.cx = 320;
  camera.cy = 240;
  camera.width = 640;
  camera.height = 480;
  camera.depth_scale = kMillimetreScale;
  sequence.camera_source = "preset 7-Scenes";
  return std::optional(camera);
}

/// What the files of data sets and programs say, where all that are there say the same. Those that
/// tell the units of depth come first.
Result<std::optional<CameraConfig>> only_camera(Sequence& sequence) {
  std::optional<CameraConfig> camera;
  std::string source;
  for (const auto look : {replica_camera, fusion_camera, scannet_camera, json_camera_of_folder}) {
    const auto found = look(sequence);
    if (!found.ok()) return found.error();
    if (!found.value()) continue;
    if (camera && !are_alike(*camera, **found))
      return Error{ErrorKind::kConfig, sequence.root.string() + ": " + source + " and " +
                                           sequence.camera_source +
                                           " tell of two cameras: choose one with --camera"};
    if (camera) continue;
    camera = **found;
    source = sequence.camera_source;
  }
  if (camera) sequence.camera_source = source;
  return camera;
}

}  // namespace

Status find_folder_depth_camera(const GivenCameras& given, Sequence& sequence) {
  if (Status found = find_depth_camera(given, sequence); !found.ok() || given.depth) return found;
  // A calibration.txt is of somebody who prepared the images, registered depth.
  if (!sequence.depth_camera_source.empty() || sequence.camera_source == "calibration.txt")
    return Ok{};
  const auto fusion = read_fusion_info(sequence.root);
  if (!fusion.ok()) return fusion.error();
  if (!fusion.value()) return find_scannet_depth_camera(sequence);
  if (!(*fusion)->depth) return Ok{};
  DepthCamera depth = *(*fusion)->depth;
  depth.camera.depth_scale = 0;  // a --camera may give one
  return set_depth_camera(depth, (*fusion)->file, sequence);
}

Result<CameraConfig> find_folder_camera(const GivenCameras& given, Sequence& sequence) {
  if (given.colour) {
    sequence.camera_source = given.colour_source;
    return *given.colour;
  }
  const auto calibration = calibration_of_folder(sequence);
  if (!calibration.ok()) return calibration.error();
  if (calibration.value()) return **calibration;
  const auto told = only_camera(sequence);
  if (!told.ok()) return told.error();
  if (told.value()) return **told;
  if (const auto preset = preset_of_folder(sequence)) return *preset;
  const auto known = seven_scenes_camera(sequence);
  if (!known.ok()) return known.error();
  if (known.value()) return **known;
  return Error{ErrorKind::kConfig,
               sequence.root.string() +
                   ": no calibration.txt, cam_params.json, info.txt, intrinsic/, "
                   "camera_intrinsic.json or transforms.json tells of the camera; write "
                   "calibration.txt or give --camera FILE.yaml"};
}

}  // namespace ygslam
