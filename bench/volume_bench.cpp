// volume_bench SEQUENCE [--frames N] [--stride N] [--voxels 0.05,0.02,0.01] [--laps N]
//
// What the dense volume costs on a recording with true poses, one thread, everything on: depth,
// colour, votes for objects, carving. Times are processor time of the thread.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>
#include <vector>

#include "core/rng.hpp"
#include "core/time.hpp"
#include "dense/ground_plan.hpp"
#include "volume/mesher.hpp"
#include "volume/reading.hpp"
#include "volume_bench_frames.hpp"

namespace ygslam::bench {
namespace {

constexpr double kPlansPerSecond = 4;  // more than live runs make (bench/plan_ghosts.py --live)

struct Options {
  std::string sequence;
  std::size_t frames = 60, stride = 4;
  std::vector<double> voxels_m{0.05, 0.02, 0.01};
  int laps = 0, threads = 1;
  double max_depth_m = 4.5, truncation_voxels = 3, truncation_sigmas = 3;
};

struct Times {
  std::vector<double> ms;
  [[nodiscard]] double at(double share) {
    if (ms.empty()) return 0;
    std::sort(ms.begin(), ms.end());
    return ms[std::min(static_cast<std::size_t>(share * static_cast<double>(ms.size())),
                       ms.size() - 1)];
  }
  [[nodiscard]] double mean() const {
    return std::accumulate(ms.begin(), ms.end(), 0.0) / static_cast<double>(ms.size());
  }
};

/// Numbers for things: every sixth cube of 60 cm is one, the same from every view.
Image<SceneObjectId> made_up_objects(const PosedFrame& frame, const Camera& camera) {
  constexpr double kThing_m = 0.6;
  Image<SceneObjectId> objects(camera.width(), camera.height(), kNoSceneObject);
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const float depth_m = frame.depth_m.at(u, v);
      if (depth_m <= 0) continue;
      const Vec3 p_world =
          frame.T_world_camera * camera.unproject(camera.undistort({u, v}), depth_m);
      const Eigen::Vector3i cube = (p_world / kThing_m).array().floor().cast<int>();
      const auto hash = static_cast<std::uint32_t>(cube.x() * 73856093 ^ cube.y() * 19349663 ^
                                                   cube.z() * 83492791);
      if (hash % 6 == 0) objects.at(u, v) = static_cast<SceneObjectId>(1 + hash / 6 % 199);
    }
  }
  return objects;
}

struct Views {
  std::vector<DepthView> views;
  std::vector<SE3> T_world_camera;
};

Views make_views(const PosedRecording& recording) {
  const Camera camera(recording.camera);
  Views made;
  Times times;
  for (const PosedFrame& frame : recording.frames) {
    const Image<SceneObjectId> objects = made_up_objects(frame, camera);
    const ScopedTimer timer;
    made.views.push_back(make_depth_view({frame.depth_m, frame.colour, objects, frame.movers},
                                         camera, frame.read_out));
    times.ms.push_back(timer.cpu_ms());
    made.T_world_camera.push_back(frame.T_world_camera);
  }
  std::printf("%zu frames; make_depth_view %.1f ms (p99 %.1f)\n", made.views.size(), times.at(0.5),
              times.at(0.99));
  return made;
}

double area_m2(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const auto p = [&](std::size_t i) { return mesh.vertices[t[i]].p_world; };
    area += 0.5 * static_cast<double>((p(1) - p(0)).cross(p(2) - p(0)).norm());
  }
  return area;
}

double megabytes(std::size_t bytes) { return static_cast<double>(bytes) / 1e6; }

