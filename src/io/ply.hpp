// Coloured points as binary little-endian PLY.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "image/image.hpp"

namespace ygslam {

struct CloudPoint {
  Eigen::Vector3f p_world;  ///< [m]
  Rgb8 colour;
  std::uint16_t label = 0;  ///< class id, where the cloud has labels
};

struct PlyOptions {
  bool with_label = false;  ///< adds `property ushort label`
  std::string comment;      ///< one line for the header; empty: none
};

/// x y z (float, metres), red green blue (uchar) and, if asked for, label (ushort); written
/// atomically and in pieces. Points must be finite. @return kOutput naming the file.
Status write_ply(const std::filesystem::path& path, std::span<const CloudPoint> points,
                 const PlyOptions& options = {});
[[nodiscard]] std::string encode_ply(std::span<const CloudPoint> points,
                                     const PlyOptions& options = {});

/// Reads what write_ply writes. @return kInput naming the fault: another layout, fewer bytes than
/// points, a coordinate that is not finite. Never allocates more than the bytes can hold.
[[nodiscard]] Result<std::vector<CloudPoint>> parse_ply(std::string_view bytes,
                                                        const std::string& name);
[[nodiscard]] Result<std::vector<CloudPoint>> read_ply(const std::filesystem::path& path);

}  // namespace ygslam
