// Images that lie in a folder.
#pragma once

#include <filesystem>
#include <memory>

#include "io/sequence.hpp"

namespace ygslam {

/// The images of a folder, by their paths relative to it.
[[nodiscard]] std::shared_ptr<const ImageSource> images_of_folder(
    const std::filesystem::path& root);

}  // namespace ygslam
