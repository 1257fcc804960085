// How far the corners of a saved map lie from where they belong, on a sequence with exact truth:
// the keyframes are put where they truly were, each landmark where its observations then have it,
// and what is left of each observation is the noise of its corner. NoiseConfig goes by it.
//
//   corner_noise SEQ/calibration.txt RUN.map SEQ/groundtruth.txt > noise.csv
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <vector>

#include "eval/alignment.hpp"
#include "geometry/camera.hpp"
#include "io/calibration.hpp"
#include "io/trajectory_formats.hpp"
#include "map_file/map_file.hpp"
#include "mapping/bundle_window.hpp"

namespace {

using namespace ygslam;

constexpr double kMaxApart_s = 0.005;

struct Corners {
  int octave = 0;
  bool outline = false;  ///< where surfaces at different depths meet
  auto operator<=>(const Corners&) const = default;
};

/// Errors [px at the corner's own level of the pyramid].
std::map<Corners, std::vector<double>> errors_by_kind(const Camera& camera, const Map& map,
                                                      const BundleWindow& window,
                                                      const BundleResult& adjusted) {
  std::map<Corners, std::vector<double>> errors;
  std::size_t next = 0;  // the window's observations are in the order of its landmarks
  for (const LandmarkId id : window.landmarks) {
    for (const LandmarkObservation& o : map.landmark(id).observations) {
      const BundleObservation& stated = window.problem.observations.at(next++);
      const Feature& feature = map.keyframe(o.keyframe).data->features->points[o.feature];
      const Vec3 p_camera =
          adjusted.T_camera_world[stated.pose] * adjusted.points_world[stated.point];
      if (p_camera.z() < 0.1) continue;
      errors[{feature.octave, feature.on_depth_edge}].push_back(
          (stated.seen.ideal_px - camera.project(p_camera)).norm() /
          map.scales().of(feature.octave));
    }
  }
  return errors;
}

/// Puts the poses where they truly were and holds them. @return false if the truth lacks them.
bool place_by_truth(const Map& map, const std::vector<StampedPose>& truth, BundleWindow& window) {
  std::vector<StampedPose> estimate;
  for (const KeyframeId id : window.keyframes) {
    const Keyframe& keyframe = map.keyframe(id);
    estimate.push_back({keyframe.data->stamp, keyframe.T_camera_world.inverse()});
  }
  const PosePairs pairs = associate(truth, estimate, kMaxApart_s);
  if (pairs.size() != estimate.size()) return false;
  const SE3 T_truth_local =
      align_with_orientations(pairs).T_truth_estimate * window.T_local_world.inverse();
  for (std::size_t i = 0; i < pairs.size(); ++i)
    window.problem.poses[i] = {pairs.truth[i].T_world_camera.inverse() * T_truth_local, true};
  return true;
}

int measure(const std::string& calibration, const std::string& file, const std::string& poses) {
  const auto config = read_calibration(calibration);
  if (!config.ok()) return std::fprintf(stderr, "%s\n", config.error().message.c_str()), 3;
  const auto map = load_map(file);
  if (!map.ok()) return std::fprintf(stderr, "%s\n", map.error().message.c_str()), 6;
  const auto truth = read_tum_trajectory(poses);
  if (!truth.ok()) return std::fprintf(stderr, "%s\n", truth.error().message.c_str()), 4;
  CameraConfig sized = *config;
  if (sized.height <= 0) sized.width = 640, sized.height = 480;
  const Camera camera(sized);
  BundleWindow window = make_whole_window(*map, NoiseConfig{});
  if (!place_by_truth(*map, *truth, window))
    return std::fprintf(stderr, "%s: not every keyframe has a pose\n", poses.c_str()), 4;
  const BundleResult adjusted = adjust_bundle(camera, window.problem, {.iterations_refine = 50});
  std::printf("octave,outline,observations,median_px,p80_px,p95_px\n");
  for (auto& [kind, errors] : errors_by_kind(camera, *map, window, adjusted)) {
    std::ranges::sort(errors);
    const auto quantile = [&](double q) {
      return errors[static_cast<std::size_t>(q * static_cast<double>(errors.size()))];
    };
    std::printf("%d,%d,%zu,%.3f,%.3f,%.3f\n", kind.octave, kind.outline ? 1 : 0, errors.size(),
                quantile(0.5), quantile(0.8), quantile(0.95));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Noise of the corners of a saved map, against exact truth");
  std::string calibration, map, truth;
  app.add_option("calibration", calibration, "Of the sequence")->required();
  app.add_option("map", map, "Of `ygslam run --save-map`")->required();
  app.add_option("truth", truth, "True trajectory")->required();
  CLI11_PARSE(app, argc, argv);
  return measure(calibration, map, truth);
}
