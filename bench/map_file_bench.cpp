// A map of many keyframes, made up: how large its file is, how long saving and loading take, and
// how much memory beside the map they need.
//
//   map_file_bench [--keyframes 5000] [--features 1000] [--file FILE]
//   map_file_bench --beside MAP SEQ/calibration.txt --keep    # far away in the map of a sequence
#include <malloc.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "core/rng.hpp"
#include "geometry/geometry_testing.hpp"
#include "geometry/random_vector.hpp"
#include "io/calibration.hpp"
#include "map/map_bytes.hpp"
#include "map_file/map_file.hpp"

namespace {

using namespace ygslam;
namespace fs = std::filesystem;

constexpr int kLevels = 8;
constexpr double kScale = 1.2;
constexpr int kWidth = 640, kHeight = 480;
constexpr int kSightings = 8;         // keyframes that see a landmark
constexpr double kWithLandmark = .6;  // of the features
constexpr float kRawPerMetre = 5000;  // depth comes in whole units

constexpr double kFarAway_m = 200;

struct Options {
  int keyframes = 5000;
  int features = 1000;
  std::string file = "map_file_bench.map";
  bool keep = false;
  std::vector<std::string> beside;  ///< a map and its camera's calibration
  Camera camera = geometry_test::test_camera();
  Map start{{kLevels, kScale}};
};

/// Numbers as features have them: random descriptors, positions of a pyramid level's pixels with
/// a fraction, depth in whole raw units.
FeaturesPtr make_features(const Options& options, Rng& rng) {
  auto features = std::make_shared<Features>();
  for (int i = 0; i < options.features; ++i) {
    Feature f;
    f.octave = static_cast<std::uint8_t>(rng.below(kLevels));
    f.uv_px = {static_cast<float>(rng.uniform(16, kWidth - 17)),
               static_cast<float>(rng.uniform(16, kHeight - 17))};
    f.ideal_px = f.uv_px;
    f.depth_m = rng.uniform() < .85
                    ? static_cast<float>(rng.below(20'000) + 2'500) * (1 / kRawPerMetre)
                    : 0.0F;  // as image/depth reckons
    f.angle_rad = static_cast<float>(rng.uniform(0, 6.28));
    f.response = static_cast<float>(rng.uniform(5, 100));
    f.on_depth_edge = rng.uniform() < .25;
    Descriptor d;
    for (auto& bits : d.bits) bits = rng.next();
    features->points.push_back(f);
    features->descriptors.push_back(d);
  }
  return features;
}

FreeSpaceImage make_free_space(Rng& rng) {
  DepthImage depth_m(kWidth, kHeight);
  const double slope_u = rng.uniform(-1, 1) / kWidth;
  const double slope_v = rng.uniform(-1, 1) / kHeight;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u)
      depth_m.at(u, v) =
          std::round(static_cast<float>(2 + slope_u * u + slope_v * v + rng.uniform(0, .02)) *
                     kRawPerMetre) *
          (1 / kRawPerMetre);
  return FreeSpaceImage(depth_m);
}

Map make_map(const Options& options) {
  Rng rng(1);
  Map map = options.start;
  const KeyframeId before = map.keyframes().empty() ? kNoKeyframe : map.keyframes().rbegin()->first;
  const double x_m = before == kNoKeyframe ? 0 : kFarAway_m;
  const FreeSpaceImage free_space = make_free_space(rng);
  std::vector<LandmarkId> open;  // that will be seen again
  std::vector<int> sightings;
  for (int i = 0; i < options.keyframes; ++i) {
    const KeyframeId id = map.next_keyframe_id();
    auto data = std::make_shared<KeyframeData>();
    data->id = id;
    data->stamp.ns = std::int64_t{i} * 500'000'000;
    data->features = make_features(options, rng);
    data->grid = FeatureGrid(*data->features, options.camera.ideal_bounds());
    data->free_space = i % 16 == 0 ? make_free_space(rng) : free_space;
    Vec6 twist;
    twist << rng.uniform(-20, 20), rng.uniform(-1, 1), rng.uniform(-20, 20), rng.normal(),
        rng.normal(), rng.normal();
    const auto n = data->features->size();
    std::vector<float> weight(n);
    for (float& w : weight) w = rng.uniform() < .8 ? 1.0F : static_cast<float>(rng.uniform());
    map.add_keyframe(std::move(data), SE3::exp(twist) * SE3(Mat3::Identity(), Vec3(-x_m, 0, 0)),
                     i == 0 ? before : KeyframeId{index(id) - 1}, std::move(weight));
    const auto wanted = static_cast<std::uint32_t>(kWithLandmark * static_cast<double>(n));
    std::size_t next = 0;
    for (std::uint32_t k = 0; k < wanted; ++k) {
      if (next < open.size()) {
        const bool added = map.add_observation(open[next], id, k);
        CHECK(added);
        map.count_seen(open[next], 5, 4);
        ++sightings[next++];
        continue;
      }
      const Vec3 p = random_in_box<3>(rng, {-20, -2, -20}, {20, 2, 20}) + Vec3(x_m, 0, 0);
      open.push_back(map.add_landmark(p, id, k));
      sightings.push_back(1);
      ++next;
    }
    std::size_t kept = 0;
    for (std::size_t j = 0; j < open.size(); ++j) {
      // The first sightings end at random, so that landmarks come and go in every keyframe.
      const bool goes_on = sightings[j] < kSightings && (i > 0 || rng.uniform() < .875);
      if (!goes_on) continue;
      open[kept] = open[j];
      sightings[kept++] = i == 0 ? 1 + static_cast<int>(rng.below(kSightings - 1)) : sightings[j];
    }
    open.resize(kept);
    sightings.resize(kept);
  }
  return map;
}

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double memory_mb(const char* key) {  // of /proc/self/status
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (word == std::string(key) + ":") {
      double kB = 0;
      status >> kB;
      return kB / 1024;
    }
  return 0;
}

/// Runs the work in a child process: the highest memory is that of this work alone.
void apart(const std::function<void()>& work) {
  std::fflush(stdout);
  const pid_t child = ::fork();
  if (child == 0) {
    work();
    std::fflush(stdout);
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  if (status != 0) std::exit(1);
}

void make_and_save(const Options& options) {
  const Map map = make_map(options);
  malloc_trim(0);
  const double before_mb = memory_mb("VmRSS");
  std::ofstream("/proc/self/clear_refs") << 5;  // VmHWM counts from here
  Status saved = Ok{};
  const double save_s = seconds_of([&] { saved = save_map(options.file, map, options.camera); });
  if (!saved) std::printf("%s\n", saved.error().message.c_str()), ::_exit(1);
  std::size_t observations = 0;
  map.for_each_landmark([&](const Landmark& l) { observations += l.observations.size(); });
  std::printf("map: %zu keyframes, %zu landmarks, %zu observations, %.0f MB in memory\n",
              map.keyframes().size(), map.landmark_count(), observations, before_mb);
  std::printf("file %.1f MB\n", static_cast<double>(fs::file_size(options.file)) / 1e6);
  std::printf("save %.2f s, peak memory %.2f of the map's\n", save_s,
              memory_mb("VmHWM") / before_mb);
}

void load(const Options& options) {
  std::optional<Result<Map>> map;
  const double load_s = seconds_of([&] {
    map = load_map(options.file, options.camera, {kLevels, kScale});
  });
  if (!map->ok()) std::printf("%s\n", map->error().message.c_str()), ::_exit(1);
  const double peak_mb = memory_mb("VmHWM");
  malloc_trim(0);
  std::printf("load %.2f s, peak memory %.2f of the map's (%.0f MB)\n", load_s,
              peak_mb / memory_mb("VmRSS"), peak_mb);
}

void write_while_running(const Options& options) {
  auto map = load_map(options.file, options.camera, {kLevels, kScale});
  auto writer = MapWriter::open(options.file, options.camera, {kLevels, kScale});
  if (!map || !writer) ::_exit(1);
  const auto tell = [&](const char* what) {
    Status written = Ok{};
    const double s = seconds_of([&] { written = writer->write(*map); });
    std::printf("writer: %s %.2f s%s\n", what, s, written ? "" : " FAILED");
  };
  tell("first write (all rows compared)");
  tell("nothing changed");
  std::vector<KeyframeId> newest;  // made up: those of another map lie before them
  for (auto at = map->keyframes().rbegin(); at != map->keyframes().rend() && newest.size() < 10;
       ++at)
    newest.push_back(at->first);
  for (const KeyframeId id : newest)
    map->set_pose(id, SE3::exp(Vec6::Constant(.01)) * map->keyframe(id).T_camera_world);
  for (std::uint32_t i = 0; i < 2000; ++i)
    if (map->has_landmark(LandmarkId{i})) map->count_seen(LandmarkId{i}, 1, 1);
  tell("10 poses and 2000 landmarks changed");
  if (!writer->close()) ::_exit(1);
}

/// @return false if the map or its camera cannot be read.
bool start_beside(Options& options) {
  const auto config = read_calibration(options.beside[1]);
  const auto map = load_map(options.beside[0]);
  if (!config.ok() || !map.ok()) return false;
  CameraConfig sized = *config;
  if (sized.height <= 0) sized.width = kWidth, sized.height = kHeight;
  options.camera = Camera(sized);
  options.start = *map;
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{"Saves and loads a map that is made up"};
  app.add_option("--keyframes", options.keyframes)->check(CLI::PositiveNumber);
  app.add_option("--features", options.features, "of each keyframe")->check(CLI::PositiveNumber);
  app.add_option("--file", options.file, "made, and removed in the end");
  app.add_flag("--keep", options.keep, "Leave the file");
  app.add_option("--beside", options.beside, "a map, and the calibration of its camera")
      ->expected(2);
  CLI11_PARSE(app, argc, argv);
  if (!options.beside.empty() && !start_beside(options))
    return std::fprintf(stderr, "%s: cannot be read\n", options.beside[0].c_str()), 4;
  apart([&] { make_and_save(options); });
  apart([&] { load(options); });
  apart([&] { write_while_running(options); });
  std::error_code ignored;
  if (!options.keep) fs::remove(options.file, ignored);
}
