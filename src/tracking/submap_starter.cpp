#include "tracking/submap_starter.hpp"

#include <algorithm>

#include "tracking/keyframe_proposer.hpp"

namespace ygslam {
namespace {

constexpr double kLostBeforeSubmap_s = 1.0;
constexpr double kCoastingBeforeMap_s = 0.5;  // in which a place that is known would be found
constexpr double kCoveredShare = 0.5;
constexpr double kVouchedReach_m = 2;  // farther away the next room may look the same

}  // namespace

std::optional<double> SubmapStarter::consider(const FrameFeatures& seen, bool too_few_static,
                                              const LocalView& view,
                                              const std::optional<SE3>& T_last_world,
                                              double travelled_m) {
  if (!is_fit_for(kLostBeforeSubmap_s, seen, too_few_static, view, T_last_world))
    return std::nullopt;
  return view.placed ? std::min(travelled_m, kVouchedReach_m) : 0;
}

bool SubmapStarter::may_map_on(const FrameFeatures& seen, bool too_few_static,
                               const LocalView& view, const SE3& T_camera_world) {
  return is_fit_for(kCoastingBeforeMap_s, seen, too_few_static, view, T_camera_world);
}

bool SubmapStarter::is_fit_for(double seconds, const FrameFeatures& seen, bool too_few_static,
                               const LocalView& view, const std::optional<SE3>& T_last_world) {
  if (!enabled_ || view.empty()) return false;
  const Timestamp now = seen.frame->stamp;
  const bool fit = is_fit(seen, too_few_static, view, T_last_world);
  if (!fit || !fit_since_) fit_since_ = now;
  if (!fit || seconds_between(now, *fit_since_) < seconds) return false;
  fit_since_.reset();
  return true;
}

bool SubmapStarter::is_fit(const FrameFeatures& seen, bool too_few_static, const LocalView& view,
                           const std::optional<SE3>& T_last_world) const {
  // Points that came back only because there were too few others are no ground for a new world.
  const int usable = seen.usable_points(kMappedWeight);
  return usable >= min_points_ && !too_few_static &&
         !(T_last_world && is_covered(seen, usable, view, *T_last_world));
}

/// Seen from where the camera was last, most of it would stand in what was free: something came
/// before the lens, and it is not the world.
bool SubmapStarter::is_covered(const FrameFeatures& seen, int usable, const LocalView& view,
                               const SE3& T_last_world) const {
  const std::vector<LandmarkId> no_landmarks(seen.features->size(), kNoLandmark);
  const std::vector<std::uint8_t> none_known(seen.features->size(), 0);
  FreeSpaceConfig config = free_space_;
  config.min_landmarks = 0;  // the pose is a guess
  const auto in_free_space = find_free_space_violations(camera_, seen, no_landmarks, none_known,
                                                        view, T_last_world, config);
  return std::count(in_free_space.begin(), in_free_space.end(), 1) > kCoveredShare * usable;
}

}  // namespace ygslam
