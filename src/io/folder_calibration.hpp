// What a sequence's folder itself tells of its camera: a file in it, or its name.
#pragma once

#include <optional>

#include "core/result.hpp"
#include "io/sequence.hpp"

namespace ygslam {

inline constexpr const char* kCalibration = "calibration.txt";

/// calibration.txt in the folder; width and height may still be 0, as of all of these.
[[nodiscard]] Result<std::optional<CameraConfig>> calibration_of_folder(Sequence& sequence);
/// Open3D's camera_intrinsic.json or intrinsic.json, or nerfstudio's transforms.json, where there
/// is a camera in it. @return kConfig: a damaged one, or two that differ.
[[nodiscard]] Result<std::optional<CameraConfig>> json_camera_of_folder(Sequence& sequence);
/// The known camera of a folder of that name.
[[nodiscard]] std::optional<CameraConfig> preset_of_folder(Sequence& sequence);
/// Whether two files tell of one camera, but for rounding.
[[nodiscard]] bool are_alike(const CameraConfig& a, const CameraConfig& b);

/// The last part of its path.
[[nodiscard]] std::string folder_name(const std::filesystem::path& root);

}  // namespace ygslam
