// Every setting at both ends of its range: the session opens or says which rule forbids it, and
// frames go through it. Nothing aborts.
#include <gtest/gtest.h>

#include <set>

#include "io/image_file.hpp"
#include "io/testing/temp_folder.hpp"
#include "io/text.hpp"
#include "system/parts.hpp"
#include "system/session.hpp"
#include "system/testing/rendered_recording.hpp"

namespace ygslam::system_test {
namespace {

using testing::TempFolder;
using Setting = std::pair<std::string, std::string>;  // key, value

/// What a key may be at most and at least, or each of its choices.
std::vector<std::string> ends_of(const ConfigKey& key) {
  if (key.name == "run.without") return {"[]", "[" + part_names() + "]"};
  if (key.range == "list") return {"[]", "[person, animals, vehicles, handheld, furniture]"};
  std::vector<std::string> ends;
  for (const std::string& separator : {std::string(" .. "), std::string(" | ")}) {
    std::size_t begin = 0;
    for (std::size_t end; (end = key.range.find(separator, begin)) != std::string::npos;
         begin = end + separator.size())
      ends.push_back(key.range.substr(begin, end - begin));
    if (begin > 0) ends.push_back(key.range.substr(begin));
  }
  return ends;
}

class Settings : public ::testing::Test {
 protected:
  // A mover and its masks, so that every part has work.
  static void SetUpTestSuite() {
    sim::SequenceOptions options = small(0.4);
    options.width = 160;
    options.height = 120;
    recording_ = std::make_unique<Recording>(record("moving_box", options));
    masks_ = std::make_unique<TempFolder>();
    for (std::size_t i = 0; i < recording_->frames.size(); ++i) {
      testing::write(masks_->path() / (format_stamp(recording_->frames[i]->stamp, 9) + ".png"),
                     encode_png(recording_->ids[i]));
    }
  }
  static void TearDownTestSuite() {
    recording_.reset();
    masks_.reset();
  }

  /// Runs the frames with these settings beside the defaults. @return why not, empty if it ran.
  static std::string run(const std::vector<Setting>& settings) {
    SessionOptions options;
    ConfigSchema schema = schema_of(options.config);
    for (const auto& [key, value] : settings) {
      const Status set = schema.set(key, value, "test");
      EXPECT_TRUE(set.ok()) << set.error().message;
    }
    if (auto config = resolved(options.config); config.ok())
      options.config = std::move(config).value();
    options.camera = recording_->camera.config();
    options.segmenter = SegmenterKind::kMasks;
    options.masks_dir = masks_->path();
    options.deterministic = true;
    auto session = open_session(std::move(options));
    if (!session.ok()) {
      EXPECT_EQ(session.error().kind, ErrorKind::kConfig);
      return session.error().message;
    }
    for (const FramePtr& frame : recording_->frames) (void)session->runner->process(frame);
    const SlamOutcome& outcome = session->runner->finish();
    EXPECT_EQ(outcome.statistics.frames, recording_->frames.size());
    for (const StampedPose& pose :
         final_trajectory(outcome.trajectory, outcome.revised, session->runner->map())) {
      EXPECT_TRUE(pose.T_world_camera.is_finite());
    }
    (void)session->runner->cloud();
    return "";
  }

