#include "bag/bag_imu.hpp"

#include <algorithm>
#include <cmath>

#include "bag/imu_messages.hpp"
#include "core/log.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMostReadings = 20'000'000;  // 27 hours at 200 Hz
constexpr std::size_t kMostImuTopics = 1000;
constexpr double kMostImuNumber = 1e5;
constexpr std::int64_t kMostGap_ns = 50'000'000;  // between accelerations that are interpolated

using ImuSources = std::map<std::string, ImuReader::Source>;

Vec3 from_ros_vector(const ros::Vector3& v) { return {v.x, v.y, v.z}; }

bool is_sensible(const Vec3& v) {
  return v.allFinite() && v.cwiseAbs().maxCoeff() <= kMostImuNumber;
}

std::optional<ImuSample> sensible_reading(const ros::Imu& imu, Timestamp logged) {
  const Timestamp stamp = ros::from_ros(imu.header.stamp);
  const ImuSample sample{stamp.ns == 0 ? logged : stamp, from_ros_vector(imu.angular_velocity),
                         from_ros_vector(imu.linear_acceleration)};
  const bool is_good =
      is_sensible(sample.angular_velocity_radps) && is_sensible(sample.specific_force_mps2);
  return is_good ? std::optional(sample) : std::nullopt;
}

bool is_all_zero(const std::vector<ImuSample>& samples, Vec3 ImuSample::*vector) {
  return std::all_of(samples.begin(), samples.end(),
                     [&](const ImuSample& sample) { return (sample.*vector).isZero(0); });
}
bool has_half(const std::vector<ImuSample>& samples, Vec3 ImuSample::*there) {
  Vec3 ImuSample::*other = there == &ImuSample::angular_velocity_radps
                               ? &ImuSample::specific_force_mps2
                               : &ImuSample::angular_velocity_radps;
  return !is_all_zero(samples, there) && is_all_zero(samples, other);
}

/// Readings of the gyroscope with accelerations between those of the accelerometer.
std::vector<ImuSample> united(const std::vector<ImuSample>& gyro,
                              const std::vector<ImuSample>& accel) {
  std::vector<ImuSample> samples;
  for (ImuSample sample : gyro) {
    const auto after = std::ranges::lower_bound(accel, sample.stamp, {}, &ImuSample::stamp);
    if (after == accel.end()) break;
    if (after->stamp == sample.stamp) {
      sample.specific_force_mps2 = after->specific_force_mps2;
    } else {
      if (after == accel.begin()) continue;
      const ImuSample& a = *(after - 1);
      const std::int64_t gap_ns = after->stamp.ns - a.stamp.ns;
      if (gap_ns > kMostGap_ns) continue;
      const double share =
          static_cast<double>(sample.stamp.ns - a.stamp.ns) / static_cast<double>(gap_ns);
      sample.specific_force_mps2 =
          (1 - share) * a.specific_force_mps2 + share * after->specific_force_mps2;
    }
    samples.push_back(sample);
  }
  return samples;
}

/// "/imu (300 readings), ...".
std::string topics_listed(const ImuSources& sources) {
  constexpr std::size_t kMost = 8;
  std::string text;
  for (std::size_t i = 0; const auto& [name, source] : sources) {
    if (i == kMost) return text + ", ...";
    text += (i++ == 0 ? "" : ", ") + printable(name) + " (" +
            std::to_string(source.samples.size()) + " readings)";
  }
  return text;
}

}  // namespace

namespace ros {

Imu to_ros(const ImuSample& sample, const ImuNoise& noise, const std::string& frame) {
  Imu message;
  message.header = {to_ros(sample.stamp), frame};
  const Vec3 &w = sample.angular_velocity_radps, &a = sample.specific_force_mps2;
  message.angular_velocity = {w.x(), w.y(), w.z()};
  message.linear_acceleration = {a.x(), a.y(), a.z()};
  for (std::size_t i = 0; i < 9; i += 4) {
    message.angular_velocity_covariance[i] =
        noise.gyro_noise_radps_sqrthz * noise.gyro_noise_radps_sqrthz * noise.rate_hz;
    message.linear_acceleration_covariance[i] =
        noise.accel_noise_mps2_sqrthz * noise.accel_noise_mps2_sqrthz * noise.rate_hz;
  }
  return message;
}

}  // namespace ros

bool is_imu(const BagTopic& topic) { return topic.type == "sensor_msgs/Imu"; }

