// Images whose names tell their times.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "io/image_list.hpp"

namespace ygslam {

/// Where images of a kind lie: in a folder, with names that begin and end so.
struct ImagePlace {
  std::string_view folder, start = "", end = "";
};

/// Stems of the images at a place, with their paths relative to the root; empty if there are none.
/// @return kInput where two images of different kinds have one stem.
[[nodiscard]] Result<std::map<std::string, std::string>> images_at(
    const std::filesystem::path& root, const ImagePlace& place);

/// Images with the times that their names tell, and what these were taken as.
struct NamedImages {
  std::vector<ListedImage> images;
  std::string told;  ///< "numbers of frames at 30 Hz: rgb/2.png at 0.066666 s"
  bool is_frames = false;
};
/// @param files of images_at(), not empty. @param counts what is left out is added.
/// @return kInput where the times are not clear (times_of_names()).
[[nodiscard]] Result<NamedImages> named_images(const std::filesystem::path& root,
                                               const std::map<std::string, std::string>& files,
                                               ListCounts& counts);

}  // namespace ygslam
