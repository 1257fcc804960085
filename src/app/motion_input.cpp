#include "app/motion_input.hpp"

#include <algorithm>

#include "bag/bag_imu.hpp"
#include "bag/bag_trajectory.hpp"
#include "core/counted.hpp"
#include "core/log.hpp"
#include "io/frame_stream.hpp"
#include "io/imu_calibration.hpp"
#include "io/imu_checks.hpp"
#include "io/imu_file.hpp"
#include "io/text.hpp"
#include "io/wheel_calibration.hpp"
#include "io/wheel_file.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFromTf = "tf";
constexpr const char* kNotUsed = "none";

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

/// What a topic tells, and which it is.
template <typename Sample>
struct FromTopic {
  std::string topic;
  std::vector<Sample> samples;
};

/// An IMU, as its options and files are named, and as it is read.
struct ImuKind {
  using Input = ImuInput;
  using Place = ImuCalibration;
  using Samples = std::vector<ImuSample>;
  static constexpr const char *kOption = "--imu", *kPlaceOption = "--imu-calibration",
                              *kReadings = "imu.csv", *kPlaceFile = "imu.yaml",
                              *kPlaced = "the IMU", *kOf = "IMU", *kUnit = "reading";

  const RunOptions& o;
  [[nodiscard]] const std::string& source() const { return o.imu; }
  [[nodiscard]] const std::string& calibration() const { return o.imu_calibration; }
  static const std::vector<MotionTopic>& topics(const Sequence& s) { return s.imu_topics; }
  static Result<Samples> read_file(const fs::path& file) { return read_imu(file); }
  static Result<Place> read_place(const fs::path& file) { return read_imu_calibration(file); }
  static Place at(const SE3& T_frame_camera) {
    Place place;
    place.T_camera_imu = T_frame_camera.inverse();
    return place;
  }
  static std::string contradiction(const Place& place, const Samples& samples) {
    return doubt_about_rate(samples, place);
  }
  static Result<std::string> use(FrameStream& stream, const std::string& choice) {
    return stream.use_imu(choice);
  }
  static Result<FromTopic<ImuSample>> read_bag(const std::string& bag, const std::string& choice) {
    auto read = read_bag_imu(bag, choice, kOption);
    if (!read.ok()) return read.error();
    return FromTopic<ImuSample>{read->topics.gyro, std::move(read->samples)};
  }
};

/// The wheels of a robot.
struct WheelKind {
  using Input = WheelInput;
  using Place = WheelCalibration;
  using Samples = std::vector<OdometrySample>;
  static constexpr const char *kOption = "--odometry", *kPlaceOption = "--odometry-calibration",
                              *kReadings = "odom.csv", *kPlaceFile = "odom.yaml",
                              *kPlaced = "the camera", *kOf = "wheels", *kUnit = "pose";

  const RunOptions& o;
  [[nodiscard]] const std::string& source() const { return o.odometry; }
  [[nodiscard]] const std::string& calibration() const { return o.odometry_calibration; }
  static const std::vector<MotionTopic>& topics(const Sequence& s) { return s.odometry_topics; }
  static Result<Samples> read_file(const fs::path& file) { return read_wheels(file); }
  static Result<Place> read_place(const fs::path& file) { return read_wheel_calibration(file); }
  static Place at(const SE3& T_frame_camera) {
    Place place;
    place.T_base_camera = T_frame_camera;
    return place;
  }
  static std::string contradiction(const Place&, const Samples&) { return {}; }
  static Result<std::string> use(FrameStream& stream, const std::string& choice) {
    return stream.use_odometry(choice);
  }
  static Result<FromTopic<OdometrySample>> read_bag(const std::string& bag,
                                                    const std::string& choice) {
    auto read = read_bag_trajectory(bag, choice, kOption, Damage::kWasTold);
    if (!read.ok()) return read.error();
    auto samples = wheels_of_poses(read->poses);
    if (!samples.ok()) return Error{samples.error().kind, bag + ": " + samples.error().message};
    return FromTopic<OdometrySample>{read->topic, std::move(samples).value()};
  }
};

template <typename Kind>
typename Kind::Input unused_topic(const std::string& recording,
                                  const std::vector<MotionTopic>& topics) {
  const auto found = std::ranges::find(topics, false, &MotionTopic::is_camera);
  if (found == topics.end()) return {};
  const std::string topic = printable(found->name);
  const std::string place =
      found->T_frame_camera ? std::string() : fmt::format(" {} FILE.yaml", Kind::kPlaceOption);
  return {{},
          {},
          fmt::format("{}: {} may be of the {}: {} {}{} uses it (docs/inertial.md)", recording,
                      topic, Kind::kOf, Kind::kOption, topic, place)};
}

