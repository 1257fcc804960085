#include "io/folder_calibration.hpp"

#include <cmath>

#include "io/calibration.hpp"
#include "io/camera_devices.hpp"
#include "io/camera_formats.hpp"

namespace ygslam {
namespace fs = std::filesystem;

std::string folder_name(const fs::path& root) {
  std::error_code code;
  const fs::path full = fs::weakly_canonical(root, code);
  return (code ? root : full).filename().string();
}

Result<std::optional<CameraConfig>> calibration_of_folder(Sequence& sequence) {
  const fs::path path = sequence.root / kCalibration;
  std::error_code code;
  if (!fs::exists(path, code)) return std::optional<CameraConfig>();
  sequence.camera_source = kCalibration;
  auto read = read_calibration(path);
  if (!read.ok()) return read.error();
  if (const auto note = foreign_camera_note(path.string(), read->depth_scale); !note.empty())
    sequence.notes.push_back(note);
  return std::optional(*read);
}

Result<std::optional<CameraConfig>> json_camera_of_folder(Sequence& sequence) {
  std::optional<CameraConfig> camera;
  for (const char* name : {"camera_intrinsic.json", "intrinsic.json", "transforms.json"}) {
    const fs::path path = sequence.root / name;
    if (!has_json_camera(path)) continue;
    const auto read = read_calibration(path);
    if (!read.ok()) return read.error();
    if (camera && !are_alike(*camera, *read))
      return Error{ErrorKind::kConfig, sequence.camera_source + " and " + path.string() +
                                           " tell of two cameras: choose one with --camera"};
    if (camera) continue;
    camera = *read;
    sequence.camera_source = path.string();
    if (const auto note = foreign_camera_note(path.string(), read->depth_scale); !note.empty())
      sequence.notes.push_back(note);
  }
  return camera;
}

bool are_alike(const CameraConfig& a, const CameraConfig& b) {
  const auto is_near = [](double x, double y, double tolerance) {
    return std::abs(x - y) <= tolerance;
  };
  constexpr double kPrinted_px = 0.5;  // with how few digits a camera may be written
  constexpr double kDistortion = 1e-3;
  const auto same_side = [](int x_px, int y_px) { return x_px <= 0 || y_px <= 0 || x_px == y_px; };
  return is_near(a.fx, b.fx, kPrinted_px) && is_near(a.fy, b.fy, kPrinted_px) &&
         is_near(a.cx, b.cx, kPrinted_px) && is_near(a.cy, b.cy, kPrinted_px) &&
         is_near(a.k1, b.k1, kDistortion) && is_near(a.k2, b.k2, kDistortion) &&
         is_near(a.p1, b.p1, kDistortion) && is_near(a.p2, b.p2, kDistortion) &&
         is_near(a.k3, b.k3, kDistortion) && same_side(a.width, b.width) &&
         same_side(a.height, b.height);
}

std::optional<CameraConfig> preset_of_folder(Sequence& sequence) {
  const auto preset = camera_preset(folder_name(sequence.root));
  if (!preset) return std::nullopt;
  sequence.camera_source = "preset " + preset->name;
  return preset->camera;
}

}  // namespace ygslam
