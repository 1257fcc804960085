// All settings of the system; defaults live in the structs of the stages.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dense/dense_map.hpp"
#include "features/orb.hpp"
#include "geometry/imu.hpp"
#include "image/depth.hpp"
#include "loop/loop_closer.hpp"
#include "mapping/mapper.hpp"
#include "motion/classification/point_classifier.hpp"
#include "segment/model_segmenter.hpp"
#include "system/config_schema.hpp"
#include "tracking/tracker.hpp"

namespace ygslam {

struct RunConfig {
  std::uint64_t seed = 0;
  bool keep_trajectory = true;    ///< in memory, for the runner's outcome; the caller's, no setting
  std::string shutter_source;     ///< of the camera's times, for messages; the caller's, no setting
  int mask_delay_frames = 2;      ///< --deterministic delivers masks this many frames late
  double max_lost_share = 0.5;    ///< no pose in more of the frames: exit code 7
  double finish_patience_s = 20;  ///< live: for masks of the last keyframes
  double first_mask_timeout_s =
      3;  ///< live: how long the first frame may wait for its mask; 0 = not at all
  int file_mask_lag_frames = 4;  ///< frames out of a file wait for masks older than this; 0 = never
  std::vector<std::string> without;  ///< parts that are left out, see parts.hpp
};

struct SegmentConfig {
  ModelConfig network;
  bool fallback = true;  ///< live: a model that is too slow gives way (fallback_segmenter.hpp)
  std::vector<std::string> movable = {"person"};  ///< COCO names or groups
};

struct SlamConfig {
  RunConfig run;
  DepthConfig depth;
  OrbConfig orb;
  DynamicConfig dynamic;
  SegmentConfig segment;
  TrackerConfig tracking;
  MapperConfig mapping;
  LoopConfig loop;
  bool close_loops = true;
  DenseMapConfig dense;
  /// On the camera; of the recording or the robot, no setting. nullopt: there is none.
  std::optional<ImuCalibration> imu{};
  /// The robot that carries the camera. The caller's, no setting.
  std::optional<WheelCalibration> wheels{};
};

/// The table of all keys, bound to `config` (which must outlive it).
[[nodiscard]] ConfigSchema schema_of(SlamConfig& config);

/// With what follows from other settings: movable classes by name, one noise for tracking and
/// mapping, the parts left out. Keys stay as they were written; to resolve again changes nothing.
[[nodiscard]] Result<SlamConfig> resolved(SlamConfig config);

/// Everything that is wrong with the settings: values out of range and values that do not go
/// together. The one check; every way to a session passes it.
[[nodiscard]] Status validate(const SlamConfig& config);

/// kConfig where the dense map of a furnished room would not fit in memory with these voxels; the
/// default ones always pass.
[[nodiscard]] Status fits_in_memory(const DenseMapConfig& dense);

}  // namespace ygslam
