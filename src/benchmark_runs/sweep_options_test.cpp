#include "benchmark_runs/sweep_options.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

SweepOptions example() {
  SweepOptions options;
  options.out = "/results";
  options.modes = {"off", "full"};
  options.runs = 2;
  options.seed = 10;
  options.config = {{"orb.features", "500"}};
  options.schedule = Schedule::kDeterministic;
  options.segmenter = "masks:mask";
  options.program = "/bin/ygslam";
  return options;
}

BenchSequence sequence(const std::string& id) {
  BenchSequence s;
  s.id = s.name = id;
  s.folder = "/data/" + id;
  return s;
}

bool contains(const std::vector<std::string>& words, const std::vector<std::string>& part) {
  return std::search(words.begin(), words.end(), part.begin(), part.end()) != words.end();
}

TEST(PlannedRuns, TakeTurnsSoThatTimesAreComparable) {
  std::vector<BenchSequence> sequences = {sequence("a"), sequence("b"), sequence("c")};
  sequences[1].error = "broken";
  std::vector<std::string> order;
  for (const RunKey& key : planned_runs(example(), sequences)) order.push_back(key.folder());
  EXPECT_EQ(order, (std::vector<std::string>{"runs/a/off/01", "runs/a/full/01", "runs/c/off/01",
                                             "runs/c/full/01", "runs/a/off/02", "runs/a/full/02",
                                             "runs/c/off/02", "runs/c/full/02"}));
}

TEST(RunCommand, HasEverythingARunNeeds) {
  const auto words = run_command(example(), sequence("a"), {"a", "full", 2});
  EXPECT_TRUE(
      contains(words, {"/bin/ygslam", "run", "/data/a", "--out", "/results/runs/a/full/02"}));
  EXPECT_TRUE(contains(words, {"--dynamic", "full"}));
  EXPECT_TRUE(contains(words, {"--seed", "11"})) << "each run has its own";
  EXPECT_TRUE(contains(words, {"--deterministic"}));
  EXPECT_TRUE(contains(words, {"--set", "orb.features=500"}));
  EXPECT_TRUE(contains(words, {"--segmenter", "masks:/data/a/mask"})) << "inside the sequence";
  const auto off = run_command(example(), sequence("a"), {"a", "off", 1});
  EXPECT_FALSE(contains(off, {"--segmenter"}));
}

TEST(ShownCommand, NamesNoFolderOfThisMachine) {
  const std::string text = shown_command(example(), sequence("a b"), {"a_b", "full", 1});
  EXPECT_EQ(
      text,
      "ygslam run 'a b' --out runs/a_b/full/01 --segmenter masks:mask --dynamic full --seed 10 "
      "--deterministic --set orb.features=500");
}

TEST(ShownCommand, IsReadBackByAShellAsItWas) {
  const testing::TempFolder folder;
  SweepOptions options = example();
  options.segmenter = "model";
  options.config.clear();
  for (const std::string name : {"it's", "a b", "$HOME", "`id`", "!x", "~", "a\nb", "#", "{a,b}",
                                 "'", "''", "\\", "a=b;c", "ü", ""}) {
    std::string text = shown_command(options, sequence(name), {"id", "off", 1});
    text.replace(0, std::string("ygslam run ").size(), "printf %s ");
    text.erase(text.rfind(" --out "));
    text += " > '" + (folder.path() / "said").string() + "'";
    ASSERT_EQ(std::system(text.c_str()), 0) << text;
    EXPECT_EQ(testing::read(folder.path() / "said"), name) << text;
  }
}

TEST(Difference, NamesTheFirstOption) {
  const auto before = comparable_options(example());
  EXPECT_FALSE(difference(before, before).has_value());
  SweepOptions other = example();
  other.seed = 3;
  EXPECT_EQ(difference(before, comparable_options(other)), "seed was 10, is now 3");
  other = example();
  other.config["orb.levels"] = "4";
  EXPECT_EQ(difference(before, comparable_options(other)), "orb.levels was not set, is now 4");
  other = example();
  other.config.clear();
  EXPECT_EQ(difference(before, comparable_options(other)), "orb.features was 500, is now not set");
  other = example();
  other.modes = {"geometry"};
  other.runs = 100;
  other.jobs = 2;
  EXPECT_FALSE(difference(before, comparable_options(other)).has_value())
      << "these decide which runs there are, not what a run is";
}

TEST(Difference, SeesWhatComesAfterAnEmptyObject) {
  const nlohmann::json before = {{"config", nlohmann::json::object()}, {"seed", 1}};
  const nlohmann::json now = {{"seed", 2}};
  EXPECT_EQ(difference(before, now), "seed was 1, is now 2");
}

TEST(Difference, SeesAnotherModelUnderTheSameName) {
  const testing::TempFolder folder;
  SweepOptions options = example();
  options.model = folder.path() / "net.onnx";
  testing::write(options.model, "one");
  const auto before = comparable_options(options);
  EXPECT_EQ(before["model"], "net.onnx") << "no path";
  testing::write(options.model, "two");
  EXPECT_EQ(difference(before, comparable_options(options)), "the model's content has changed");
}

TEST(RunRecord, ComesBackAsItWas) {
  const testing::TempFolder folder;
  RunRecord record;
  record.status = RunStatus::kCrashed;
  record.signal = 11;
  record.error = "ended by SIGSEGV";
  record.command = "ygslam run a";
  record.mode = "full";
  record.run = 3;
  record.seed = 7;
  record.wall_s = 1.5;
  record.timings_valid = false;
  record.version = "0.1.0";
  record.options = comparable_options(example());
  const auto file = folder.path() / "run.json";
  testing::write(file, to_json(record).dump());
  const auto read = read_run_record(file);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(to_json(*read), to_json(record));
}

TEST(RunRecord, HalfWrittenOrForeignFilesAreErrorsThatNameTheFile) {
  const testing::TempFolder folder;
  const auto file = folder.path() / "run.json";
  for (const char* text : {"", "{\"format\": 1", "[]", "{\"format\": 2}", "{\"format\": 1}",
                           "{\"format\": 1, \"status\": \"fine\"}"}) {
    testing::write(file, text);
    const auto read = read_run_record(file);
    ASSERT_FALSE(read.ok()) << text;
    EXPECT_EQ(read.error().message.find(file.string()), 0U);
  }
  nlohmann::ordered_json beyond = to_json(RunRecord{});
  ASSERT_TRUE(parse_run_record(beyond.dump(), "run.json").ok());
  beyond["run"] = 1e88;
  const auto read = parse_run_record(beyond.dump(), "run.json");
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().message, "run.json: run is no whole number");
}

}  // namespace
}  // namespace ygslam
