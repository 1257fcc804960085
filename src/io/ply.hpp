// Coloured points as binary little-endian PLY.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "image/coloured_point.hpp"

namespace ygslam {

/// A list in a PLY file; of each property a line "property TYPE NAME\n".
struct PlyElement {
  std::string_view name;
  std::size_t count = 0;
  std::string_view properties;
};
/// The header of a binary little-endian file. @param comments lines "comment TEXT\n".
[[nodiscard]] std::string ply_header(std::span<const PlyElement> elements,
                                     std::string_view comments = {});

/// x y z (float, metres), red green blue (uchar); written atomically and in pieces. Points must be
/// finite. @return kOutput naming the file.
Status write_ply(const std::filesystem::path& path, std::span<const ColouredPoint> points);

}  // namespace ygslam