  static inline std::unique_ptr<Recording> recording_;
  static inline std::unique_ptr<TempFolder> masks_;
};

TEST_F(Settings, EachAtBothEndsOfItsRangeRunsOrNamesTheRuleItBreaks) {
  SlamConfig config;
  int refused = 0;
  const ConfigSchema schema = schema_of(config);
  for (const ConfigKey& key : schema.keys()) {
    const auto ends = ends_of(key);
    ASSERT_GE(ends.size(), 2U) << key.name << ": " << key.range;
    for (const std::string& end : ends) {
      SCOPED_TRACE(key.name + " = " + end);
      const std::string why_not = run({{key.name, end}});
      if (why_not.empty()) continue;
      ++refused;
      EXPECT_NE(why_not.find(key.name), std::string::npos) << why_not;
    }
  }
  EXPECT_GT(refused, 0) << "some ends do not go with the defaults";
}

TEST_F(Settings, PairsThatARuleSpeaksOfRunAtTheEndsThatKeepIt) {
  const std::vector<std::pair<std::string, std::string>> pairs = {
      {"depth.min_m", "depth.max_m"},
      {"tracking.weak_position_std_m", "tracking.lost_position_std_m"}};
  SlamConfig config;
  const ConfigSchema schema = schema_of(config);
  const auto ends = [&](const std::string& name) {
    for (const ConfigKey& key : schema.keys())
      if (key.name == name) return ends_of(key);
    ADD_FAILURE() << "no key " << name;
    return std::vector<std::string>{};
  };
  for (const auto& [lower, upper] : pairs) {
    const auto low_ends = ends(lower), high_ends = ends(upper);
    EXPECT_EQ(run({{lower, low_ends[0]}, {upper, high_ends[0]}}), "") << lower;
    EXPECT_EQ(run({{lower, low_ends[0]}, {upper, high_ends[1]}}), "") << lower;
    const std::string crossed = run({{lower, low_ends[1]}, {upper, high_ends[0]}});
    EXPECT_NE(crossed.find(lower), std::string::npos) << crossed;
    EXPECT_NE(crossed.find(upper), std::string::npos) << crossed;
  }
}

TEST_F(Settings, RandomOnesRunOrNameTheRulesTheyBreak) {
  SlamConfig config;
  const ConfigSchema schema = schema_of(config);
  Rng rng(11);
  for (int trial = 0; trial < 40; ++trial) {
    std::vector<Setting> settings;
    std::string told;
    for (int i = 0; i < 6; ++i) {
      const auto& key = schema.keys()[rng.below(static_cast<std::uint32_t>(schema.keys().size()))];
      const auto ends = ends_of(key);
      settings.emplace_back(key.name, ends[rng.below(static_cast<std::uint32_t>(ends.size()))]);
      told += settings.back().first + "=" + settings.back().second + " ";
    }
    SCOPED_TRACE(told);
    (void)run(settings);
  }
}

TEST_F(Settings, TheLiveRunnerTakesTheEndsOfItsOwnSettings) {
  SlamConfig config;
  const ConfigSchema schema = schema_of(config);
  for (const ConfigKey& key : schema.keys()) {
    if (!key.name.starts_with("run.")) continue;
    for (const std::string& end : ends_of(key)) {
      SessionOptions options;
      ASSERT_TRUE(schema_of(options.config).set(key.name, end, "test").ok());
      options.config = resolved(options.config).value();
      options.camera = recording_->camera.config();
      options.segmenter = SegmenterKind::kMasks;
      options.masks_dir = masks_->path();
      options.may_wait = true;
      auto session = open_session(std::move(options));
      ASSERT_TRUE(session.ok()) << session.error().message;
      for (const FramePtr& frame : recording_->frames) (void)session->runner->process(frame);
      EXPECT_EQ(session->runner->finish().statistics.frames, recording_->frames.size());
    }
  }
}

TEST(Validate, ThereAreFewSettingsAndEachSaysWhenToChangeIt) {
  SlamConfig config;
  const ConfigSchema schema = schema_of(config);
  EXPECT_LE(schema.keys().size(), 45U);
  for (const ConfigKey& key : schema.keys()) EXPECT_GT(key.when.size(), 15U) << key.name;
}

TEST(Validate, PlacesAreVerifiedByBoundsOfTheirOwn) {
  const PlaceVerifierConfig own;
  const PlaceVerifierConfig used = resolved(SlamConfig()).value().loop.finder.verifier;
  EXPECT_EQ(used.noise.sigma_px, own.noise.sigma_px);
  EXPECT_EQ(used.noise.plane_depth_sigma_scale, own.noise.plane_depth_sigma_scale);
  EXPECT_EQ(used.pose.gate_chi2_pixel, own.pose.gate_chi2_pixel);
  EXPECT_EQ(used.pose.tail_dof, own.pose.tail_dof);
}

/// What run.without turns off.
auto switches(const SlamConfig& c) {
  return std::tuple(c.dynamic.epipolar.prior, c.dynamic.ego_motion.enabled,
                    c.dynamic.boundary.enabled, c.dynamic.classifier.vote_of_neighbours,
                    c.dynamic.classifier.min_moving_share, c.tracking.free_space.enabled,
                    c.mapping.noise.edge_weight, c.tracking.pose.use_local_map, c.close_loops,
                    c.mapping.local_bundle, c.tracking.starts_submaps, c.dense.enabled,
                    c.tracking.ego_mask.enabled, c.tracking.screens.enabled,
                    c.tracking.follow.max_frames, c.segment.fallback);
}

std::vector<std::string> parts() {
  std::istringstream names(part_names());
  std::vector<std::string> parts;
  for (std::string name; std::getline(names >> std::ws, name, ',');) parts.push_back(name);
  return parts;
}

TEST(Validate, EveryPartThatCanBeLeftOutChangesSomething) {
  for (const std::string& name : parts()) {
    SlamConfig config = resolved(SlamConfig()).value();
    const auto before = switches(config);
    ASSERT_TRUE(leave_out(name, config).ok()) << name;
    EXPECT_NE(switches(config), before) << name;
  }
}

/// config.yaml of a run tells what was asked for, whoever writes it.
TEST(Validate, WhatResolvedSettingsSayIsWhatWasWritten) {
  for (const DynamicMode mode :
       {DynamicMode::kOff, DynamicMode::kGeometry, DynamicMode::kSemantic, DynamicMode::kFull}) {
    SlamConfig config;
    config.dynamic.mode = mode;
    config.segment.movable = {"animals", "chair"};
    config.orb.levels = 5;
    config.mapping.noise.sigma_px = 0.7;
    for (const std::string& part : parts()) {
      config.run.without = {part};
      SlamConfig once = resolved(config).value();
      EXPECT_EQ(schema_of(once).to_yaml(), schema_of(config).to_yaml()) << part;
      const SlamConfig twice = resolved(once).value();
      EXPECT_EQ(switches(twice), switches(once)) << part;
      EXPECT_EQ(twice.dynamic.masks.mask.movable, once.dynamic.masks.mask.movable);
    }
  }
}

TEST(Validate, TellsOfEveryRuleAtOnce) {
  SlamConfig config;
  EXPECT_TRUE(validate(config).ok());
  config.orb.levels = 0;
  config.segment.network.input_width = 100;
  config.run.without = {"wheels"};
  config.depth.min_m = 50;
  config.depth.max_m = std::numeric_limits<double>::quiet_NaN();
  config.segment.movable = {"unicorn"};
  const Status status = validate(config);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::kConfig);
  const std::string& message = status.error().message;
  for (const char* part :
       {"orb.levels = '0'", "segment.input_width must", "run.without: no part 'wheels'",
        "depth.max_m = 'nan'", "segment.movable: ", "unicorn"})
    EXPECT_NE(message.find(part), std::string::npos) << part << " not in: " << message;
  EXPECT_EQ(message.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace ygslam::system_test
