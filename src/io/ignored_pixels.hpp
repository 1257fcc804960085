// Which pixels a camera file tells to leave out: rectangles, or an image of them.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/camera.hpp"
#include "image/image.hpp"

namespace ygslam {

/// Of a camera file: "." where it is named alone.
[[nodiscard]] std::filesystem::path folder_of(const std::filesystem::path& file);

/// Rectangles that cover just the pixels that are not 0.
[[nodiscard]] std::vector<PixelRectangle> rectangles_of(const GreyImage& mask);

/// Reads the value of `ignore` into a camera: four numbers for each rectangle (x y width height,
/// from the upper left), or the name of an 8-bit grey PNG, not 0 where nothing is to be looked at.
/// Its size becomes the camera's, if that has none yet.
/// @param folder that the name counts from; empty: names are refused.
/// @return what is wrong, empty if nothing. Whether rectangles lie in the image: camera_faults().
[[nodiscard]] std::string read_ignored(std::span<const std::string_view> words,
                                       const std::filesystem::path& folder, CameraConfig& camera);

/// "0 420 640 60" for each rectangle, separated by spaces; read_ignored() reads the same.
[[nodiscard]] std::string ignored_text(const CameraConfig& camera);

/// Why a rectangle does not lie in the camera's image, whose size is known.
[[nodiscard]] std::optional<std::string> ignored_fault(const CameraConfig& camera);

}  // namespace ygslam
