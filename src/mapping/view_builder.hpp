// Cuts the tracker's local view out of the map.
#pragma once

#include "map/local_view.hpp"
#include "map/map.hpp"

namespace ygslam {

struct ViewConfig {
  int keyframes = 30;        ///< around the newest
  int recent_keyframes = 8;  ///< also kept, for relocalisation
  int landmarks = 6000;      ///< at most; those of nearer keyframes first
};

[[nodiscard]] LocalViewPtr build_view(const Map& map, KeyframeId newest, std::uint64_t version,
                                      const ViewConfig& config);

}  // namespace ygslam
