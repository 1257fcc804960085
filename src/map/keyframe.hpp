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

/// Where gravity pulls, as an IMU measured it in the camera of one frame.
struct MeasuredGravity {
  Vec3 down_camera = Vec3::UnitY();  ///< unit vector
  Mat3 covariance = Mat3::Zero();    ///< of it [rad^2]
};

/// How the camera has turned by a gyroscope alone, since a series of measurements began: the turn
/// between any two keyframes of the series.
struct MeasuredTurn {
  std::uint32_t series = 0;
  Mat3 R_camera_start = Mat3::Identity();
  double variance_rad2 = 0;  ///< since the start, of each axis, by noise
};

/// What was seen; shared between the map and every published view.
struct KeyframeData {
  KeyframeId id = kNoKeyframe;
  FrameId frame = kNoFrame;
  Timestamp stamp;
  FeaturesPtr features;
  FeatureGrid grid;
  FreeSpaceImage free_space{};
  ReadOut read_out{};  ///< that the features were brought to the middle instant with
  std::optional<MeasuredGravity> gravity{};  ///< for this run: files do not have it
  std::optional<MeasuredTurn> turn{};        ///< the same
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
