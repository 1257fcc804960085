// Bundle adjustment of the whole map as a job of its own: made from the map, solved by any thread
// while the map goes on, its result a patch.
#pragma once

#include <atomic>
#include <optional>

#include "map/map_patch.hpp"
#include "mapping/bundle_window.hpp"

namespace ygslam {

struct FullAdjustment {
  BundleWindow window;
  MapPatch patch;  ///< poses and points as they were, corrected ones still to come
};

/// @param map not empty.
[[nodiscard]] FullAdjustment make_full_adjustment(const Map& map, const NoiseConfig& noise);

/// @param abort set by another thread to give up.
/// @return nullopt where given up, or where nothing better was found.
[[nodiscard]] std::optional<MapPatch> solve(const Camera& camera, FullAdjustment job,
                                            const BundleConfig& config,
                                            const std::atomic<bool>* abort = nullptr);

}  // namespace ygslam
