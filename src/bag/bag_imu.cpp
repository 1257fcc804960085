#include "bag/bag_imu.hpp"

#include <algorithm>
#include <cmath>
#include <ranges>

#include "bag/imu_halves.hpp"
#include "bag/imu_messages.hpp"
#include "core/counted.hpp"
#include "core/log.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMostReadings = 20'000'000;  // 27 hours at 200 Hz
constexpr std::size_t kMostImuTopics = 1000;
constexpr double kMostImuNumber = 1e5;

using ImuSources = std::map<std::string, ImuReader::Source>;

Vec3 from_ros_vector(const ros::Vector3& v) { return {v.x, v.y, v.z}; }

bool is_sensible(const Vec3& v) {
  return v.allFinite() && v.cwiseAbs().maxCoeff() <= kMostImuNumber;
}

std::optional<ImuSample> sensible_reading(const ros::Imu& imu, Timestamp logged) {
  const Timestamp stamp = ros::from_ros(imu.header.stamp);
  ImuSample sample{stamp.ns == 0 ? logged : stamp, from_ros_vector(imu.angular_velocity),
                   from_ros_vector(imu.linear_acceleration)};
  // A half is not there where its covariance begins with -1 (REP 145). Where both do, they mean
  // that their covariance is not known.
  const bool no_gyro = imu.angular_velocity_covariance[0] == -1;
  const bool no_accel = imu.linear_acceleration_covariance[0] == -1;
  if (no_gyro && !no_accel) sample.angular_velocity_radps.setZero();
  if (no_accel && !no_gyro) sample.specific_force_mps2.setZero();
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

constexpr auto kGyro = &ImuSample::angular_velocity_radps;
constexpr auto kAccel = &ImuSample::specific_force_mps2;

/// As "/camera/gyro/sample" and "/camera/accel/sample" do.
bool differ_in_one_part(std::string_view a, std::string_view b) {
  const auto parts_a = words_of(a, "/"), parts_b = words_of(b, "/");
  return parts_a.size() == parts_b.size() &&
         std::ranges::count(std::views::iota(std::size_t{0}, parts_a.size()), true,
                            [&](std::size_t i) { return parts_a[i] != parts_b[i]; }) == 1;
}

/// The topics with this half of a sensor alone.
std::vector<std::string> halves_of(const ImuSources& sources, Vec3 ImuSample::*half) {
  std::vector<std::string> names;
  for (const auto& [name, source] : sources)
    if (has_half(source.samples, half)) names.push_back(name);
  return names;
}

/// The other half of the sensor: the one whose name says so, or the only one for the only one.
/// @return empty: none.
std::string partner_of(const std::string& name, const std::vector<std::string>& same,
                       const std::vector<std::string>& others) {
  const auto is_like = [&](const std::string& other) { return differ_in_one_part(name, other); };
  if (std::ranges::count_if(others, is_like) == 1) return *std::ranges::find_if(others, is_like);
  return same.size() == 1 && others.size() == 1 ? others.front() : std::string();
}

/// With the other half, where it is one half of a sensor and the other has a topic as well.
ImuTopics with_its_half(const ImuSources& sources, const std::string& name) {
  const auto gyros = halves_of(sources, kGyro), accels = halves_of(sources, kAccel);
  ImuTopics topics{name, {}};
  if (std::ranges::find(gyros, name) != gyros.end()) {
    topics.accel = partner_of(name, gyros, accels);
  } else if (std::ranges::find(accels, name) != accels.end()) {
    if (const std::string gyro = partner_of(name, accels, gyros); !gyro.empty())
      topics = {gyro, name};
  }
  if (topics.are_halves())
    log::info("{} and {}: halves of one sensor; accelerations are interpolated",
              printable(topics.gyro), printable(topics.accel));
  return topics;
}

std::vector<ImuSample> united(const std::vector<ImuSample>& gyro,
                              const std::vector<ImuSample>& accel) {
  ImuHalves halves;
  std::vector<ImuSample> samples;
  std::size_t next = 0;
  for (const ImuSample& rate : gyro) {
    while (next < accel.size() && (next == 0 || accel[next - 1].stamp < rate.stamp))
      halves.add_accel(accel[next++]);
    halves.add_gyro(rate);
    const auto some = halves.take();
    samples.insert(samples.end(), some.begin(), some.end());
  }
  return samples;
}

/// As in_order_of_time(), with warnings.
std::vector<ImuSample> told_in_order(const std::vector<ImuSample>& samples,
                                     const std::string& topic) {
  if (!std::ranges::is_sorted(samples, {}, &ImuSample::stamp))
    log::warn("{}: stamps go back; readings are sorted by their stamps", printable(topic));
  std::vector<ImuSample> sorted = in_order_of_time(samples);
  if (sorted.size() < samples.size())
    log::warn("{}: {} with the stamp of another: left out", printable(topic),
              counted(samples.size() - sorted.size(), "reading"));
  return sorted;
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
  if (std::string fault = fault_of_intervals(samples); !fault.empty())
    return {std::move(fault), true};
  return doubt_about(samples, true);
}

void ImuReader::take(const BagTopic& topic, const BagMessage& message) {
  if (!is_imu(topic)) return;
  if (sources_.size() >= kMostImuTopics && !sources_.contains(topic.name)) return;
  Source& source = sources_[topic.name];
  const auto sample = count_ < kMostReadings ? reading_of(topic, message) : std::nullopt;
  if (!sample) {
    ++source.left_out;
    return;
  }
  ++count_;
  source.samples.push_back(*sample);
}

Result<ImuTopics> choose_imu(const ImuSources& sources, const std::string& choice,
                             std::string_view option) {
  const auto refuse = [](std::string text) { return Error{ErrorKind::kInput, std::move(text)}; };
  if (sources.empty()) return refuse("no topic with inertial readings (sensor_msgs/Imu)");
  if (!choice.empty() && !sources.contains(choice))
    return refuse("no readings under " + std::string(option) + " " + printable(choice) +
                  "; there are " + topics_listed(sources));
  if (!choice.empty()) return with_its_half(sources, choice);
  const std::string& first = sources.begin()->first;
  if (sources.size() == 1) return ImuTopics{first, {}};
  if (sources.size() == 2 && halves_of(sources, kGyro).size() == 1 &&
      halves_of(sources, kAccel).size() == 1)
    return with_its_half(sources, first);
  return refuse("several topics have inertial readings: " + topics_listed(sources) +
                "; choose with " + std::string(option));
}

Result<BagReadings> chosen_readings(const ImuSources& sources, const std::string& choice,
                                    std::string_view option) {
  const auto refuse = [](std::string text) { return Error{ErrorKind::kInput, std::move(text)}; };
  auto topics = choose_imu(sources, choice, option);
  if (!topics.ok()) return topics.error();
  const ImuReader::Source& whole = sources.at(topics->gyro);
  std::string name = printable(topics->gyro);
  std::vector<ImuSample> samples = told_in_order(whole.samples, topics->gyro);
  std::size_t left_out = whole.left_out;
  if (topics->are_halves()) {
    const ImuReader::Source& accel = sources.at(topics->accel);
    samples = united(samples, told_in_order(accel.samples, topics->accel));
    left_out += accel.left_out;
    name += " and " + printable(topics->accel);
  }
  if (left_out > 0)
    log::warn("{}: {} that cannot be used: left out", name, counted(left_out, "reading"));
  if (samples.empty()) return refuse(name + ": no readings in it");
  const ImuDoubt doubt = doubt_about_topic(samples);
  const bool lacks_gyro = has_half(samples, &ImuSample::specific_force_mps2);
  if (doubt.is_fault)
    return refuse(name + ": " + doubt.what +
                  (lacks_gyro ? "; there are " + topics_listed(sources) : ""));
  if (!doubt.what.empty()) log::warn("{}: {}", name, doubt.what);
  return BagReadings{std::move(topics).value(), std::move(samples)};
}

Result<BagReadings> read_bag_imu(const std::filesystem::path& path, const std::string& choice,
                                 std::string_view option) {
  auto bag = open_bag(path);
  if (!bag.ok()) return bag.error();
  ImuReader reader;
  const Status visited = (*bag)->visit(
      [&](const BagMessage& message) { reader.take((*bag)->topics()[message.topic], message); },
      {});
  if (!visited.ok()) return visited.error();
  auto samples = chosen_readings(reader.sources(), choice, option);
  if (!samples.ok())
    return Error{ErrorKind::kInput, path.string() + ": " + samples.error().message};
  return samples;
}

}  // namespace ygslam
