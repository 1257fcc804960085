#include "app/motion_input.hpp"

#include <algorithm>

#include "bag/bag_imu.hpp"
#include "bag/bag_trajectory.hpp"
#include "core/counted.hpp"
#include "io/frame_stream.hpp"
#include "io/imu_calibration.hpp"
#include "io/imu_file.hpp"
#include "io/text.hpp"
#include "io/wheel_calibration.hpp"
#include "io/wheel_file.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;

bool is_there(const fs::path& path) {
  std::error_code code;
  return fs::exists(path, code) || fs::is_symlink(path, code);  // that leads nowhere: an error
}

/// By stamps; a sensor's clock may be off by seconds.
template <typename Sample>
bool is_of_other_time(const std::vector<Sample>& samples, const Sequence& sequence) {
  constexpr double kMostOffset_s = 10;
  if (samples.empty() || sequence.pairs.empty()) return false;
  return seconds_between(samples.front().stamp, sequence.pairs.back().stamp) > kMostOffset_s ||
         seconds_between(sequence.pairs.front().stamp, samples.back().stamp) > kMostOffset_s;
}

/// One of both kinds of sensors, as its options and files are named.
struct MotionNames {
  const char *option, *calibration_option;
  const char *readings, *place;  ///< files of a folder
  const char *what, *of;         ///< for messages
};
constexpr MotionNames kImuNames{"--imu",    "--imu-calibration", "imu.csv",
                                "imu.yaml", "the IMU",           "IMU"};
constexpr MotionNames kWheelNames{
    "--odometry", "--odometry-calibration", "odom.csv", "odom.yaml", "the camera", "wheels"};

std::string unused_topic(const std::string& recording, const MotionNames& names,
                         const std::string& topic) {
  return fmt::format("{}: {} may be of the {}: {} {} {} FILE.yaml uses it (docs/inertial.md)",
                     recording, printable(topic), names.of, names.option, printable(topic),
                     names.calibration_option);
}

Error no_place(const MotionNames& names, const std::string& source) {
  return {ErrorKind::kUsage, fmt::format("{} {}: {} FILE.yaml says where {} is", names.option,
                                         source, names.calibration_option, names.what)};
}

/// What the options say, checked.
struct MotionChoice {
  bool is_used = false;
  fs::path file{};  ///< empty: the bag
  std::string topic{};
  fs::path calibration{};
  std::string told{};
  bool is_asked_for = false;
};

/// @param topic of the bag; empty: it has none.
Result<MotionChoice> chosen(const MotionNames& names, const std::string& topic,
                            const std::string& source, const std::string& calibration,
                            const RunOptions& o) {
  const bool is_asked_for = !source.empty() || !calibration.empty();
  if (source == "none" && !calibration.empty())
    return Error{ErrorKind::kUsage,
                 fmt::format("{} none: takes no {}", names.option, names.calibration_option)};
  if (source == "none") return MotionChoice{};
  const bool is_bag = ygslam::is_bag(o.sequence);
  const fs::path folder = o.sequence;
  MotionChoice choice{true, {}, source, calibration, {}, is_asked_for};
  if (choice.calibration.empty() && !is_bag) choice.calibration = folder / names.place;
  const bool names_file = !source.empty() && (!is_bag || is_there(source));
  const fs::path file = names_file ? fs::path(source) : folder / names.readings;
  if (!is_asked_for && is_bag && !topic.empty())
    return MotionChoice{.told = unused_topic(o.sequence, names, topic)};
  if (!is_asked_for && (is_bag || !is_there(file))) return MotionChoice{};
  if (!is_asked_for && !is_there(choice.calibration))
    return MotionChoice{.told = file.string() + ": not used: there is no " + names.place +
                                " that says where " + names.what + " is (docs/inertial.md)"};
  if (choice.calibration.empty()) return no_place(names, source);
  if (!is_bag || names_file) choice.file = file;
  const std::string from = choice.file.empty() ? o.sequence : choice.file.string();
  choice.told = from + ": {} of the " + names.of + "; " + names.option + " none leaves them out";
  return choice;
}

