// Files that say where a sensor is and how it errs, as lines `key: value` (imu.yaml, odom.yaml).
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

/// Along each axis, between a sensor and its camera: more is another unit.
inline constexpr double kMostLever_m = 100;

struct SensorKey {
  std::string_view name, unit;
  double least, most;
  bool required;
};

/// A sensor's place is one pose, its other properties are numbers.
struct SensorYaml {
  std::string_view pose_key;
  SE3* pose;
  std::span<const SensorKey> keys;
  std::span<double* const> values;  ///< of each key
};

/// @return which of the keys were given; or kConfig naming file and line: an unknown key or one
/// that is given twice, no finite number, a value out of bounds, no unit quaternion, a key that is
/// missing.
[[nodiscard]] Result<std::vector<bool>> parse_sensor_yaml(std::string_view text,
                                                          const std::string& name,
                                                          const SensorYaml& yaml);
/// @return what is wrong with the word, naming the key, empty if nothing: no finite number, out of
/// bounds.
[[nodiscard]] std::string store_sensor_number(const SensorKey& key, std::string_view word,
                                              double& place);
/// The text of such a file. @return kConfig if it cannot be read.
[[nodiscard]] Result<std::string> read_sensor_yaml(const std::string& path);

[[nodiscard]] std::string format_sensor_number(const SensorKey& key, double value);
/// @param what the pose is, for the comment.
[[nodiscard]] std::string format_sensor_pose(std::string_view key, const SE3& pose,
                                             std::string_view what);

}  // namespace ygslam
