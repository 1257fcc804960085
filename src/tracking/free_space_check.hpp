// Free-space violations: points where keyframes saw empty space. Whatever lies there came since,
// moving now or not. The map finds in this way what flow cannot: a person who entered and stands, a
// thing put down, a thing so large that its motion looks like the camera's.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "geometry/camera.hpp"
#include "map/local_view.hpp"
#include "tracking/frame_features.hpp"
#include "tracking/observed_frame.hpp"
#include "tracking/pose_estimator.hpp"

namespace ygslam {

struct FreeSpaceConfig {
  bool enabled = true;
  int keyframes = 5;          ///< of the local view that are asked, from its reference on
  double margin_m = 0.10;     ///< nearer than what was seen by this ...
  double margin_ratio = 0.1;  ///< ... and this share of its depth
  int min_landmarks = 15;     ///< fewer points on the map: the pose is not sure enough to judge by
};

/// @param landmarks per feature: what it agreed with in the map. Those stand where the map says;
/// where many of them would violate it too, the pose or the map is wrong and only `known` counts.
/// @param known per feature: violates it already, unless a surface was seen there before.
/// @return per feature 1 = violates free space.
[[nodiscard]] std::vector<std::uint8_t> find_free_space_violations(
    const Camera& camera, const FrameFeatures& frame, std::span<const LandmarkId> landmarks,
    std::span<const std::uint8_t> known, const LocalView& view, const SE3& T_camera_world,
    const FreeSpaceConfig& config);

/// The final labels: what agrees with the map is static, what stands where it saw empty space is
/// new.
[[nodiscard]] ObservedFrame compared_with_map(ObservedFrame now, const PoseResult& pose,
                                              const LocalView& view, const Camera& camera,
                                              const PointClassifier& classifier,
                                              const FreeSpaceConfig& config);

}  // namespace ygslam
