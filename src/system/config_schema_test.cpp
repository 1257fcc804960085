#include "system/config_schema.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"
#include "io/testing/temp_folder.hpp"
#include "system/slam_config.hpp"

namespace ygslam {
namespace {

using testing::TempFolder;

class ConfigFile : public ::testing::Test {
 protected:
  Status load(const std::string& text) {
    testing::write(folder_.path() / "c.yaml", text);
    return schema_.load_yaml((folder_.path() / "c.yaml").string());
  }
  /// The one-line message of a file that must be refused.
  std::string fault(const std::string& text) {
    const Status status = load(text);
    if (status.ok()) return "(accepted)";
    EXPECT_EQ(status.error().kind, ErrorKind::kConfig);
    EXPECT_EQ(status.error().message.find('\n'), std::string::npos) << status.error().message;
    EXPECT_NE(status.error().message.find("c.yaml"), std::string::npos);
    return status.error().message;
  }
  TempFolder folder_;
  SlamConfig config_;
  ConfigSchema schema_ = schema_of(config_);
};

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST_F(ConfigFile, SetsWhatItNamesAndLeavesTheRest) {
  const SlamConfig before = config_;
  ASSERT_TRUE(load("motion:\n  tau_px: 2.5\norb: {features: 700}\nsegment: {precision: int8}\n"
                   "run:\n  without: [local_map]\n")
                  .ok());
  EXPECT_EQ(config_.dynamic.epipolar.tau_px, 2.5);
  EXPECT_EQ(config_.orb.features, 700);
  EXPECT_EQ(config_.segment.network.precision, Precision::kInt8);
  EXPECT_EQ(config_.run.without, std::vector<std::string>{"local_map"});
  EXPECT_EQ(config_.orb.levels, before.orb.levels);
  EXPECT_TRUE(load("").ok());
  EXPECT_TRUE(load("# nothing but a comment\n").ok());
}

TEST_F(ConfigFile, ListsTakeBothForms) {
  ASSERT_TRUE(load("segment: {movable: [person, dog, 'cat']}").ok());
  EXPECT_EQ(config_.segment.movable, (std::vector<std::string>{"person", "dog", "cat"}));
  ASSERT_TRUE(load("segment:\n  movable:\n    - animals\n    - car\n").ok());
  EXPECT_EQ(config_.segment.movable, (std::vector<std::string>{"animals", "car"}));
  ASSERT_TRUE(load("segment: {movable: []}").ok());
  EXPECT_TRUE(config_.segment.movable.empty());
  ASSERT_TRUE(schema_.set("segment.movable", "horse, sports ball", "--set").ok());
  EXPECT_EQ(config_.segment.movable, (std::vector<std::string>{"horse", "sports ball"}));
}

TEST_F(ConfigFile, AnUnknownKeyNamesTheNearest) {
  EXPECT_TRUE(has(fault("motion: {tau_pz: 1}"), "motion.tau_px"));
  EXPECT_TRUE(has(fault("orb: {feature: 1}"), "orb.features"));
  EXPECT_TRUE(has(fault("tau_px: 1"), "motion.tau_px")) << "the section was forgotten";
  EXPECT_FALSE(has(fault("qqqqqqqqqqqq: {wwwwwwwwwww: 1}"), "did you mean"));
  // Every key with one letter gone is still recognised.
  for (const ConfigKey& key : schema_.keys()) {
    std::string typo = key.name;
    typo.erase(typo.size() / 2, 1);
    const auto near = schema_.nearest(typo);
    ASSERT_TRUE(near) << typo;
    EXPECT_LE(std::abs(static_cast<int>(near->size()) - static_cast<int>(key.name.size())), 2);
  }
}

TEST_F(ConfigFile, AllFaultsOfAFileAreToldAtOnceWithTheirLines) {
  const std::string all =
      fault("orb:\n  levels: 13\n  feature: 5\nmotion: {tau_px: x}\norb.levels: 3\n");
  for (const char* part : {"line 2: orb.levels = '13' is not in 1 .. 12",
                           "line 3: unknown key 'orb.feature', did you mean 'orb.features'?",
                           "line 4: motion.tau_px = 'x'", "line 5: 'orb.levels' is given twice"})
    EXPECT_TRUE(has(all, part)) << part << " not in: " << all;
  std::string many;
  for (int i = 0; i < 200; ++i) many += "a" + std::to_string(i) + ": 1\n";
  EXPECT_TRUE(has(fault(many), "and 150 more"));
}

TEST_F(ConfigFile, AKeyOrSectionThatIsGivenTwiceIsRefused) {
  for (const char* text :
       {"orb: {levels: 3, levels: 3}", "orb: {levels: 3}\norb: {features: 100}",
        "orb: {levels: 3}\norb.levels: 3", "segment: {movable: [person], movable: [dog]}"})
    EXPECT_TRUE(has(fault(text), "is given twice")) << text;
}

TEST_F(ConfigFile, OneDocumentIsRead) {
  EXPECT_TRUE(has(fault("orb: {levels: 3}\n---\norb: {levels: 4}\n"), "several documents"));
  EXPECT_TRUE(has(fault("--- {orb: {levels: 3}}\n---\norb: {levels: 4}\n"), "several documents"));
  EXPECT_TRUE(has(fault("orb: {levels: 3}\n--- {orb: {levels: 4}}\n"), "several documents"));
  EXPECT_EQ(fault("---\norb: {levels: 3}\n---\n"), "(accepted)");
  EXPECT_EQ(fault("%YAML 1.2\n---\norb: {levels: 3}\n...\n# the end\n"), "(accepted)");
}

TEST_F(ConfigFile, RefusesWhatIsOutOfRangeOrOfAnotherType) {
  for (const char* text :
       {"orb: {levels: 0}", "orb: {levels: 13}", "orb: {levels: 7.5}", "orb: {levels: many}",
        "orb: {levels: }", "orb: {levels: [1, 2]}", "orb: {levels: '8 '}", "orb: {levels: 0x8}",
        "depth: {max_m: .nan}", "depth: {max_m: .inf}", "depth: {max_m: nan}",
        "depth: {max_m: 1e999}", "depth: {max_m: -1}", "run: {seed: -1}",
        "segment: {precision: fp16}", "dynamic: {mode: maybe}", "motion: {tau_px: 0}"}) {
    const SlamConfig before = config_;
    EXPECT_TRUE(has(fault(text), " is not in ")) << text;
    EXPECT_EQ(config_.orb.levels, before.orb.levels);
    EXPECT_EQ(config_.depth.max_m, before.depth.max_m);
  }
}

TEST_F(ConfigFile, RefusesWhatIsNoMapOfKeys) {
  EXPECT_NE(fault("[1, 2]"), "(accepted)");
  EXPECT_NE(fault("just a sentence"), "(accepted)");
  EXPECT_NE(fault("orb: 7"), "(accepted)");
  EXPECT_NE(fault("orb: {features: {deeper: 1}}"), "(accepted)");
  EXPECT_TRUE(has(fault("orb:\n  features: 500\n  levels: [1,\n"), "c.yaml:"));
  EXPECT_NE(fault("orb: {features: *nowhere}"), "(accepted)");
  EXPECT_NE(fault("\tfeatures: 1"), "(accepted)");
  EXPECT_FALSE(schema_.load_yaml((folder_.path() / "absent.yaml").string()).ok());
  EXPECT_FALSE(schema_.load_yaml(folder_.path().string()).ok());
}

TEST_F(ConfigFile, F21NestingAliasesAndSizeAreLimited) {
  std::string maps, lists;
  for (int i = 0; i < 20; ++i) maps += "{a: ";
  EXPECT_TRUE(has(fault("x: " + maps + "1" + std::string(20, '}')), "nested too deep"));
  for (int i = 0; i < 100000; ++i) lists += '[';
  EXPECT_NE(fault("x: " + lists), "(accepted)");
  EXPECT_NE(fault("x: " + lists + std::string(100000, ']')), "(accepted)");
  EXPECT_TRUE(has(fault(std::string((1 << 20) + 1, '#')), "too large"));
  // Ten aliases to ten aliases to ...: a few lines that stand for ten million empty maps.
  std::string bomb = "a0: &a0 {}\n";
  for (int level = 1; level < 8; ++level) {
    const std::string below = "*a" + std::to_string(level - 1);
    bomb += "a" + std::to_string(level) + ": &a" + std::to_string(level) + " {";
    for (int i = 0; i < 10; ++i) bomb += "k" + std::to_string(i) + ": " + below + ", ";
    bomb += "}\n";
  }
  EXPECT_TRUE(has(fault(bomb), "too many entries"));
  // A list that repeats one long word: 100 kB that stand for 2 GB.
  std::string list = "segment: {movable: [&w " + std::string(50000, 'w');
  for (int i = 0; i < 40000; ++i) list += ",*w";
  EXPECT_TRUE(has(fault(list + "]}"), "too long"));
}

TEST_F(ConfigFile, WhatIsWrittenReadsBackTheSame) {
  Rng rng(1);
  // Set every key to something it accepts that is not its default, as far as one is found.
  for (const ConfigKey& key : schema_.keys()) {
    const std::string before = key.get();
    for (int i = 0; i < 200 && key.get() == before; ++i) {
      for (const std::string& text :
           {format_number(rng.uniform(0, 20)), std::to_string(rng.below(200)),
            std::to_string(rng.below(9)), std::string("true"), std::string("false"),
            std::string("int8"), std::string("harris"), std::string("geometry"),
            std::string("[dog, cat]")}) {
        if (key.range != "list" || text.front() == '[') (void)key.set(text);
      }
    }
    EXPECT_NE(key.get(), before) << key.name;
  }
  const std::string text = schema_.to_yaml();
  SlamConfig other;
  ConfigSchema other_schema = schema_of(other);
  ASSERT_NE(other_schema.to_yaml(), text);
  testing::write(folder_.path() / "written.yaml", text);
  const Status read = other_schema.load_yaml((folder_.path() / "written.yaml").string());
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(other_schema.to_yaml(), text);
}

TEST_F(ConfigFile, TheDefaultsAreWithinTheirRanges) {
  for (const ConfigKey& key : schema_.keys()) {
    EXPECT_TRUE(key.set(key.get())) << key.name << " = " << key.get() << " not in " << key.range;
    EXPECT_FALSE(key.meaning.empty()) << key.name;
  }
}

TEST_F(ConfigFile, F21MutatedFilesAreReadOrRefusedAndNothingElse) {
  const std::string good = schema_.to_yaml();
  const std::string spice = "{}[]:,&*!|>'\"#-?%@\n\t \\<=~0919.eE+xn";
  Rng rng(21);
  int refused = 0;
  for (int trial = 0; trial < 800; ++trial) {
    // A piece of the file, so that a trial is quick.
    const auto from = rng.below(static_cast<std::uint32_t>(good.size()));
    std::string text = good.substr(from, 20 + rng.below(300));
    const int edits = 1 + static_cast<int>(rng.below(6));
    for (int i = 0; i < edits && !text.empty(); ++i) {
      const auto at = rng.below(static_cast<std::uint32_t>(text.size()));
      switch (rng.below(4)) {
        case 0:
          text[at] = spice[rng.below(static_cast<std::uint32_t>(spice.size()))];
          break;
        case 1:
          text.insert(at, 1, static_cast<char>(rng.below(256)));
          break;
        case 2:
          text.erase(at, 1 + rng.below(8));
          break;
        default:
          text.insert(at, text.substr(rng.below(static_cast<std::uint32_t>(text.size())), 30));
      }
    }
    const Status status = load(text);
    if (status.ok()) continue;
    ++refused;
    ASSERT_EQ(status.error().kind, ErrorKind::kConfig);
  }
  EXPECT_GT(refused, 250);
  // Whatever was accepted on the way, every value is within its range.
  for (const ConfigKey& key : schema_.keys()) EXPECT_TRUE(key.set(key.get())) << key.name;
}

TEST(ParseFinite, TakesWholeFiniteNumbersOnly) {
  EXPECT_EQ(parse_finite("1.5"), 1.5);
  EXPECT_EQ(parse_finite("-2e3"), -2000);
  for (const char* text : {"", " 1", "1 ", "1,5", "nan", "inf", "-inf", "1e999", "one", "1.5m"})
    EXPECT_EQ(parse_finite(text), std::nullopt) << text;
  Rng rng(3);
  for (int i = 0; i < 1000; ++i) {
    const double factor = rng.normal();
    const double value = factor * std::pow(10.0, rng.uniform(-12, 12));
    EXPECT_EQ(parse_finite(format_number(value)), value);
  }
}

}  // namespace
}  // namespace ygslam
