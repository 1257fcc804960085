// Two results folders side by side: what got better, what got worse.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "benchmark_runs/results.hpp"

namespace ygslam {

enum class Verdict {
  kBetter,    ///< the spreads do not overlap and B is below A
  kWorse,     ///< the spreads do not overlap and B is above A
  kSame,      ///< the spreads overlap
  kUnjudged,  ///< fewer than two good runs on a side, or times taken beside other runs
};
[[nodiscard]] std::string_view name_of(Verdict verdict);

struct ComparedFigure {
  Figure figure{};
  std::optional<Spread> a, b;
  std::optional<double> ratio;  ///< median of B / median of A
  Verdict verdict = Verdict::kUnjudged;
};

struct ComparedRow {
  std::string sequence, mode;
  std::size_t good_a = 0, runs_a = 0, good_b = 0, runs_b = 0;
  std::vector<ComparedFigure> figures;  ///< ATE, RPE (frames and seconds), tracking time
};

struct Comparison {
  std::vector<ComparedRow> rows;    ///< sequence and mode in both
  std::vector<std::string> only_a;  ///< "sequence mode"
  std::vector<std::string> only_b;
  std::vector<std::string> notes;  ///< what makes the two differ: version, machine, options
};

[[nodiscard]] Comparison compare(const Results& a, const Results& b);
[[nodiscard]] std::string format_comparison(const Comparison& comparison);
[[nodiscard]] nlohmann::ordered_json to_json(const Comparison& comparison);

}  // namespace ygslam
