// A single image's place in a map.
#pragma once

#include <optional>

#include "system/runner.hpp"

namespace ygslam::api {

/// By what the frame shows alone. @param map stays as it is. @return T_world_camera.
[[nodiscard]] std::optional<SE3> place_in(const Map& map, const RgbdFrame& frame,
                                          const Camera& camera, SlamConfig config);

}  // namespace ygslam::api
