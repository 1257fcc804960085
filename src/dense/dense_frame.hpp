// What the dense map is given of a frame.
#pragma once

#include <compare>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/ids.hpp"
#include "dense/object_observation.hpp"
#include "dense/stored_view.hpp"
#include "geometry/rolling_shutter.hpp"
#include "geometry/se3.hpp"
#include "image/rgbd_frame.hpp"

namespace ygslam {

/// Names a dense view: a keyframe, or a frame between keyframes. Ascending in time.
struct DenseViewId {
  KeyframeId keyframe = kNoKeyframe;  ///< itself, or the newest one when the frame was taken
  std::uint32_t number = 0;           ///< 0: the keyframe, else of the frame after it

  DenseViewId() = default;
  DenseViewId(KeyframeId its_keyframe, std::uint32_t its_number = 0)  // NOLINT: a keyframe is one
      : keyframe(its_keyframe), number(its_number) {}
  auto operator<=>(const DenseViewId&) const = default;
};

/// A frame's place is told by a keyframe, so that it moves along where the map is corrected.
struct DenseAnchor {
  KeyframeId keyframe = kNoKeyframe;
  Timestamp stamp;  ///< of the keyframe
  SE3 T_camera_keyframe;
};

struct DenseFrame {
  DenseViewId id;  ///< of a frame that is no keyframe the number is the map's to give
  FramePtr frame;
  ReadOut read_out;
  GreyImage movers;                        ///< 255 where something moves or may move; empty = none
  GreyImage things;                        ///< 0 = none, i + 1 = detections[i]; empty = none
  std::vector<Detection> detections;       ///< of objects that stand about; at most kMaxDetections
  std::optional<DenseAnchor> anchor = {};  ///< none: it is a keyframe
  std::vector<MotionVotes> motion_votes = {};  ///< by detection; empty: not known
  int edge_px = 0;  ///< of `things`: so near the edge of a mask it is not sure what a pixel shows
};

/// A view's contribution as it is kept on disk; the poses of keyframes are the map's.
struct SavedView {
  DenseViewId id;
  Timestamp stamp;
  std::vector<ObjectObservation> things;
  std::shared_ptr<const StoredView> view;  ///< its objects are numbers of observations, from 1
  std::optional<DenseAnchor> anchor = {};  ///< none: it is a keyframe
};

/// A keyframe that the map dropped: what it was the anchor of has another from now on.
struct RemovedAnchor {
  KeyframeId id = kNoKeyframe;
  DenseAnchor now;  ///< its camera's; of no keyframe: what it showed is to be removed, too
};

/// What changed since the last one.
struct DenseUpdate {
  std::vector<DenseFrame> added;
  std::vector<RemovedAnchor> removed;
  /// Of the keyframes that have a place in the world: all of them.
  std::map<KeyframeId, SE3> T_world_camera;
};

}  // namespace ygslam
