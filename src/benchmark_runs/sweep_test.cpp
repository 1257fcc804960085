// The sweep with a script in place of the program: what becomes of runs that go well, fail, crash.
#include "benchmark_runs/sweep.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "benchmark_runs/compare.hpp"
#include "benchmark_runs/sweep_test_bench.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;

TEST(Sweep, MakesEveryRunOnceAndWritesWhatTheReportNeeds) {
  Bench bench;
  bench.run_all();
  EXPECT_EQ(bench.calls(), 4);
  EXPECT_EQ(bench.lines.size(), 4U);
  EXPECT_TRUE(bench.faults.empty());
  EXPECT_EQ(bench.record("one/off/02").seed, 1U);
  EXPECT_TRUE(fs::exists(bench.run("one/geometry/01/errors.csv")));
  EXPECT_TRUE(fs::exists(bench.options.out / "sequences/one/groundtruth.txt"));
  const auto json = bench.sweep_file();
  EXPECT_EQ(json["complete"], true);
  EXPECT_EQ(json["sequences"][0]["frames"], 10);
  EXPECT_EQ(json["options"]["runs"], 2);
  EXPECT_EQ(json.dump().find(bench.folder.path().string()), std::string::npos) << "no machine path";
}

TEST(Sweep, GoesOnWhereItWasAndMakesNothingTwice) {
  Bench bench;
  {
    auto sweep = bench.open([&] { return bench.lines.size() == 2; });
    ASSERT_TRUE(sweep.ok());
    EXPECT_FALSE(*sweep->run());
  }
  EXPECT_EQ(bench.sweep_file()["complete"], false);
  EXPECT_EQ(bench.lines.size(), 2U);
  testing::write(bench.run("one/geometry/02/metrics.json"), "{\"half");  // of a run that was killed
  const auto calls_before = bench.calls();
  bench.run_all();
  EXPECT_EQ(bench.lines.size(), 4U);
  EXPECT_EQ(bench.calls() - calls_before, 2);
  bench.options.runs = 3;
  bench.run_all();
  EXPECT_EQ(bench.lines.size(), 6U) << "only the third runs";
}

TEST(Sweep, FaultsAreRowsAndTheRestGoesOn) {
  Bench bench;
  bench.add_sequence("two", "off crash\ngeometry lost\n");
  bench.add_sequence("three", "off fail\ngeometry nothing\n");
  testing::write(bench.root() / "broken/rgb.txt", "1.0 rgb/1.png\n");
  bench.add_sequence("later");
  testing::write(bench.root() / "later/groundtruth.txt", "5 0 0 0 0 0 0 1\n6 1 0 0 0 0 0 1\n");
  bench.options.runs = 1;
  bench.run_all();
  EXPECT_EQ(bench.record("one/off/01").status, RunStatus::kOk);
  const RunRecord crashed = bench.record("two/off/01");
  EXPECT_EQ(crashed.status, RunStatus::kCrashed);
  EXPECT_EQ(crashed.signal, SIGSEGV);
  EXPECT_EQ(crashed.error, "ended by SIGSEGV");
  const RunRecord lost = bench.record("two/geometry/01");
  EXPECT_EQ(lost.status, RunStatus::kLost);
  EXPECT_EQ(lost.exit_code, 7);
  EXPECT_TRUE(fs::exists(bench.run("two/geometry/01/errors.csv")));
  const RunRecord failed = bench.record("three/off/01");
  EXPECT_EQ(failed.status, RunStatus::kFailed);
  EXPECT_EQ(failed.error, "three/rgb.txt: no good") << "without the folder of this machine";
  EXPECT_EQ(bench.record("three/geometry/01").status, RunStatus::kFailed);
  const RunRecord later = bench.record("later/off/01");
  EXPECT_EQ(later.status, RunStatus::kBadTruth);
  EXPECT_NE(later.error->find("later/groundtruth.txt: no stamps"), std::string::npos);
  EXPECT_EQ(bench.faults.size(), 7U) << "broken, two, three, later: a line each";
  const auto results = read_results(bench.options.out);
  ASSERT_TRUE(results.ok());
  EXPECT_EQ(results->unusable.size(), 1U);
  EXPECT_EQ(results->rows.size(), 8U) << "a failed run keeps its row";
  const std::string table = format_results(*results);
  EXPECT_NE(table.find("0/1 !"), std::string::npos);
  EXPECT_NE(table.find("unusable: broken: "), std::string::npos);
}

