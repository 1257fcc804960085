#include "app/imu_input.hpp"

#include "bag/bag_imu.hpp"
#include "core/counted.hpp"
#include "io/imu_calibration.hpp"
#include "io/imu_file.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;

bool is_there(const fs::path& path) {
  std::error_code code;
  return fs::exists(path, code);
}

Result<ImuInput> used(Result<std::vector<ImuSample>> samples, const fs::path& calibration,
                      const std::string& source) {
  if (!samples.ok()) return samples.error();
  auto read = read_imu_calibration(calibration);
  if (!read.ok()) return read.error();
  ImuInput imu{*read, std::move(samples).value(), {}};
  imu.told = fmt::format("{}: {}", source, counted(imu.samples.size(), "reading"));
  imu.told += " of the IMU; --imu none leaves them out";
  return imu;
}

}  // namespace

Result<ImuInput> open_imu(const RunOptions& o, const Sequence& sequence) {
  constexpr const char* kFiles = "imu.csv";
  constexpr const char* kPlace = "imu.yaml";
  const bool is_asked_for = !o.imu.empty() || !o.imu_calibration.empty();
  if (o.imu == "none" && !o.imu_calibration.empty())
    return Error{ErrorKind::kUsage, "--imu none: takes no --imu-calibration"};
  if (o.imu == "none") return ImuInput{};
  if (sequence.stream) {
    if (!is_asked_for) return ImuInput{};
    return Error{ErrorKind::kUsage, "--imu, --imu-calibration: not of a stream"};
  }
  const bool is_bag = ygslam::is_bag(o.sequence);
  const fs::path folder = o.sequence;
  fs::path calibration = o.imu_calibration;
  if (calibration.empty() && !is_bag) calibration = folder / kPlace;
  const bool names_file = !o.imu.empty() && (!is_bag || is_there(o.imu));
  const fs::path file = names_file ? fs::path(o.imu) : folder / kFiles;
  if (!is_asked_for && (is_bag || !is_there(file))) return ImuInput{};
  if (!is_asked_for && !is_there(calibration)) {
    ImuInput imu;
    imu.told = file.string() + ": not used: there is no " + kPlace +
               " that says where the IMU is (docs/inertial.md)";
    return imu;
  }
  if (calibration.empty())
    return Error{ErrorKind::kUsage,
                 "--imu " + o.imu + ": --imu-calibration FILE.yaml says where the IMU is"};
  if (is_bag && !names_file)
    return used(read_bag_imu(o.sequence, o.imu, "--imu"), calibration, o.sequence);
  return used(read_imu(file), calibration, file.string());
}

}  // namespace ygslam
