// What the inertial estimator costs a frame, one thread, and how far off it is without vision.
#include <benchmark/benchmark.h>

#include "core/statistics.hpp"
#include "inertial/estimator_test_world.hpp"

namespace ygslam::bench {
namespace {

// A frame with its samples and a prediction beforehand; making the samples is in it.
void BM_InertialFrame(benchmark::State& state) {
  inertial_world::DriveOptions options{.seed = 1};
  options.noise.rate_hz = static_cast<double>(state.range(0));
  inertial_world::Drive drive(options);
  drive.run(5);
  for (auto _ : state) {
    drive.advance();
    benchmark::DoNotOptimize(drive.estimator().predict(drive.now()));
    drive.estimator().add_frame(drive.now(), drive.seen_pose());
  }
}
BENCHMARK(BM_InertialFrame)->Arg(200)->Arg(400)->Unit(benchmark::kMicrosecond);

void BM_TimeOffset(benchmark::State& state) {
  const inertial_world::SmoothMotion motion(1);
  std::deque<ImuSample> samples;
  for (int i = -40; i < 900; ++i)
    samples.push_back(motion.reading({to_ns(i / 200.0)}, Vec3::Zero()));
  std::vector<SeenTurn> turns;
  for (int i = 0; i < 120; ++i) {
    const Timestamp from{to_ns(i / 30.0)}, to{to_ns((i + 1) / 30.0)};
    turns.push_back({from, to, motion.angular_velocity((i + 0.5) / 30.0) / 30.0});
  }
  for (auto _ : state) benchmark::DoNotOptimize(estimate_time_offset(turns, samples));
}
BENCHMARK(BM_TimeOffset)->Unit(benchmark::kMicrosecond);

// Of the table in docs/inertial.md. @param state tenths of a second without vision; liveliness.
void BM_Coasting(benchmark::State& state) {
  for (auto _ : state) {
    const auto found = inertial_world::coasted(0.1 * static_cast<double>(state.range(0)),
                                               {.liveliness = static_cast<double>(state.range(1))});
    state.counters["median_m"] = median(std::vector(found.error_m));
    state.counters["most_m"] = std::ranges::max(found.error_m);
    state.counters["nees_share"] = inertial_world::share_within_bounds(found.nees);
  }
}
BENCHMARK(BM_Coasting)->ArgsProduct({{1, 10, 50}, {0, 1}})->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace ygslam::bench

BENCHMARK_MAIN();