template <typename Input, typename ReadFile, typename ReadBag, typename ReadPlace>
Result<Input> opened(const Result<MotionChoice>& choice, const Sequence& sequence, const char* unit,
                     const ReadFile& read_file, const ReadBag& read_bag,
                     const ReadPlace& read_place) {
  if (!choice.ok()) return choice.error();
  if (!choice->is_used) return Input{{}, {}, choice->told};
  auto samples = choice->file.empty() ? read_bag(choice->topic) : read_file(choice->file);
  if (!samples.ok()) return samples.error();
  if (is_of_other_time(*samples, sequence)) {
    const std::string fault = (choice->file.empty() ? sequence.root : choice->file).string() +
                              ": none of it is of the images' time";
    if (choice->is_asked_for) return Error{ErrorKind::kInput, fault};
    return Input{{}, {}, fault + ": not used"};
  }
  auto calibration = read_place(choice->calibration);
  if (!calibration.ok()) return calibration.error();
  Input input{*calibration, std::move(samples).value(), choice->told};
  input.told.replace(input.told.find("{}"), 2, counted(input.samples.size(), unit));
  return input;
}

Result<std::vector<OdometrySample>> read_bag_wheels(const std::string& bag,
                                                    const std::string& topic) {
  const auto trajectory = read_bag_trajectory(bag, topic, "--odometry");
  if (!trajectory.ok()) return trajectory.error();
  auto samples = wheels_of_poses(trajectory->poses);
  if (!samples.ok()) return Error{samples.error().kind, bag + ": " + samples.error().message};
  return samples;
}

std::string listed(const std::vector<std::string>& topics) {
  constexpr std::size_t kMost = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(topics.size(), kMost); ++i)
    text += (i == 0 ? "" : ", ") + printable(topics[i]);
  return topics.size() > kMost ? text + ", ..." : text;
}

/// What comes beside the images, if a topic of it was announced with the first of them.
Result<ImuInput> open_streamed_imu(const RunOptions& o, const Sequence& sequence) {
  const std::string root = sequence.root.string();
  const std::vector<std::string> topics = sequence.stream->imu_topics();
  if (o.imu.empty() && o.imu_calibration.empty())
    return topics.empty() ? ImuInput{}
                          : ImuInput{{}, {}, unused_topic(root, kImuNames, topics.front())};
  if (o.imu_calibration.empty()) return no_place(kImuNames, o.imu);
  if (o.imu.empty() && topics.size() > 1)
    return Error{ErrorKind::kInput, root + ": several topics have inertial readings: " +
                                        listed(topics) + "; choose with --imu"};
  const std::string topic = o.imu.empty() && !topics.empty() ? topics.front() : o.imu;
  auto calibration = read_imu_calibration(o.imu_calibration);
  if (!calibration.ok()) return calibration.error();
  if (std::ranges::find(topics, topic) == topics.end())
    return Error{ErrorKind::kInput,
                 root + ": no topic " + (topic.empty() ? "" : printable(topic) + " ") +
                     "with inertial readings (sensor_msgs/Imu) came before the first images"};
  sequence.stream->use_readings(topic);
  return ImuInput{*calibration, {}, root + ": readings of the IMU come from " + printable(topic)};
}

}  // namespace

Result<ImuInput> open_imu(const RunOptions& o, const Sequence& sequence) {
  if (sequence.stream && o.imu != "none") return open_streamed_imu(o, sequence);
  return opened<ImuInput>(
      chosen(kImuNames, sequence.imu_topic, o.imu, o.imu_calibration, o), sequence, "reading",
      [](const fs::path& file) { return read_imu(file); },
      [&](const std::string& topic) { return read_bag_imu(o.sequence, topic, "--imu"); },
      read_imu_calibration);
}

Result<WheelInput> open_wheels(const RunOptions& o, const Sequence& sequence) {
  if (sequence.stream && o.odometry != "none") {
    if (o.odometry.empty() && o.odometry_calibration.empty()) return WheelInput{};
    return Error{ErrorKind::kUsage, "--odometry, --odometry-calibration: not of a stream"};
  }
  return opened<WheelInput>(
      chosen(kWheelNames, sequence.odometry_topic, o.odometry, o.odometry_calibration, o), sequence,
      "pose", [](const fs::path& file) { return read_wheels(file); },
      [&](const std::string& topic) { return read_bag_wheels(o.sequence, topic); },
      read_wheel_calibration);
}

}  // namespace ygslam
