// How late each row of the image looks in a saved map: of every landmark that a turning keyframe
// sees, how far it lies from where the map has it, along the way it moves through the image, and by
// how many milliseconds that is. A camera whose rows are read as the run believed gives zero.
//
//   row_residuals SEQ/calibration.txt RUN.map > residuals.csv
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "geometry/camera.hpp"
#include "io/calibration.hpp"
#include "map_file/map_file.hpp"

namespace {

using namespace ygslam;

constexpr int kBins = 24;               // of rows
constexpr double kLively_radps = 0.15;  // a slower camera tells next to nothing
constexpr double kMost_px = 5;          // farther off it is another corner

/// Weighted by how much each point tells: a time of a motion of m px per second has 1 / m^2.
struct Bin {
  double weight = 0, sum = 0;
  int points = 0;
};

void add(const Camera& camera, const Map& map, const Keyframe& keyframe,
         std::array<Bin, kBins>& bins) {
  const Vec6& velocity = keyframe.data->read_out.body_velocity;
  if (velocity.tail<3>().norm() < kLively_radps) return;
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (keyframe.landmarks[i] == kNoLandmark) continue;
    const Landmark& landmark = map.landmark(keyframe.landmarks[i]);
    if (landmark.observations.size() < 3) continue;
    const Feature& feature = keyframe.data->features->points[i];
    const Vec3 p = keyframe.T_camera_world * landmark.p_world;
    if (p.z() < 0.1) continue;
    const Vec3 moves_mps = -(velocity.head<3>() + velocity.tail<3>().cross(p));
    const Vec2 residual_px = feature.ideal_px.cast<double>() - camera.project(p);
    if (residual_px.norm() > kMost_px) continue;
    const Vec2 moves_pxps(camera.fx() * (moves_mps.x() - p.x() / p.z() * moves_mps.z()) / p.z(),
                          camera.fy() * (moves_mps.y() - p.y() / p.z() * moves_mps.z()) / p.z());
    const double share = (feature.uv_px.y() + 0.5) / camera.height();
    Bin& bin = bins[static_cast<std::size_t>(std::clamp(kBins * share, 0.0, kBins - 1.0))];
    bin.weight += moves_pxps.squaredNorm();
    bin.sum += residual_px.dot(moves_pxps);
    ++bin.points;
  }
}

int measure(const std::string& calibration, const std::string& file) {
  const auto config = read_calibration(calibration);
  if (!config.ok()) return std::fprintf(stderr, "%s\n", config.error().message.c_str()), 3;
  const auto map = load_map(file);
  if (!map.ok()) return std::fprintf(stderr, "%s\n", map.error().message.c_str()), 6;
  CameraConfig sized = *config;
  if (sized.height <= 0) sized.width = 640, sized.height = 480;
  const Camera camera(sized);
  std::array<Bin, kBins> bins;
  for (const auto& [id, keyframe] : map->keyframes()) add(camera, *map, keyframe, bins);
  std::printf("row_px,late_ms,points\n");
  for (std::size_t i = 0; i < bins.size(); ++i)
    if (bins[i].weight > 0)
      std::printf("%.1f,%.3f,%d\n", (static_cast<double>(i) + 0.5) * camera.height() / kBins,
                  1e3 * bins[i].sum / bins[i].weight, bins[i].points);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("How late each row of the image looks in a saved map");
  std::string calibration, file;
  app.add_option("calibration", calibration, "Of the recording")->required();
  app.add_option("map", file, "Of `ygslam run --save-map`")->required();
  CLI11_PARSE(app, argc, argv);
  return measure(calibration, file);
}
