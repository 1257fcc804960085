// What a second call makes of what the first one left: damaged, killed, late, changed, more asked.
#include <gtest/gtest.h>

#include "benchmark_runs/compare.hpp"
#include "benchmark_runs/sweep_test_bench.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;

TEST(Complete, CoversWhatAllCallsAskedFor) {
  Bench bench;
  {
    auto sweep = bench.open([&] { return bench.lines.size() == 1; });
    ASSERT_TRUE(sweep.ok());
    EXPECT_FALSE(*sweep->run());
  }
  bench.options.modes = {"off"};
  bench.run_all();
  EXPECT_EQ(bench.sweep_file()["complete"], false) << "mode geometry was asked for, too";
  bench.options.modes = {"geometry"};
  bench.run_all();
  EXPECT_EQ(bench.sweep_file()["complete"], true);
  bench.add_sequence("two");
  {
    auto sweep = bench.open([&] { return bench.lines.size() == 5; });
    ASSERT_TRUE(sweep.ok());
    EXPECT_FALSE(*sweep->run());
  }
  bench.options.sequences = {"one"};
  bench.run_all();
  EXPECT_EQ(bench.sweep_file()["complete"], false) << "the other sequence is not done";
  bench.options.sequences = {"two"};
  bench.run_all();
  EXPECT_EQ(bench.sweep_file()["complete"], true) << "the first one is found done";
  fs::remove(bench.run("one/off/02/run.json"));
  bench.run_all();
  EXPECT_EQ(bench.sweep_file()["complete"], false);
}

TEST(Complete, AsksForNothingThatNobodyAskedFor) {
  Bench bench;
  bench.run_in_two_calls();
  const auto json = bench.sweep_file();
  EXPECT_EQ(json["complete"], true);
  EXPECT_EQ(json["sequences"][0]["runs_asked"], (nlohmann::json{{"off", 2}}));
  EXPECT_EQ(json["sequences"][1]["runs_asked"], (nlohmann::json{{"geometry", 1}}));
}

TEST(Resume, TheModelMattersWhereAModeUsesIt) {
  Bench bench;
  bench.run_all();
  EXPECT_TRUE(bench.sweep_file()["options"]["model"].is_null());
  bench.options.modes = {"full"};
  bench.options.model = bench.folder.path() / "net.onnx";
  testing::write(bench.options.model, "one");
  bench.run_all();
  EXPECT_EQ(bench.sweep_file()["options"]["model"], "net.onnx");
  bench.options.modes = {"off"};
  bench.options.model.clear();
  bench.options.segmenter = "none";
  bench.options.runs = 3;
  bench.run_all();
  EXPECT_EQ(bench.sweep_file()["options"]["model"], "net.onnx") << "stays: runs were made with it";
  EXPECT_EQ(bench.calls(), 7) << "no run twice";
  bench.options.modes = {"semantic"};
  bench.options.segmenter = "model";
  bench.options.model = bench.folder.path() / "net.onnx";
  testing::write(bench.options.model, "two");
  const auto other = bench.open();
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().message.find("the model's content has changed"), std::string::npos);
}

TEST(Resume, ExchangedMasksAreTold) {
  Bench bench;
  bench.options.segmenter = "masks:mask";
  bench.options.modes = {"off", "full"};
  const fs::path mask = bench.root() / "one/mask/1000.png";
  testing::write(mask, "old");
  bench.run_all();
  EXPECT_TRUE(bench.record("one/off/01").masks_fingerprint.empty());
  testing::write(mask, "new");  // of the same size
  bench.options.modes = {"off"};
  bench.run_all();
  EXPECT_TRUE(bench.faults.empty()) << "no mode of this call reads them";
  bench.options.modes = {"off", "full"};
  bench.run_all();
  ASSERT_EQ(bench.faults.size(), 1U);
  EXPECT_NE(bench.faults[0].find("its masks are not those of the runs in runs/one/full"),
            std::string::npos);
  fs::remove_all(bench.run("one/full"));
  bench.faults.clear();
  bench.run_all();
  EXPECT_TRUE(bench.faults.empty());
  EXPECT_EQ(bench.calls(), 6);
  testing::write(bench.root() / "one/mask/instances.json", "{}");
  bench.run_all();
  EXPECT_EQ(bench.faults.size(), 1U) << "classes count, too";
}

TEST(Resume, NoPathOfThisMachineIsKept) {
  Bench bench;
  bench.options.modes = {"full"};
  bench.options.segmenter = "masks:" + (bench.folder.path() / "elsewhere/").string();
  testing::write(bench.folder.path() / "elsewhere/1000.png", "mask");
  bench.run_all();
  EXPECT_EQ(bench.sweep_file()["options"]["segmenter"], "masks:elsewhere");
  for (const fs::path& file :
       {bench.options.out / "sweep.json", bench.run("one/full/01/run.json")}) {
    EXPECT_EQ(testing::read(file).find(bench.folder.path().string()), std::string::npos) << file;
  }
  EXPECT_NE(bench.record("one/full/01").masks_fingerprint, "none");
}

