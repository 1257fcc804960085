// What the user asked of `ygslam bench`, checked and turned into a sweep's options.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "benchmark_runs/sweep_options.hpp"
#include "core/result.hpp"

namespace CLI {
class App;
}

namespace ygslam {

struct BenchArguments {
  std::string root, out = "out/bench";
  std::vector<std::string> sequences, modes, sets, compare;
  std::string model, segmenter, config_file, engine;
  int runs = 5;
  std::optional<int> jobs;
  bool realtime = false, deterministic = false, report = true, pictures = true, json = false;
  std::optional<std::uint64_t> seed;
  std::optional<double> run_limit_s;
};

void declare_bench_options(CLI::App& command, BenchArguments& arguments);

/// Reads settings and looks at the model.
/// @return kUsage, kConfig or kModel (with the hint how to get one).
[[nodiscard]] Result<SweepOptions> sweep_options(const BenchArguments& arguments);

}  // namespace ygslam
