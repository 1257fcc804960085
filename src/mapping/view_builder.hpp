// Cuts the tracker's local view out of the map.
#pragma once

#include <span>

#include "map/local_view.hpp"
#include "map/map.hpp"

namespace ygslam {

struct ViewConfig {
  int keyframes = 30;        ///< around the focus
  int recent_keyframes = 8;  ///< also kept, for relocalisation
  int landmarks = 6000;      ///< at most; those of nearer keyframes first
};

/// @param focus the keyframe that comes first, before those it shares landmarks with.
/// @param poses_of keyframes, kept or removed, whose poses the view is to know.
[[nodiscard]] std::shared_ptr<LocalView> build_view(const Map& map, KeyframeId focus,
                                                    std::span<const KeyframeId> poses_of,
                                                    const ViewConfig& config);

}  // namespace ygslam
