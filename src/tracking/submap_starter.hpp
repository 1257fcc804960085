// When a lost camera begins a submap: what it sees would do for a map, has done so for a while, and
// is not something that came before the lens.
#pragma once

#include <optional>

#include "tracking/free_space_check.hpp"

namespace ygslam {

class SubmapStarter {
 public:
  /// @param min_points static features with depth, fewer are no start.
  SubmapStarter(bool enabled, int min_points, const FreeSpaceConfig& free_space,
                const Camera& camera)
      : enabled_(enabled), min_points_(min_points), free_space_(free_space), camera_(camera) {}

  [[nodiscard]] bool enabled() const { return enabled_; }

  /// A frame whose place is not found.
  /// @param too_few_static points came back only because there were too few others.
  /// @param T_last_world where the camera was last, if it ever was somewhere.
  /// @param travelled_m how far it can have come since its place was certain.
  /// @return KeyframeCandidate::submap_reach_m where a submap begins with this frame.
  [[nodiscard]] std::optional<double> consider(const FrameFeatures& seen, bool too_few_static,
                                               const LocalView& view,
                                               const std::optional<SE3>& T_last_world,
                                               double travelled_m);
  /// The same of a frame whose place an IMU tells: mapping goes on there, in the same submap.
  [[nodiscard]] bool may_map_on(const FrameFeatures& seen, bool too_few_static,
                                const LocalView& view, const SE3& T_camera_world);
  /// The camera has a place again.
  void forget() { fit_since_.reset(); }

 private:
  [[nodiscard]] bool is_fit_for(double seconds, const FrameFeatures& seen, bool too_few_static,
                                const LocalView& view, const std::optional<SE3>& T_last_world);
  [[nodiscard]] bool is_fit(const FrameFeatures& seen, bool too_few_static, const LocalView& view,
                            const std::optional<SE3>& T_last_world) const;
  [[nodiscard]] bool is_covered(const FrameFeatures& seen, int usable, const LocalView& view,
                                const SE3& T_last_world) const;

  bool enabled_;
  int min_points_;
  FreeSpaceConfig free_space_;
  const Camera& camera_;
  std::optional<Timestamp> fit_since_;
};

}  // namespace ygslam