/// Nobody says where the sensor is. @param tf why the recording does not.
template <typename Kind>
Error no_place(ErrorKind error, const std::string& source, const std::string& tf) {
  return {error, fmt::format("{}: {}; {} FILE.yaml says where {} is", source, tf,
                             Kind::kPlaceOption, Kind::kPlaced)};
}

template <typename Kind>
Error takes_none() {
  return {ErrorKind::kUsage,
          fmt::format("{} none: takes no {}", Kind::kOption, Kind::kPlaceOption)};
}

/// @return null where it is not listed.
const MotionTopic* told_of(const std::string& name, const std::vector<MotionTopic>& topics) {
  const auto found = std::ranges::find(topics, name, &MotionTopic::name);
  return found == topics.end() ? nullptr : &*found;
}

/// Where it is: by the file that the options name, else as /tf_static of the recording says.
template <typename Kind>
Result<typename Kind::Place> place_of_topic(const Kind& kind, const std::string& topic,
                                            const Sequence& sequence) {
  const std::string& given = kind.calibration();
  if (!given.empty() && given != kFromTf) return Kind::read_place(given);
  const MotionTopic* found = told_of(topic, Kind::topics(sequence));
  if (!found) found = told_of(topic, sequence.moving_frames);
  if (found && found->T_frame_camera) return Kind::at(*found->T_frame_camera);
  const std::string why =
      found ? found->missing : printable(topic) + " tells of no frame of its own";
  if (given == kFromTf)
    return no_place<Kind>(ErrorKind::kConfig, fmt::format("{} tf", Kind::kPlaceOption), why);
  return no_place<Kind>(ErrorKind::kUsage, fmt::format("{} {}", Kind::kOption, printable(topic)),
                        why);
}

template <typename Kind>
bool is_by_tf(const Kind& kind) {
  return kind.calibration().empty() || kind.calibration() == kFromTf;
}

template <typename Kind>
std::string placed_text(const Kind& kind) {
  return is_by_tf(kind) ? fmt::format(", {} placed by /tf_static", Kind::kPlaced) : std::string();
}

/// What belongs to the images, or nothing with the reason.
template <typename Kind>
Result<typename Kind::Input> of_their_time(typename Kind::Place place,
                                           typename Kind::Samples samples, const std::string& from,
                                           const std::string& how, bool is_asked_for,
                                           const Sequence& sequence) {
  if (is_of_other_time(samples, sequence)) {
    const std::string fault = from + ": none of it is of the images' time";
    if (is_asked_for) return Error{ErrorKind::kInput, fault};
    return typename Kind::Input{{}, {}, fault + ": not used"};
  }
  if (const std::string doubt = Kind::contradiction(place, samples); !doubt.empty())
    log::warn("{}: {}", from, doubt);
  std::string told =
      fmt::format("{}: {} of the {}{}; {} none leaves them out", from,
                  counted(samples.size(), Kind::kUnit), Kind::kOf, how, Kind::kOption);
  return typename Kind::Input{std::move(place), std::move(samples), std::move(told)};
}

/// The topic of a stream, if it was announced with the first images.
template <typename Kind>
Result<typename Kind::Input> open_streamed(const Kind& kind, const Sequence& sequence) {
  using Input = typename Kind::Input;
  const std::string root = sequence.root.string();
  const std::string& source = kind.source();
  if (source.empty() && kind.calibration().empty())
    return unused_topic<Kind>(root, Kind::topics(sequence));
  const auto topic = Kind::use(*sequence.stream, source);
  if (!topic.ok() && is_there(source))
    return Error{ErrorKind::kUsage,
                 fmt::format("{} {}: a file; of a stream one of its topics is used", Kind::kOption,
                             printable(source))};
  if (!topic.ok())
    return Error{topic.error().kind,
                 root + ": " + topic.error().message + " (of what came before the first images)"};
  auto place = place_of_topic(kind, *topic, sequence);
  if (!place.ok()) return place.error();
  return Input{std::move(place).value(),
               {},
               fmt::format("{}: {}s of the {} come from {}{}", root, Kind::kUnit, Kind::kOf,
                           printable(*topic), placed_text(kind))};
}