TEST(Sweep, ResultsOfAnotherMakeAreNeverMixed) {
  Bench bench;
  bench.run_all();
  const std::string before = testing::read(bench.options.out / "sweep.json");
  const auto refusal = [&] {
    const auto sweep = bench.open();
    EXPECT_FALSE(sweep.ok());
    EXPECT_EQ(sweep.error().kind, ErrorKind::kOutput);
    return sweep.error().message;
  };
  bench.options.version = "1.1";
  EXPECT_NE(refusal().find("made by version 1.0, this is 1.1"), std::string::npos);
  bench.options.version = "1.0";
  bench.options.config["orb.features"] = "500";
  EXPECT_NE(refusal().find("orb.features was not set, is now 500"), std::string::npos);
  bench.options.config.clear();
  bench.options.schedule = Schedule::kDeterministic;
  EXPECT_NE(refusal().find("way was as fast as possible, is now deterministic"), std::string::npos);
  bench.options.schedule = Schedule::kFile;
  EXPECT_EQ(testing::read(bench.options.out / "sweep.json"), before) << "nothing was touched";
  // One folder from elsewhere.
  nlohmann::json foreign = *read_json(bench.run("one/off/01/run.json"));
  foreign["version"] = "0.9";
  testing::write(bench.run("one/off/01/run.json"), foreign.dump());
  EXPECT_NE(refusal().find("runs/one/off/01/run.json: made by version 0.9"), std::string::npos);
}

TEST(Sweep, ADamagedSweepFileIsAnErrorThatNamesIt) {
  Bench bench;
  bench.run_all();
  const auto whole = bench.sweep_file();
  const fs::path file = bench.options.out / "sweep.json";
  const auto expect_fault = [&](const nlohmann::json& damaged) {
    testing::write(file, damaged.dump());
    const auto results = read_results(bench.options.out);
    ASSERT_FALSE(results.ok()) << damaged.dump();
    EXPECT_EQ(results.error().kind, ErrorKind::kInput);
    EXPECT_EQ(results.error().message.find(file.string()), 0U);
    EXPECT_FALSE(bench.open().ok());
  };
  for (const auto& value : {nlohmann::json(), nlohmann::json(7), nlohmann::json("x"),
                            nlohmann::json::array({1}), nlohmann::json::object({{"a", 1}})}) {
    for (const char* key : {"/format", "/options", "/options/runs", "/modes", "/sequences",
                            "/sequences/0", "/sequences/0/id", "/sequences/0/kind"}) {
      nlohmann::json damaged = whole;
      if (value == 7 && std::string(key) == "/options/runs") continue;
      if (value == "x" && std::string(key).starts_with("/sequences/0/")) continue;
      damaged[nlohmann::json::json_pointer(key)] = value;
      expect_fault(damaged);
    }
  }
  for (const auto& asked : {nlohmann::json{{"../up", 1}}, nlohmann::json{{"off", -1}},
                            nlohmann::json{{"off", 100000}}, nlohmann::json(3)}) {
    nlohmann::json damaged = whole;
    damaged["sequences"][0]["runs_asked"] = asked;
    expect_fault(damaged);
  }
  for (const auto& [key, ignored] : whole.items()) {
    nlohmann::json damaged = whole;
    damaged.erase(key);
    if (key == "machine" || key == "complete") continue;
    expect_fault(damaged);
  }
}

