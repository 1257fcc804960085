// Inertial readings out of bags.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bag/bag.hpp"
#include "core/result.hpp"
#include "geometry/imu.hpp"
#include "io/imu_checks.hpp"

namespace ygslam {

[[nodiscard]] bool is_imu(const BagTopic& topic);
/// @return nullopt: none of sensor_msgs/Imu, or of no sensible size.
[[nodiscard]] std::optional<ImuSample> reading_of(const BagTopic& topic, const BagMessage& message);

/// Stably by stamps; of equal ones the first.
[[nodiscard]] std::vector<ImuSample> in_order_of_time(std::vector<ImuSample> samples);
/// As doubt_about(), and whether one half of a sensor is missing. @param samples in order of time.
[[nodiscard]] ImuDoubt doubt_about_topic(const std::vector<ImuSample>& samples);

/// Collects readings, message by message: sensor_msgs/Imu.
class ImuReader {
 public:
  struct Source {
    std::vector<ImuSample> samples;
    std::size_t left_out = 0;  ///< not finite, of no sensible size, or more than are kept
  };
  void take(const BagTopic& topic, const BagMessage& message);
  /// By topic.
  [[nodiscard]] const std::map<std::string, Source>& sources() const { return sources_; }

 private:
  std::map<std::string, Source> sources_;
  std::size_t count_ = 0;
};

/// Readings in order of time, of equal stamps the first; what is doubtful is told in a warning.
/// Where gyroscope and accelerometer have topics of their own (RealSense: the other half of each
/// message is zero) the accelerations are interpolated at the gyroscope's stamps.
/// @param choice a topic; empty: the only one, or the only two that are halves.
/// @param option that chooses, for messages.
/// @return kInput with a reason alone: none, several, half a sensor, units that are plainly others.
[[nodiscard]] Result<std::vector<ImuSample>> chosen_readings(
    const std::map<std::string, ImuReader::Source>& sources, const std::string& choice,
    std::string_view option);

/// Reads through the whole bag. @return as above, with the path.
[[nodiscard]] Result<std::vector<ImuSample>> read_bag_imu(const std::filesystem::path& path,
                                                          const std::string& choice,
                                                          std::string_view option);

}  // namespace ygslam
