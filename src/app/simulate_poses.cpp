#include "app/simulate_poses.hpp"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <locale>
#include <optional>
#include <sstream>

#include "app/standard_streams.hpp"
#include "app/stop_signal.hpp"

namespace ygslam {
namespace {

constexpr double kLongest_s = 1e6;
constexpr double kFarthest_m = 1000;
constexpr double kNotOne = 1e-2;  // of a quaternion's norm

struct TimedPose {
  double t_s = 0;
  SE3 T_world_camera;
};

std::optional<TimedPose> parse(const std::string& line) {
  std::istringstream words(line);
  words.imbue(std::locale::classic());
  double t_s = 0, x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 0;
  std::string rest;
  if (!(words >> t_s >> x >> y >> z >> qx >> qy >> qz >> qw) || words >> rest) return std::nullopt;
  const Vec3 at(x, y, z);
  const Eigen::Quaterniond q(qw, qx, qy, qz);
  if (!(t_s >= 0 && t_s <= kLongest_s && at.cwiseAbs().maxCoeff() <= kFarthest_m &&
        std::abs(q.norm() - 1) < kNotOne))
    return std::nullopt;
  return TimedPose{t_s, SE3(q, at)};
}

}  // namespace

Result<int> render_poses(const std::string& file, sim::SequenceSource& source,
                         SimulationOutputs& outputs) {
  std::ifstream opened;
  if (file != kStandardInput) opened.open(file);
  std::istream& lines = file == kStandardInput ? std::cin : opened;
  if (!lines) return Error{ErrorKind::kInput, file + ": cannot be read"};
  double last_s = -1;
  int done = 0, number = 0;
  for (std::string line; StopSignal::received() == 0 && std::getline(lines, line);) {
    ++number;
    if (line.empty() || line.front() == '#') continue;
    const auto pose = parse(line);
    const std::string where = file + ":" + std::to_string(number);
    if (!pose)
      return Error{ErrorKind::kInput,
                   where + ": 'seconds tx ty tz qx qy qz qw' with a unit quaternion is expected"};
    if (!(pose->t_s > last_s))
      return Error{ErrorKind::kInput, where + ": not later than the pose before"};
    last_s = pose->t_s;
    const sim::SimulatedFrame frame = source.next_from(pose->T_world_camera, pose->t_s);
    if (Status added = outputs.add(frame, source); !added.ok()) return added.error();
    print_text("{}.{:06}\n", frame.frame->stamp.ns / 1'000'000'000,
               frame.frame->stamp.ns / 1000 % 1'000'000);
    std::fflush(stdout);
    ++done;
    if (!outputs.show(frame, source)) break;
  }
  if (done == 0) return 0;
  if (Status finished = outputs.finish(source); !finished.ok()) return finished.error();
  return done;
}

}  // namespace ygslam