TEST(Sweep, ASequenceThatHasChangedIsTold) {
  Bench bench;
  bench.run_all();
  const auto calls = bench.calls();
  testing::write(bench.root() / "one/groundtruth.txt", "1000 0 0 0 0 0 0 1\n");
  bench.add_sequence("two");
  bench.run_all();
  ASSERT_EQ(bench.faults.size(), 1U);
  EXPECT_NE(bench.faults[0].find("are not those of the runs"), std::string::npos);
  EXPECT_EQ(bench.calls() - calls, 4) << "only the new sequence";
}

TEST(Sweep, OtherSequencesAndModesOfEarlierCallsStay) {
  Bench bench;
  bench.run_in_two_calls();
  const auto json = bench.sweep_file();
  EXPECT_EQ(json["sequences"].size(), 2U);
  EXPECT_EQ(json["modes"], (nlohmann::json{"off", "geometry"}));
  EXPECT_EQ(json["options"]["runs"], 2);
  EXPECT_EQ(read_results(bench.options.out)->rows.size(), 2U);
}

TEST(Sweep, SeveralJobsSpoilTheTimingsAndSaySo) {
  Bench bench;
  bench.options.jobs = 3;
  bench.run_all();
  EXPECT_EQ(bench.calls(), 4);
  EXPECT_FALSE(bench.record("one/off/01").timings_valid);
  EXPECT_EQ(bench.sweep_file()["timings_valid"], false);
}

TEST(Sweep, TwoAtOnceOnTheSameResultsAreRefused) {
  Bench bench;
  const auto first = bench.open();
  ASSERT_TRUE(first.ok());
  const auto second = bench.open();
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().message.find("locked"), std::string::npos);
}

TEST(Compare, JudgesOnlyWhereTheSpreadsAreApart) {
  Bench a, b;
  testing::write(b.folder.path() / "worse", "");
  for (Bench* bench : {&a, &b}) bench->run_all();
  const auto before = *read_results(a.options.out);
  const auto after = *read_results(b.options.out);
  const Comparison comparison = compare(before, after);
  ASSERT_EQ(comparison.rows.size(), 2U);
  const auto figure = [](const ComparedRow& row, Figure which) {
    return *std::find_if(row.figures.begin(), row.figures.end(),
                         [&](const auto& f) { return f.figure == which; });
  };
  const ComparedFigure ate = figure(comparison.rows[0], Figure::kAte);
  EXPECT_NEAR(*ate.ratio, 0.1105 / 0.0105, 1e-9);
  EXPECT_EQ(ate.verdict, Verdict::kWorse);
  EXPECT_EQ(figure(comparison.rows[0], Figure::kRpe30Trans).verdict, Verdict::kSame);
  EXPECT_EQ(figure(comparison.rows[0], Figure::kTrackTime).verdict, Verdict::kSame);
  EXPECT_FALSE(figure(comparison.rows[0], Figure::kRpe1sTrans).ratio.has_value());
  const auto json = to_json(comparison);
  EXPECT_EQ(json["worse"].size(), 2U);
  EXPECT_TRUE(json["better"].empty());
  EXPECT_EQ(to_json(compare(after, before))["better"].size(), 2U);
  EXPECT_NE(format_comparison(comparison).find("Better: nothing"), std::string::npos);
}

TEST(Compare, ARunAloneIsNotJudgedAndLostRunsAreWorse) {
  Bench a, b;
  a.options.modes = b.options.modes = {"off"};
  testing::write(b.root() / "one/behave", "off crash\n");
  a.options.runs = 1;
  a.run_all();
  b.run_all();
  b.add_sequence("two");
  b.run_all();
  const Comparison comparison = compare(*read_results(a.options.out), *read_results(b.options.out));
  ASSERT_EQ(comparison.rows.size(), 1U);
  EXPECT_EQ(comparison.rows[0].figures[0].verdict, Verdict::kUnjudged);
  EXPECT_EQ(to_json(comparison)["worse"][0], "one off: good runs 1/1 -> 0/2");
  EXPECT_EQ(comparison.only_b, std::vector<std::string>{"two off"});
}

}  // namespace
}  // namespace ygslam
