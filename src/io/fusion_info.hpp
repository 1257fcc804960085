// info.txt of BundleFusion (Dai et al. 2017), which ScanNet's .sens files become, too: lines
// `m_calibrationColorIntrinsic = 16 numbers`.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "io/depth_registration.hpp"

namespace ygslam {

struct FusionInfo {
  std::string file;
  CameraConfig colour;               ///< width and height 0, depth_scale 1000 where it says nothing
  std::optional<DepthCamera> depth;  ///< where it tells of one
};

/// @param name for messages. @return nothing where it is no such file; kConfig where it is damaged.
[[nodiscard]] std::optional<Result<FusionInfo>> parse_fusion_info(std::string_view text,
                                                                  const std::string& name);
/// info.txt or _info.txt in a folder. @return nothing where there is neither.
[[nodiscard]] Result<std::optional<FusionInfo>> read_fusion_info(
    const std::filesystem::path& folder);

}  // namespace ygslam