TEST(Resume, DamagedRunsAreMadeAnew) {
  for (const char* name : {"metrics.json", "trajectory.txt", "errors.csv"}) {
    for (const char* damage : {"cut", "noise", "gone"}) {
      Bench bench;
      bench.options.modes = {"off"};
      bench.run_all();
      const fs::path file = bench.run("one/off/02") / name;
      const std::string whole = testing::read(file);
      if (*damage == 'g') fs::remove(file);
      if (*damage == 'c') testing::write(file, whole.substr(0, whole.size() - 20));
      if (*damage == 'n') testing::write(file, std::string("\xff\x00\x80{", 4) + whole);
      const auto results = read_results(bench.options.out);
      ASSERT_TRUE(results.ok());
      ASSERT_EQ(results->damaged.size(), 1U) << name << damage;
      EXPECT_EQ(results->damaged[0].find(std::string("runs/one/off/02: ") + name), 0U);
      EXPECT_EQ(results->rows[0].good_runs(), 1U);
      EXPECT_NE(format_results(*results).find("damaged: runs/one/off/02"), std::string::npos);
      EXPECT_NE(compare(*results, *results).notes[0].find("A is damaged: runs/one"),
                std::string::npos);
      bench.run_all();
      ASSERT_EQ(bench.faults.size(), 1U);
      EXPECT_EQ(bench.faults[0].find(std::string("runs/one/off/02: ") + name), 0U);
      EXPECT_EQ(bench.calls(), 3) << name << damage;
      EXPECT_EQ(testing::read(file), whole);
    }
  }
}

TEST(Resume, AnOlderRecordIsJudgedByItsMetrics) {
  Bench bench;
  bench.run_all();
  for (const char* place : {"one/off/01", "one/geometry/01"}) {
    auto record = *read_json(bench.run(place) / "run.json");
    record.erase("files");
    testing::write(bench.run(place) / "run.json", record.dump());
  }
  testing::write(bench.run("one/off/01/metrics.json"), R"({"coverage": 1, "ate": {"rmse": -1}})");
  bench.run_all();
  EXPECT_EQ(bench.calls(), 5);
  ASSERT_EQ(bench.faults.size(), 1U);
  EXPECT_NE(bench.faults[0].find("metrics.json: ate.rmse is no sensible number"),
            std::string::npos);
}

TEST(Judge, NonsenseIsNoGoodRun) {
  Bench bench;
  testing::write(bench.root() / "one/behave", "off nonsense\ngeometry noise\n");
  bench.options.runs = 1;
  bench.run_all();
  const RunRecord nonsense = bench.record("one/off/01");
  EXPECT_EQ(nonsense.status, RunStatus::kFailed);
  EXPECT_EQ(nonsense.error, "runs/one/off/01/metrics.json: ate.rmse is no sensible number");
  const RunRecord noise = bench.record("one/geometry/01");
  EXPECT_EQ(noise.status, RunStatus::kFailed);
  EXPECT_NE(noise.error->find("trajectory.txt"), std::string::npos);
  EXPECT_EQ(read_results(bench.options.out)->rows[0].good_runs(), 0U);
}

TEST(Resume, WhatWasKilledFromOutsideIsTriedAgain) {
  Bench bench;
  testing::write(bench.root() / "one/behave", "off killed\ngeometry asked\n");
  bench.options.runs = 1;
  {
    auto first = bench.open();
    ASSERT_TRUE(first.ok());
    EXPECT_TRUE(*first->run());
    EXPECT_EQ(first->to_try_again(), 2U);
  }
  EXPECT_EQ(bench.record("one/off/01").error, "ended by SIGKILL");
  const RunRecord asked = bench.record("one/geometry/01");
  EXPECT_EQ(asked.status, RunStatus::kCrashed);
  EXPECT_EQ(asked.signal, SIGTERM) << "told by its exit code";
  EXPECT_EQ(bench.sweep_file()["complete"], false);
  EXPECT_EQ(read_results(bench.options.out)->rows.size(), 2U) << "each keeps its row";
  testing::write(bench.root() / "one/behave", "geometry crash\n");
  bench.faults.clear();
  bench.run_all();
  EXPECT_EQ(bench.record("one/off/01").status, RunStatus::kOk);
  EXPECT_EQ(bench.faults[0],
            "runs/one/geometry/01: crashed: ended by SIGTERM; last said: stopped; tried again");
  EXPECT_EQ(bench.sweep_file()["complete"], true) << "a fault of its own is a result";
  bench.run_all();
  EXPECT_EQ(bench.calls(), 4);
}

TEST(RunLimit, ARunThatHangsIsTimedOutAndTheRestGoesOn) {
  Bench bench;
  testing::write(bench.root() / "one/behave", "off slow\ngeometry deaf\n");
  bench.options.runs = 1;
  bench.options.run_limit_s = 0.3;
  bench.options.patience_s = 0.3;
  bench.add_sequence("two");
  bench.run_all();
  for (const char* place : {"one/off/01", "one/geometry/01"}) {
    const RunRecord record = bench.record(place);
    EXPECT_EQ(record.status, RunStatus::kTimedOut) << place;
    EXPECT_EQ(name_of(record.status), "timed_out");
    EXPECT_EQ(record.error, "not done after 0.3 s (--run-limit)");
    EXPECT_EQ(record.limit_s, 0.3);
  }
  EXPECT_EQ(bench.record("two/off/01").status, RunStatus::kOk);
  EXPECT_EQ(bench.sweep_file()["complete"], true);
  bench.run_all();
  EXPECT_EQ(bench.calls(), 4) << "as much time would end the same way";
  testing::write(bench.root() / "one/behave", "");
  bench.options.run_limit_s = 20;
  bench.run_all();
  EXPECT_EQ(bench.calls(), 6);
  EXPECT_EQ(bench.record("one/geometry/01").status, RunStatus::kOk);
}

TEST(RunLimit, IsGenerousUnlessTold) {
  SweepOptions options;
  BenchSequence sequence;
  sequence.duration_s = 30;
  EXPECT_EQ(run_limit_s(options, sequence), 1500);
  options.run_limit_s = 0;
  EXPECT_EQ(run_limit_s(options, sequence), 0);
}

}  // namespace
}  // namespace ygslam