void measure(const Views& input, double voxel_m, const Options& options) {
  VolumeConfig config;
  config.surface.voxel_m = voxel_m;
  config.preparation.max_depth_m = options.max_depth_m;
  config.surface.truncation_voxels = options.truncation_voxels;
  config.surface.truncation_sigmas = options.truncation_sigmas;
  config.threads = options.threads;
  Volume volume(config);
  Mesher mesher;
  PreparedView prepared;
  GroundPlan plan{GroundPlanConfig{}};
  plan.set_floor({Vec3::UnitZ(), 0, true});  // where recordings with a truth have it
  Times prepare, integrate, deintegrate, update, touched, planning, scanning;
  for (std::size_t i = 0; i < input.views.size(); ++i) {
    {
      const ScopedTimer timer;
      prepared.assign(input.views[i], config.preparation);
      prepare.ms.push_back(timer.cpu_ms());
    }
    {
      const ScopedTimer timer;
      const SeenSpace& seen = volume.integrate(input.views[i], input.T_world_camera[i]);
      integrate.ms.push_back(timer.cpu_ms());
      const ScopedTimer plan_timer;
      plan.observe(seen);
      plan.update(volume.space(), volume.take_changed_space());
      static_cast<void>(plan.grid());
      planning.ms.push_back(plan_timer.cpu_ms());
    }
    {
      const ScopedTimer timer;
      static_cast<void>(volume.observe(input.views[i], input.T_world_camera[i]));
      scanning.ms.push_back(timer.cpu_ms());
    }
    const ScopedTimer timer;
    touched.ms.push_back(mesher.update(volume));
    update.ms.push_back(timer.cpu_ms());
  }
  std::printf("\nvoxel %.0f mm\n", 1e3 * voxel_m);
  std::printf("  integrate        median %6.1f ms, p99 %6.1f (of it preparing %.1f)\n",
              integrate.at(0.5), integrate.at(0.99), prepare.at(0.5));
  std::printf("  mesh of changed  median %6.1f ms, p99 %6.1f (%.0f blocks)\n", update.at(0.5),
              update.at(0.99), touched.at(0.5));
  std::printf("  ground plan      median %6.1f ms, p99 %6.1f, %.1f MB\n", planning.at(0.5),
              planning.at(0.99), megabytes(plan.memory_bytes()));
  std::printf("  scan for it      median %6.1f ms, p99 %6.1f, of a frame that is no view\n",
              scanning.at(0.5), scanning.at(0.99));
  std::printf("  plan, share of a core at %g a second, each scanned: %.1f %%\n", kPlansPerSecond,
              0.1 * kPlansPerSecond * (planning.mean() + scanning.mean()));
  const ScopedTimer joining;
  const TriangleMesh joined = mesher.mesh(volume);
  const double joining_ms = joining.cpu_ms();
  const ScopedTimer meshing;
  const TriangleMesh mesh = volume_mesh(volume);
  std::printf("  whole mesh       %6.0f ms from nothing, %.0f ms from the blocks' meshes\n",
              meshing.cpu_ms(), joining_ms);
  const ScopedTimer reading;
  const SpaceCells cells = space_cells(volume);
  std::printf("  space cells      %6.0f ms, %zu cells\n", reading.cpu_ms(), cells.cells.size());
  const double area = area_m2(mesh);
  const std::size_t blocks = volume.surface().blocks().size();
  std::printf("  surface          %.1f m2, %zu vertices, %zu triangles, %zu blocks\n", area,
              mesh.vertices.size(), mesh.triangles.size(), blocks);
  std::printf(
      "  memory           %.1f MB: surface %.1f, space %.1f; per m2 %.3f; meshes kept %.1f\n",
      megabytes(volume.memory_bytes()), megabytes(volume.surface().memory_bytes()),
      megabytes(volume.space().memory_bytes()),
      megabytes(volume.memory_bytes()) / std::max(area, 1e-9), megabytes(mesher.memory_bytes()));
  if (joined.triangles != mesh.triangles) std::printf("  THE MESHES DIFFER\n");

  const std::uint64_t before = volume.fingerprint();
  const std::size_t bytes_before = volume.memory_bytes();
  Rng rng(1);
  for (int lap = 0; lap < options.laps; ++lap) {
    for (std::size_t i = 0; i < input.views.size(); ++i) {
      Vec6 error;
      for (int k = 0; k < 6; ++k) error[k] = rng.normal(0, k < 3 ? 0.003 : 0.001);
      volume.integrate(input.views[i], input.T_world_camera[i] * SE3::exp(error));
    }
  }
  if (options.laps > 0)
    std::printf(
        "  %d more laps     %.1f MB, %+.2f %%\n", options.laps, megabytes(volume.memory_bytes()),
        100.0 *
            (static_cast<double>(volume.memory_bytes()) / static_cast<double>(bytes_before) - 1));
  rng = Rng(1);
  for (int lap = 0; lap < options.laps; ++lap) {
    for (std::size_t i = 0; i < input.views.size(); ++i) {
      Vec6 error;
      for (int k = 0; k < 6; ++k) error[k] = rng.normal(0, k < 3 ? 0.003 : 0.001);
      volume.deintegrate(input.views[i], input.T_world_camera[i] * SE3::exp(error));
    }
  }
  if (volume.fingerprint() != before) std::printf("  THE LAPS LEFT SOMETHING BEHIND\n");
  for (std::size_t i = 0; i < input.views.size(); ++i) {
    const ScopedTimer timer;
    volume.deintegrate(input.views[i], input.T_world_camera[i]);
    deintegrate.ms.push_back(timer.cpu_ms());
  }
  std::printf("  deintegrate         median %6.1f ms; left: %zu and %zu blocks\n",
              deintegrate.at(0.5), volume.surface().blocks().size(),
              volume.space().blocks().size());
}

}  // namespace
}  // namespace ygslam::bench

int main(int argc, char** argv) {
  using namespace ygslam::bench;
  Options options;
  CLI::App app("Times and memory of the dense volume");
  app.add_option("sequence", options.sequence, "folder in TUM layout with groundtruth.txt")
      ->required();
  app.add_option("--frames", options.frames, "at most so many");
  app.add_option("--stride", options.stride, "every n-th frame")->check(CLI::PositiveNumber);
  app.add_option("--voxels", options.voxels_m, "voxel sizes [m]")->delimiter(',');
  app.add_option("--laps", options.laps, "times the frames are added once more, at noisy poses");
  app.add_option("--threads", options.threads, "that integrate");
  app.add_option("--max-depth", options.max_depth_m, "of surfaces [m]");
  app.add_option("--truncation-voxels", options.truncation_voxels, "of the signed distance, least");
  app.add_option("--truncation-sigmas", options.truncation_sigmas, "of the signed distance");
  CLI11_PARSE(app, argc, argv);
  const Views views = make_views(load_posed(options.sequence, options.stride, options.frames));
  for (const double voxel_m : options.voxels_m) measure(views, voxel_m, options);
  return 0;
}
