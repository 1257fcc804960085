// A keyframe: data that never changes, and a small state that the mapper changes.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/ids.hpp"
#include "core/time.hpp"
#include "features/feature.hpp"
#include "features/feature_grid.hpp"
#include "geometry/rolling_shutter.hpp"
#include "map/free_space_image.hpp"

namespace ygslam {

/// What was seen; shared between the map and every published view.
struct KeyframeData {
  KeyframeId id = kNoKeyframe;
  FrameId frame = kNoFrame;
  Timestamp stamp;
  FeaturesPtr features;
  FeatureGrid grid;
  FreeSpaceImage free_space{};
  ReadOut read_out{};  ///< that the features were brought to the middle instant with
};
using KeyframeDataPtr = std::shared_ptr<const KeyframeData>;

/// A relative-pose constraint to an older keyframe, measured by IMU or wheels: of a keyframe that
/// nothing known was seen from.
struct KeyframeMotion {
  KeyframeId from = kNoKeyframe;
  SE3 T_keyframe_from;
  Mat6 covariance{};  ///< of exp(error) T_keyframe_from [m, rad], translation first
};

struct Keyframe {
  KeyframeDataPtr data;
  SE3 T_camera_world;
  KeyframeId parent = kNoKeyframe;       ///< made before it; if that is culled, its parent
  std::vector<LandmarkId> landmarks;     ///< per feature, kNoLandmark where none
  std::vector<float> static_weight;      ///< per feature: how far it may be trusted to stand still
  std::map<KeyframeId, int> covisible;   ///< landmarks shared with each other keyframe
  std::optional<KeyframeMotion> motion;  ///< for this run: files do not have it

  [[nodiscard]] Vec3 position_world() const { return T_camera_world.inverse().t(); }
};

}  // namespace ygslam
