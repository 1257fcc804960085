// A sweep with a script in place of the program, for tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "benchmark_runs/sweep.hpp"
#include "io/json_text.hpp"
#include "io/testing/small_sequence.hpp"

namespace ygslam {

// Called as `program run SEQUENCE --out DIR --dynamic MODE --seed N ...`: notes the call, then does
// what the file SEQUENCE/behave says for the mode, else writes a trajectory like the truth.
inline constexpr const char* kProgram = R"(#!/bin/sh
sequence=$2 out=$4
while [ $# -gt 1 ]; do
  case "$1" in --dynamic) mode=$2 ;; --seed) seed=$2 ;; esac
  shift
done
echo "$out" >> "$sequence/../../calls"
how=$(sed -n "s/^$mode //p" "$sequence/behave" 2>/dev/null)
case "$how" in
  crash) kill -SEGV $$ ;;
  fail) echo "error: $sequence/rgb.txt: no good" >&2; exit 4 ;;
  nothing) exit 0 ;;
  killed) kill -KILL $$ ;;
  asked) echo "warning: stopped" >&2; exit 143 ;;
  slow) exec sleep 60 ;;
  deaf) trap '' TERM; while :; do sleep 0.05; done ;;
esac
cp "$sequence/poses" "$out/trajectory.txt"
error=0.0$((10 + seed))
[ -e "$sequence/../../worse" ] && error=0.1$((10 + seed))
cat > "$out/metrics.json" <<END
{"coverage": 1.0, "ate": {"rmse": $error},
 "rpe": {"frames30": {"trans_m": {"rmse": 0.01}, "rot_deg": {"rmse": 0.5}}, "sec1": null},
 "timing_ms": {"track": {"median": 1$seed.5}}}
END
case "$how" in
  nonsense) sed -i "s/\"rmse\": $error/\"rmse\": -$error/" "$out/metrics.json" ;;
  noise) head -c 3000 /dev/urandom > "$out/trajectory.txt" ;;
esac
if [ "$how" = lost ]; then echo "warning: lost for 80 %" >&2; exit 7; fi
exit 0
)";

struct Bench {
  testing::TempFolder folder;
  SweepOptions options;
  std::vector<std::string> lines, faults;

  Bench() {
    const std::filesystem::path program = folder.path() / "program";
    testing::write(program, kProgram);
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    options.root = folder.path() / "data";
    options.out = folder.path() / "out";
    options.modes = {"off", "geometry"};
    options.runs = 2;
    options.version = "1.0";
    options.program = program;
    add_sequence("one");
  }
  void add_sequence(const std::string& name, const std::string& behave = "") {
    const testing::SmallSequence small;
    small.write_to(root() / name);
    std::string poses;
    for (int i = 0; i < small.count; ++i) {
      const std::string x = std::to_string(0.01 * i * i);
      poses +=
          format_stamp({small.first_ns + i * small.interval_ns}, 6) + " " + x + " 0 1 0 0 0 1\n";
    }
    testing::write(root() / name / "groundtruth.txt", poses);
    testing::write(root() / name / "poses", poses);
    testing::write(root() / name / "behave", behave);
  }
  [[nodiscard]] std::filesystem::path root() const { return folder.path() / "data"; }
  [[nodiscard]] std::filesystem::path run(const std::string& place) const {
    return options.out / "runs" / place;
  }
  [[nodiscard]] RunRecord record(const std::string& place) const {
    const auto read = read_run_record(run(place) / "run.json");
    EXPECT_TRUE(read.ok()) << place;
    return read.ok() ? *read : RunRecord{};
  }
  [[nodiscard]] std::ptrdiff_t calls() const {
    const std::string text = testing::read(folder.path() / "calls");
    return std::count(text.begin(), text.end(), '\n');
  }
  Result<Sweep> open(std::function<bool()> stop = [] { return false; }) {
    return Sweep::open(options, {[this](const auto& line) { lines.push_back(line); },
                                 [this](const auto& line) { faults.push_back(line); },
                                 [](std::size_t, std::size_t, const auto&) {}, std::move(stop)});
  }
  void run_all() {
    auto sweep = open();
    ASSERT_TRUE(sweep.ok()) << sweep.error().message;
    sweep->tell_faults();
    const auto complete = sweep->run();
    ASSERT_TRUE(complete.ok()) << complete.error().message;
    EXPECT_TRUE(*complete);
  }
  /// Sequence "one", mode off, twice; then in another call "two", geometry, once.
  void run_in_two_calls() {
    add_sequence("two");
    options.sequences = {"one"};
    options.modes = {"off"};
    run_all();
    options.sequences = {"two"};
    options.modes = {"geometry"};
    options.runs = 1;
    run_all();
  }
  [[nodiscard]] nlohmann::json sweep_file() const { return *read_json(options.out / "sweep.json"); }
};

}  // namespace ygslam
