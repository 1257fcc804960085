// Inertial readings out of bags.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bag/bag.hpp"
#include "bag/motion_topics.hpp"
#include "core/result.hpp"
#include "geometry/imu.hpp"
#include "io/imu_checks.hpp"

namespace ygslam {

/// @return nullopt: none of sensor_msgs/Imu, or of no sensible size.
[[nodiscard]] std::optional<ImuSample> reading_of(const BagTopic& topic, const BagMessage& message);

/// Stably by stamps; of equal ones the first.
[[nodiscard]] std::vector<ImuSample> in_order_of_time(std::vector<ImuSample> samples);
/// As doubt_about() and fault_of_intervals(), and whether one half of a sensor is missing.
/// @param samples in order of time.
[[nodiscard]] ImuDoubt doubt_about_topic(const std::vector<ImuSample>& samples);

/// Collects readings, message by message: sensor_msgs/Imu.
class ImuReader {
 public:
  struct Source {
    std::vector<ImuSample> samples;
    std::size_t left_out =
        0;  ///< no message, not finite, of no sensible size, or more than are kept
  };
  void take(const BagTopic& topic, const BagMessage& message);
  /// By topic.
  [[nodiscard]] const std::map<std::string, Source>& sources() const { return sources_; }

 private:
  std::map<std::string, Source> sources_;
  std::size_t count_ = 0;
};

/// Whose readings are those of one sensor.
struct ImuTopics {
  std::string gyro;   ///< whole readings, unless the accelerometer has a topic of its own
  std::string accel;  ///< empty: none
  [[nodiscard]] bool are_halves() const { return !accel.empty(); }
};

/// @param sources what came so far. @param choice a topic, whose other half comes along; empty: the
/// only one, or the only two that are halves (RealSense: the other half of each message is zero, or
/// has a covariance of -1).
/// @param option that chooses, for messages. @return kInput with a reason alone: none, several.
[[nodiscard]] Result<ImuTopics> choose_imu(const std::map<std::string, ImuReader::Source>& sources,
                                           const std::string& choice, std::string_view option);

struct BagReadings {
  ImuTopics topics;
  std::vector<ImuSample> samples;  ///< in order of time, of equal stamps the first
};

/// What is doubtful is told in a warning, and what is sorted or left out. Accelerations of halves
/// are interpolated at the gyroscope's stamps.
/// @return as choose_imu(), and half a sensor, units or stamps that are plainly others.
[[nodiscard]] Result<BagReadings> chosen_readings(
    const std::map<std::string, ImuReader::Source>& sources, const std::string& choice,
    std::string_view option);

/// Reads through the whole bag, whose damage was told when it was opened as a sequence.
/// @return as above, with the path.
[[nodiscard]] Result<BagReadings> read_bag_imu(const std::filesystem::path& path,
                                               const std::string& choice, std::string_view option);

}  // namespace ygslam