std::optional<ImuSample> reading_of(const BagTopic& topic, const BagMessage& message) {
  ros::Imu imu;
  if (!is_imu(topic) || !from_cdr(message.bytes, imu, topic.layout)) return std::nullopt;
  return sensible_reading(imu, message.logged);
}

std::vector<ImuSample> in_order_of_time(std::vector<ImuSample> samples) {
  std::ranges::stable_sort(samples, {}, &ImuSample::stamp);
  const auto doubles = std::ranges::unique(samples, {}, &ImuSample::stamp);
  samples.erase(doubles.begin(), doubles.end());
  return samples;
}

ImuDoubt doubt_about_topic(const std::vector<ImuSample>& samples) {
  if (has_half(samples, &ImuSample::specific_force_mps2))
    return {"an accelerometer alone; no angular velocity", true};
  return doubt_about(samples, true);
}

void ImuReader::take(const BagTopic& topic, const BagMessage& message) {
  ros::Imu imu;
  if (!is_imu(topic) || !from_cdr(message.bytes, imu, topic.layout)) return;
  if (sources_.size() >= kMostImuTopics && !sources_.contains(topic.name)) return;
  Source& source = sources_[topic.name];
  const auto sample = count_ < kMostReadings ? sensible_reading(imu, message.logged) : std::nullopt;
  if (!sample) {
    ++source.left_out;
    return;
  }
  ++count_;
  source.samples.push_back(*sample);
}

Result<std::vector<ImuSample>> chosen_readings(const ImuSources& sources, const std::string& choice,
                                               std::string_view option) {
  const auto refuse = [](std::string text) { return Error{ErrorKind::kInput, std::move(text)}; };
  const std::string there = sources.empty() ? "" : "; there are " + topics_listed(sources);
  if (sources.empty()) return refuse("no topic with inertial readings (sensor_msgs/Imu)");
  auto found = choice.empty() ? sources.begin() : sources.find(choice);
  if (found == sources.end())
    return refuse("no readings under " + std::string(option) + " " + printable(choice) + there);
  std::string name = found->first;
  std::vector<ImuSample> samples = in_order_of_time(found->second.samples);
  std::size_t left_out = found->second.left_out;
  if (choice.empty() && sources.size() == 2) {
    const auto other = std::next(found);
    const std::vector<ImuSample> second = in_order_of_time(other->second.samples);
    const bool gyro_first = has_half(samples, &ImuSample::angular_velocity_radps);
    const auto& gyro = gyro_first ? samples : second;
    const auto& accel = gyro_first ? second : samples;
    if (has_half(gyro, &ImuSample::angular_velocity_radps) &&
        has_half(accel, &ImuSample::specific_force_mps2)) {
      log::info("{} and {}: halves of one sensor; accelerations are interpolated",
                printable(found->first), printable(other->first));
      samples = united(gyro, accel);
      left_out += other->second.left_out;
      name += " and " + other->first;
      found = sources.end();
    }
  }
  if (choice.empty() && found != sources.end() && sources.size() > 1)
    return refuse("several topics have inertial readings: " + topics_listed(sources) +
                  "; choose with " + std::string(option));
  if (left_out > 0) log::warn("{}: {} readings are left out", printable(name), left_out);
  if (samples.empty()) return refuse(printable(name) + ": no readings in it");
  const ImuDoubt doubt = doubt_about_topic(samples);
  if (doubt.is_fault)
    return refuse(printable(name) + ": " + doubt.what +
                  (has_half(samples, &ImuSample::specific_force_mps2) ? there : ""));
  if (!doubt.what.empty()) log::warn("{}: {}", printable(name), doubt.what);
  return samples;
}

Result<std::vector<ImuSample>> read_bag_imu(const std::filesystem::path& path,
                                            const std::string& choice, std::string_view option) {
  auto bag = open_bag(path);
  if (!bag.ok()) return bag.error();
  ImuReader reader;
  const Status visited = (*bag)->visit(
      [&](const BagMessage& message) { reader.take((*bag)->topics()[message.topic], message); },
      {});
  if (!visited.ok()) return visited.error();
  for (const std::string& warning : (*bag)->warnings()) log::warn("{}", warning);
  auto samples = chosen_readings(reader.sources(), choice, option);
  if (!samples.ok())
    return Error{ErrorKind::kInput, path.string() + ": " + samples.error().message};
  return samples;
}

}  // namespace ygslam