/// A topic of the bag itself.
template <typename Kind>
Result<typename Kind::Input> open_recorded(const Kind& kind, const Sequence& sequence) {
  auto read = Kind::read_bag(kind.o.sequence, kind.source());
  if (!read.ok()) return read.error();
  auto place = place_of_topic(kind, read->topic, sequence);
  if (!place.ok()) return place.error();
  if (const auto* topic = told_of(read->topic, Kind::topics(sequence));
      topic && !topic->changed.empty())
    log::warn("{}: {}: {}", kind.o.sequence, printable(topic->name), topic->changed);
  return of_their_time<Kind>(std::move(place).value(), std::move(read->samples), kind.o.sequence,
                             placed_text(kind), true, sequence);
}

/// A folder without readings of its own.
template <typename Kind>
typename Kind::Input place_alone(const fs::path& folder) {
  const fs::path place_file = folder / Kind::kPlaceFile;
  if (!is_there(place_file)) return {};
  return {{},
          {},
          fmt::format("{}: not used: there is no {} beside it (docs/inertial.md)",
                      place_file.string(), Kind::kReadings)};
}

/// A file that is named, or of the folder.
template <typename Kind>
Result<typename Kind::Input> open_file(const Kind& kind, const Sequence& sequence) {
  using Input = typename Kind::Input;
  const fs::path folder = kind.o.sequence;
  const bool is_asked_for = !kind.source().empty() || !kind.calibration().empty();
  const fs::path file = kind.source().empty() ? folder / Kind::kReadings : fs::path(kind.source());
  if (!is_asked_for && !is_there(file)) return place_alone<Kind>(folder);
  if (kind.calibration() == kFromTf)
    return no_place<Kind>(ErrorKind::kUsage, fmt::format("{} tf", Kind::kPlaceOption),
                          file.string() + " is a file, which names no frame");
  const bool is_bag = ygslam::is_bag(folder);
  const fs::path place_file = !kind.calibration().empty() || is_bag ? fs::path(kind.calibration())
                                                                    : folder / Kind::kPlaceFile;
  if (!is_asked_for && !is_there(place_file))
    return Input{{},
                 {},
                 fmt::format("{}: not used: there is no {} that says where {} is "
                             "(docs/inertial.md)",
                             file.string(), Kind::kPlaceFile, Kind::kPlaced)};
  if (place_file.empty())
    return no_place<Kind>(ErrorKind::kUsage, fmt::format("{} {}", Kind::kOption, file.string()),
                          "a file, which names no frame");
  auto samples = Kind::read_file(file);
  if (!samples.ok()) return samples.error();
  auto place = Kind::read_place(place_file);
  if (!place.ok()) return place.error();
  return of_their_time<Kind>(std::move(place).value(), std::move(samples).value(), file.string(),
                             {}, is_asked_for, sequence);
}

template <typename Kind>
Result<typename Kind::Input> open_motion(const Kind& kind, const Sequence& sequence) {
  using Input = typename Kind::Input;
  const bool is_asked_for = !kind.source().empty() || !kind.calibration().empty();
  if (kind.source() == kNotUsed)
    return kind.calibration().empty() ? Result<Input>(Input{}) : takes_none<Kind>();
  if (sequence.stream) return open_streamed(kind, sequence);
  if (!is_bag(kind.o.sequence)) return open_file(kind, sequence);
  if (!is_asked_for) return unused_topic<Kind>(kind.o.sequence, Kind::topics(sequence));
  const bool names_file = !kind.source().empty() && is_there(kind.source());
  return names_file ? open_file(kind, sequence) : open_recorded(kind, sequence);
}

template <typename Kind>
WantedMotion::Sensor wanted(const Kind& kind) {
  const bool is_wanted =
      kind.source() != kNotUsed && !(kind.source().empty() && kind.calibration().empty());
  return {is_wanted, is_by_tf(kind), kind.source()};
}

}  // namespace

Result<ImuInput> open_imu(const RunOptions& o, const Sequence& sequence) {
  return open_motion(ImuKind{o}, sequence);
}

Result<WheelInput> open_wheels(const RunOptions& o, const Sequence& sequence) {
  return open_motion(WheelKind{o}, sequence);
}

WantedMotion wanted_motion(const RunOptions& o) {
  return {wanted(ImuKind{o}), wanted(WheelKind{o})};
}

}  // namespace ygslam
