// A video of JPEG images (Motion JPEG in AVI), which players, browsers' converters and OpenCV open
// without any codec installed.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "io/image_file.hpp"

namespace ygslam {

/// Kept in memory until all images are there, since the file begins with their number.
class AviFile {
 public:
  static constexpr std::size_t kMostBytes = std::size_t{1} << 30;  ///< AVI 1.0 ends at 2^31

  /// @param size of every image. @param frames_per_s > 0.
  AviFile(ImageSize size, int frames_per_s) : size_(size), frames_per_s_(frames_per_s) {}

  /// @param jpeg a whole file of that size. @return kUsage where the video would be larger than
  /// kMostBytes.
  [[nodiscard]] Status add(std::string_view jpeg);
  [[nodiscard]] std::size_t frames() const { return sizes_.size(); }
  /// The whole file.
  [[nodiscard]] std::string bytes() const;

 private:
  ImageSize size_;
  int frames_per_s_;
  std::string images_;                // as chunks
  std::vector<std::uint32_t> sizes_;  // of the images
};

}  // namespace ygslam
