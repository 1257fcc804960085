// The table `meta` of a map file: names and values as text.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "map/map_assembly.hpp"
#include "map_file/map_file.hpp"

namespace ygslam::map_file {

/// What stands in `meta` besides the summary.
struct Meta {
  MapFileInfo info;
  MapAssembly::Numbers numbers;
  std::uint64_t rows_digest = 0;  ///< sum of the shares of all rows (share_of)
  std::string fault;              ///< what is wrong with it, its camera apart; empty if nothing
};

/// Name and value of each entry, with a checksum of the camera's and the pyramid's and one of all.
using MetaEntries = std::vector<std::pair<std::string, std::string>>;
[[nodiscard]] MetaEntries entries_of(const Meta& meta);
/// Each entry must be there once and say something possible.
/// @return an error where camera or pyramid are not certain: without them nothing can be done. All
/// other faults are in Meta::fault.
[[nodiscard]] Result<Meta> meta_of(const MetaEntries& entries);

/// A number of a camera that decides where a map's features lie.
struct CameraNumber {
  const char* name;
  double CameraConfig::*value;
};
inline constexpr std::array<CameraNumber, 9> kCameraNumbers = {{{"fx", &CameraConfig::fx},
                                                                {"fy", &CameraConfig::fy},
                                                                {"cx", &CameraConfig::cx},
                                                                {"cy", &CameraConfig::cy},
                                                                {"k1", &CameraConfig::k1},
                                                                {"k2", &CameraConfig::k2},
                                                                {"p1", &CameraConfig::p1},
                                                                {"p2", &CameraConfig::p2},
                                                                {"k3", &CameraConfig::k3}}};

/// What a map's camera and pyramid have otherwise than those of this run, with both values; empty
/// if nothing.
[[nodiscard]] std::string differences(const MapFileInfo& info, const CameraConfig& camera,
                                      const PyramidScales& scales);

/// Of a file that is new: a uuid that stays where its map brings none, the time, this program's
/// version.
[[nodiscard]] MapFileInfo new_info(const CameraConfig& camera, const PyramidScales& scales);
[[nodiscard]] const char* program_version();

}  // namespace ygslam::map_file
