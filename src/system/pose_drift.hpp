// How far odom and map may have drifted: what each pose's covariance against its points leaves out.
// Ground is as well known as that from which it was mapped, and less by the way to it, the more so
// the worse frames see their ground; a camera that sees known ground again knows what that does.
// What is lost on the way to a place found again, odom keeps (docs/inertial.md).
#pragma once

#include <map>
#include <optional>

#include "core/time.hpp"
#include "map/local_view.hpp"
#include "tracking/track_result.hpp"

namespace ygslam {

class PoseDrift {
 public:
  /// Every frame in turn. @param view that it was tracked in.
  [[nodiscard]] PoseDoubt step(Timestamp stamp, const TrackResult& result, const LocalView& view);
  /// How many keyframes' ground is kept: at most 8,192.
  [[nodiscard]] std::size_t grounds() const { return grounds_.size(); }
  void reset() { *this = PoseDrift(); }

 private:
  [[nodiscard]] Doubt way_over(const SE3& T) const;
  void see(Timestamp stamp, const TrackResult& result);
  [[nodiscard]] Doubt ground_of(KeyframeId reference, const LocalView& view);
  [[nodiscard]] Doubt mapped_ground(KeyframeId keyframe, const LocalView& view);
  void forget_some();
  void come_back(Timestamp stamp);
  [[nodiscard]] Doubt in_map() const;

  // Of keyframes that frames were told by; of a long run every second, every fourth, ...
  std::map<KeyframeId, Doubt> grounds_;
  Doubt ground_;  // that the last frame with a pose saw
  Doubt odom_;
  Doubt seen_;                 // of a frame's pose against its points, mean of the last
  KeyframeRelativePose pose_;  // of that frame
  SE3 T_odom_camera_;
  Doubt coasted_there_;   // to ground that no keyframe shows yet
  bool by_view_ = false;  // its place is known by what it sees alone
  std::optional<Timestamp> last_seen_;
  std::optional<Mat6> coasted_;  // covariance of the last frame that coasted
  bool was_lost_ = false;
};

}  // namespace ygslam
