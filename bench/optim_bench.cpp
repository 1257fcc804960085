// Speed of the optimisers, one thread. The benchmarks named *BesideCeres solve the same problem
// with both in turn (beside.hpp).
#include <benchmark/benchmark.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "beside.hpp"
#include "geometry/pnp.hpp"
#include "optim/local_bundle.hpp"
#include "optim/pose_graph.hpp"
#include "optim/pose_only.hpp"
#include "optim/synthetic_pose_graph.hpp"
#include "optim/synthetic_views.hpp"
#ifdef YGSLAM_HAVE_CERES
#include "optim/referee/ceres_referee.hpp"
#endif

namespace ygslam::bench {
namespace {

// A local window as mapping sees it: 15 keyframes, 2000 points, about 5 observations each.
BundleProblem local_window(int poses, int points) {
  Rng rng(1);
  auto world = synthetic::bundle_world(poses, points, 6,
                                       {.wrong_pixel_share = 0.02, .wrong_depth_share = 0.05}, rng);
  synthetic::perturb(world.problem, 0.01, 0.005, 0.02, rng);
  return world.problem;
}

void BM_LocalBundle(benchmark::State& state) {
  const BundleProblem problem =
      local_window(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  BundleResult result;
  for (auto _ : state) result = adjust_bundle(synthetic::camera(), problem, {});
  state.counters["observations"] = static_cast<double>(problem.observations.size());
  state.counters["iterations"] = result.iterations;
  state.counters["cost_ratio"] = result.final_cost / result.initial_cost;
}
BENCHMARK(BM_LocalBundle)
    ->Args({15, 2000})
    ->Args({30, 4000})
    ->Args({60, 6000})
    ->Args({100, 10000})
    ->Unit(benchmark::kMillisecond);

// A whole map: about 300 observations per keyframe, all but the first pose free, every place seen
// again in each of three laps.
BundleProblem whole_map(int poses, const synthetic::Noise& noise) {
  Rng rng(5);
  auto world = synthetic::room_world(poses, 3, 36 * poses, 300, noise, rng);
  synthetic::perturb(world.problem, 0.01, 0.005, 0.02, rng);
  return world.problem;
}

void BM_WholeMapBundle(benchmark::State& state) {
  const BundleProblem problem = whole_map(static_cast<int>(state.range(0)),
                                          {.wrong_pixel_share = 0.02, .wrong_depth_share = 0.05});
  BundleResult result;
  for (auto _ : state) result = adjust_bundle(synthetic::camera(), problem, {});
  state.counters["observations"] = static_cast<double>(problem.observations.size());
  state.counters["iterations"] = result.iterations;
  state.counters["cost_ratio"] = result.final_cost / result.initial_cost;
}
BENCHMARK(BM_WholeMapBundle)->Arg(225)->Arg(1400)->Unit(benchmark::kMillisecond);

// From the flag, set by another thread at some moment, to the result.
void BM_WholeMapBundleStops(benchmark::State& state) {
  using Clock = std::chrono::steady_clock;
  const BundleProblem problem = whole_map(static_cast<int>(state.range(0)), {});
  double sum_ms = 0, worst_ms = 0;
  int delay_ms = 0;
  for (auto _ : state) {
    delay_ms = (delay_ms + 37) % 300;
    std::atomic<bool> abort = false;
    Clock::time_point asked;
    std::jthread other([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(delay_ms));
      asked = Clock::now();
      abort = true;
    });
    const BundleResult result = adjust_bundle(synthetic::camera(), problem, {}, &abort);
    const auto returned = Clock::now();
    other.join();
    if (!result.interrupted) continue;
    const double ms = std::chrono::duration<double, std::milli>(returned - asked).count();
    sum_ms += ms;
    worst_ms = std::max(worst_ms, ms);
  }
  state.counters["mean_ms"] = sum_ms / static_cast<double>(state.iterations());
  state.counters["worst_ms"] = worst_ms;
}
BENCHMARK(BM_WholeMapBundleStops)
    ->Arg(225)
    ->Arg(1400)
    ->Iterations(20)
    ->Unit(benchmark::kMillisecond);

struct PoseCase {
  std::vector<PoseObservation> observations;
  SE3 T_guess;
};

PoseCase pose_case(int points) {
  Rng rng(2);
  auto world =
      synthetic::pose_world(points, {.wrong_pixel_share = 0.1, .wrong_depth_share = 0.05}, rng);
  return {world.observations,
          SE3::exp(synthetic::random_twist(rng, 0.03, 0.02)) * world.T_camera_world};
}

void BM_PoseOnly(benchmark::State& state) {
  const PoseCase c = pose_case(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    benchmark::DoNotOptimize(solve_pose(synthetic::camera(), c.T_guess, c.observations, {}));
  }
}
BENCHMARK(BM_PoseOnly)->Arg(100)->Arg(500)->Arg(1000)->Unit(benchmark::kMicrosecond);

void BM_PnpRansac(benchmark::State& state) {
  Rng rng(3);
  const double wrong_share = static_cast<double>(state.range(0)) / 100.0;
  const auto world = synthetic::pose_world(
      500, {.wrong_pixel_share = wrong_share, .without_depth_share = 0.1}, rng);
  std::vector<PnpPoint> points;
  for (const PoseObservation& o : world.observations) {
    points.push_back({o.p_world, o.seen.ideal_px, o.seen.depth_m});
  }
  int samples = 0;
  for (auto _ : state) {
    const auto result = solve_pnp_ransac(synthetic::camera(), points, {}, rng);
    samples = result ? result->iterations : -1;
  }
  state.counters["samples"] = samples;
}
BENCHMARK(BM_PnpRansac)->Arg(30)->Arg(50)->Arg(70)->Unit(benchmark::kMicrosecond);

// Laps of one way, each pose tied to the four before it and loops between any two laps: 4500 poses
// give the 22,000 edges of a long run's essential graph. The more laps, the more the factor fills.
PoseGraph essential_graph(int poses, int laps) {
  Rng rng(4);
  return synthetic::pose_graph_world(
             {.poses = poses, .laps = laps, .neighbours = 4, .loops = poses * 8 / 9}, rng)
      .graph;
}

void BM_PoseGraph(benchmark::State& state) {
  const PoseGraph graph =
      essential_graph(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  PoseGraphResult result;
  for (auto _ : state) result = optimize_pose_graph(graph, {.gnc = state.range(2) != 0});
  state.counters["edges"] = static_cast<double>(graph.edges.size());
  state.counters["iterations"] = result.iterations;
}
BENCHMARK(BM_PoseGraph)
    ->ArgNames({"poses", "laps", "gnc"})
    ->ArgsProduct({{300, 1000, 4500}, {3}, {0, 1}})
    ->Args({4500, 15, 0})
    ->Unit(benchmark::kMillisecond);

#ifdef YGSLAM_HAVE_CERES

// One robust phase with the same kernel and the same end.
void bundle_beside_ceres(benchmark::State& state, const BundleProblem& problem, int iterations,
                         double relative_decrease) {
  BundleConfig config;
  config.iterations_robust = iterations;
  config.iterations_refine = 0;
  config.relative_decrease = relative_decrease;
  const referee::Settings settings = {.iterations = iterations,
                                      .relative_decrease = relative_decrease};
  double ours_s = 0, ceres_s = 0;
  BundleResult ours;
  referee::Solution ceres;
  for (auto _ : state) {
    ours_s += seconds([&] { ours = adjust_bundle(synthetic::camera(), problem, config); });
    ceres_s +=
        seconds([&] { ceres = referee::adjust_bundle(synthetic::camera(), problem, settings); });
  }
  report(state, ours_s, "ceres", ceres_s);
  state.counters["our_iterations"] = ours.iterations;
  state.counters["ceres_iterations"] = ceres.iterations;
  state.counters["cost_above_ceres"] = ours.final_cost / ceres.final_cost - 1;
}

void BM_LocalBundleBesideCeres(benchmark::State& state) {
  bundle_beside_ceres(state, local_window(15, 2000), 15, 1e-5);
}
BENCHMARK(BM_LocalBundleBesideCeres)->Unit(benchmark::kMillisecond);

void BM_WholeMapBundleBesideCeres(benchmark::State& state) {
  bundle_beside_ceres(state, whole_map(static_cast<int>(state.range(0)), {}), 50, 1e-8);
}
BENCHMARK(BM_WholeMapBundleBesideCeres)->Arg(225)->Unit(benchmark::kMillisecond);

void BM_PoseOnlyBesideCeres(benchmark::State& state) {
  const PoseCase c = pose_case(500);
  PoseOnlyConfig config;
  config.rounds = config.robust_rounds = 1;
  double ours_s = 0, ceres_s = 0;
  for (auto _ : state) {
    ours_s += seconds([&] {
      benchmark::DoNotOptimize(solve_pose(synthetic::camera(), c.T_guess, c.observations, config));
    });
    ceres_s += seconds([&] {
      benchmark::DoNotOptimize(
          referee::solve_pose(synthetic::camera(), c.T_guess, c.observations,
                              {.iterations = config.iterations, .relative_decrease = 1e-9}));
    });
  }
  report(state, ours_s, "ceres", ceres_s);
}
BENCHMARK(BM_PoseOnlyBesideCeres)->Unit(benchmark::kMillisecond);

// Both to the end: a step that lowers the cost by 1e-8.
void BM_PoseGraphBesideCeres(benchmark::State& state) {
  const PoseGraph graph =
      essential_graph(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  double ours_s = 0, ceres_s = 0;
  PoseGraphResult ours;
  referee::Solution ceres;
  for (auto _ : state) {
    ours_s += seconds([&] { ours = optimize_pose_graph(graph, {.gnc = false}); });
    ceres_s +=
        seconds([&] { ceres = referee::optimize_pose_graph(graph, {.relative_decrease = 1e-8}); });
  }
  report(state, ours_s, "ceres", ceres_s);
  state.counters["edges"] = static_cast<double>(graph.edges.size());
  state.counters["our_iterations"] = ours.iterations;
  state.counters["ceres_iterations"] = ceres.iterations;
  state.counters["cost_above_ceres"] = ours.cost / ceres.final_cost - 1;
}
BENCHMARK(BM_PoseGraphBesideCeres)
    ->ArgNames({"poses", "laps"})
    ->Args({300, 3})
    ->Args({1000, 3})
    ->Args({4500, 3})
    ->Args({4500, 15})
    ->Unit(benchmark::kMillisecond);

#endif  // YGSLAM_HAVE_CERES

}  // namespace
}  // namespace ygslam::bench

BENCHMARK_MAIN();
