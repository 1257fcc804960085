// What a run leaves behind: frames.csv, metrics.json, the folder.
#include <gtest/gtest.h>

#include <algorithm>
#include <clocale>
#include <cmath>
#include <limits>
#include <sstream>

#include "eval/loop_report.hpp"
#include "io/testing/temp_folder.hpp"
#include "io/trajectory_formats.hpp"
#include "system/metrics.hpp"
#include "system/run_writer.hpp"

namespace ygslam {
namespace {

FrameRecord record(std::uint32_t id, double t_s, TrackState state) {
  FrameRecord r;
  r.frame = FrameId{id};
  r.stamp = {to_ns(t_s)};
  r.state = state;
  r.pose = {KeyframeId{0}, SE3(Mat3::Identity(), Vec3(0, 0, -0.1 * id))};
  r.T_world_camera_live = SE3(Mat3::Identity(), Vec3(0, 0, 0.1 * id));
  return r;
}

std::vector<FrameRecord> sample() {
  std::vector<FrameRecord> frames;
  const TrackState states[] = {TrackState::kWaiting, TrackState::kTracking, TrackState::kLost,
                               TrackState::kLost,    TrackState::kWeak,     TrackState::kLost};
  for (std::uint32_t i = 0; i < 6; ++i) {
    frames.push_back(record(i, 100 + 0.5 * i, states[i]));
    frames.back().track_ms = i + 1;
    frames.back().mask_age_frames = i < 2 ? -1 : static_cast<int>(i);
  }
  return frames;
}

SlamOutcome outcome_of(const std::vector<FrameRecord>& frames) {
  RunLog log(true);
  for (const FrameRecord& frame : frames) log.add(frame, {});
  return log.outcome();
}

/// What FrameFiles makes of the frames.
std::string file_of(const std::vector<FrameRecord>& frames, const std::string& name,
                    bool with_times = true) {
  const testing::TempFolder folder;
  auto files = FrameFiles::create(folder.path(), 6, with_times);
  CHECK(files.ok());
  for (const FrameRecord& frame : frames) files->add(frame);
  CHECK(files->commit().ok());
  return testing::read(folder.path() / name);
}

Map one_keyframe() {
  Map map({8, 1.2});
  auto features = std::make_shared<Features>();
  map.add_keyframe(std::make_shared<KeyframeData>(KeyframeData{
                       KeyframeId{0}, FrameId{1}, {to_ns(100.5)}, features, FeatureGrid()}),
                   SE3(), kNoKeyframe, {});
  return map;
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  return parts;
}

TEST(FramesCsv, OneLinePerFrameWithAsManyCellsAsTheHeader) {
  for (const bool with_times : {true, false}) {
    const auto lines = split(file_of(sample(), "frames.csv", with_times), '\n');
    ASSERT_EQ(lines.size(), 7U);
    const auto header = split(lines[0], ',');
    for (std::size_t i = 1; i < lines.size(); ++i) {
      const auto commas = std::count(lines[i].begin(), lines[i].end(), ',');
      EXPECT_EQ(static_cast<std::size_t>(commas) + 1, header.size()) << lines[i];
    }
    EXPECT_EQ(split(lines[3], ',')[0], "101.000000");
    EXPECT_EQ(split(lines[3], ',')[2], "lost");
  }
}

TEST(FramesCsv, F37IsTheSameInALocaleWithDecimalCommas) {
  const std::string expected = file_of(sample(), "frames.csv");
  EXPECT_NE(expected.find("3.000"), std::string::npos);
  const std::string old = std::setlocale(LC_ALL, nullptr);
  for (const char* name : {"de_DE.UTF-8", "de_DE", "fr_FR.UTF-8"}) {
    if (std::setlocale(LC_ALL, name) != nullptr) break;
  }
  EXPECT_EQ(file_of(sample(), "frames.csv"), expected);
  std::setlocale(LC_ALL, old.c_str());
}

TEST(FramesCsv, FramesThatNobodySawHaveARow) {
  const testing::TempFolder folder;
  auto files = FrameFiles::create(folder.path(), 6, true);
  ASSERT_TRUE(files.ok());
  files->add(record(0, 100, TrackState::kTracking));
  files->add_missed({FrameId{1}, {to_ns(100.5)}});
  files->add_missed({.id = FrameId{2}, .stamp = {to_ns(101)}, .is_dropped = true});
  ASSERT_TRUE(files->commit().ok());
  const auto lines = split(testing::read(folder.path() / "frames.csv"), '\n');
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_TRUE(lines[2].starts_with("100.500000,1,unreadable,0,")) << lines[2];
  EXPECT_TRUE(lines[3].starts_with("101.000000,2,dropped,0,")) << lines[3];
  for (const std::string& line : lines)
    EXPECT_EQ(std::ranges::count(line, ','), std::ranges::count(lines[0], ',')) << line;
  EXPECT_EQ(split(testing::read(folder.path() / "objects.csv"), '\n').size(), 1U);
  EXPECT_EQ(read_tum_trajectory(folder.path() / "trajectory_live.txt")->size(), 1U);
}

TEST(ObjectsCsv, OneLinePerObjectWithAsManyCellsAsTheHeader) {
  auto frames = sample();
  TrackedObject person;
  person.id = ObjectId{7};
  person.class_id = 0;
  person.centre_world = {-1.25, 0.5, 3};
  person.body_world = {{-1.2, 0.5, 3.1}, {1, 0, 0}, 0.01 * Mat6::Identity()};
  TrackedObject mover = person;
  person.faded = true;
  mover.class_id = kUnknownClass;
  frames[1].objects = {person, mover};
  const auto lines = split(file_of(frames, "objects.csv"), '\n');
  ASSERT_EQ(lines.size(), 3U);
  const auto header = split(lines[0], ',');
  const auto row = split(lines[1], ',');
  ASSERT_EQ(row.size(), header.size());
  EXPECT_EQ(row[2], "7");
  EXPECT_EQ(row[3], "person");
  EXPECT_EQ(row[8], "-1.250");
  const auto column = [&](const char* name) {
    return static_cast<std::size_t>(std::ranges::find(header, name) - header.begin());
  };
  EXPECT_EQ(row.at(column("faded")), "1");
  EXPECT_EQ(split(lines[2], ',').at(column("faded")), "0");
  EXPECT_EQ(row.at(column("body_x_m")), "-1.200");
  EXPECT_EQ(row.at(column("body_yy_cm2")), "100.000");
  EXPECT_GT(std::stod(row.at(column("soon_x_m"))), -1.2 + 0.5);
  EXPECT_GT(std::stod(row.at(column("soon_xx_cm2"))), 900);
  EXPECT_EQ(split(lines[2], ',')[3], "unknown");
}

TEST(Trajectories, HoldTheFramesWithAPoseAndFollowTheKeyframe) {
  Map map = one_keyframe();
  const SlamOutcome outcome = outcome_of(sample());
  auto poses = final_trajectory(outcome.trajectory, {}, map);
  ASSERT_EQ(poses.size(), 2U) << "tracking and weak";
  EXPECT_EQ(poses[0].stamp.ns, to_ns(100.5));
  EXPECT_EQ(poses[1].stamp.ns, to_ns(102.0));
  EXPECT_NEAR(poses[1].T_world_camera.t().z(), 0.4, 1e-12);
  map.set_pose(KeyframeId{0}, SE3(Mat3::Identity(), Vec3(-1, 0, 0)));  // corrected later
  poses = final_trajectory(outcome.trajectory, {}, map);
  EXPECT_NEAR(poses[1].T_world_camera.t().x(), 1.0, 1e-12);
  const auto live = parse_tum_trajectory(file_of(sample(), "trajectory_live.txt"), "live").value();
  EXPECT_NEAR(live[1].T_world_camera.t().x(), 0.0, 1e-12) << "as delivered";
  EXPECT_EQ(keyframe_trajectory(map).size(), 1U);
}

TEST(Trajectories, WhatTrackingErredByAtAKeyframeIsSharedOutAmongTheFramesBeforeIt) {
  Map map = one_keyframe();  // of frame 1
  map.add_keyframe(
      std::make_shared<KeyframeData>(KeyframeData{
          KeyframeId{1}, FrameId{5}, {to_ns(102.5)}, std::make_shared<Features>(), FeatureGrid()}),
      SE3(Mat3::Identity(), Vec3(0, 0, -0.48)), KeyframeId{0}, {});
  Trajectory trajectory;
  for (std::uint32_t i = 1; i <= 6; ++i) {
    FrameRecord frame = record(i, 100 + 0.5 * i, TrackState::kTracking);
    frame.pose.reference = KeyframeId{i == 3 || i == 6 ? 1U : 0U};
    const double moved_m = i == 3 ? -0.2 : i == 6 ? 0.1 : 0.1 * (i - 1);
    frame.pose.T_camera_reference = SE3(Mat3::Identity(), Vec3(0, 0, -moved_m));
    trajectory.emplace_back(frame);
  }
  const std::vector<SE3> poses = corrected_poses(trajectory, {}, map);
  const double expected_m[] = {0, 0.12, 0.28, 0.36, 0.48, 0.58};
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(poses[i].t().z(), expected_m[i], 1e-7)
        << i << "; the third frame and the last are known relative to the second keyframe";
  // Frames that were found again are where they were found.
  const RevisedPoses revised = {{FrameId{2}, SE3(Mat3::Identity(), Vec3(1, 0, 0))}};
  EXPECT_NEAR(corrected_poses(trajectory, revised, map)[1].t().x(), -1, 1e-12);
}

TEST(Metrics, SayWhatHappened) {
  SlamOutcome outcome = outcome_of(sample());
  outcome.statistics.masks_used = 4;
  outcome.statistics.missed = 2;
  outcome.statistics.masks_failed = 2;
  outcome.statistics.segmenter_silent = true;
  for (int i = 1; i <= 100; ++i) outcome.statistics.segment.wall_ms.add(101 - i);
  FrameReaderCounts input;
  input.offered = 9;
  input.readable = 6;
  input.dropped = 1;
  input.skipped.push_back({"rgb/3.png", "truncated"});
  input.skipped_images = 1200;
  input.without_depth = 3;
  RunFacts facts;
  facts.mode = mode_name(DynamicMode::kFull);
  facts.seed = 5;
  facts.trajectory_frames = 1;
  const auto json = metrics_json(outcome, one_keyframe(), input, facts);
  EXPECT_EQ(json["frames"], 9);
  EXPECT_EQ(json["readable"], 6);
  EXPECT_EQ(json["tracked"], 2);
  EXPECT_NEAR(json["coverage"].get<double>(), 2.0 / 8, 1e-12) << "of the frames offered";
  EXPECT_NEAR(coverage(outcome), 2.0 / 8, 1e-12);
  EXPECT_EQ(json["trajectory_frames"], 1);
  EXPECT_EQ(json["unjoined_frames"], 1);
  EXPECT_EQ(json["lost_interval_count"], 2);
  ASSERT_EQ(json["lost_intervals"].size(), 2U);
  EXPECT_EQ(json["lost_intervals"][0][0], 101.0);
  EXPECT_EQ(json["lost_intervals"][0][1], 101.5);
  EXPECT_EQ(json["lost_intervals"][1][0], 102.5);
  EXPECT_EQ(json["keyframes"], 1);
  EXPECT_EQ(json["skipped_images"][0]["file"], "rgb/3.png");
  EXPECT_EQ(json["skipped_image_count"], 1200);
  EXPECT_EQ(json["colour_without_depth"], 3);
  EXPECT_EQ(json["dropped"], 1);
  EXPECT_EQ(json["masks_failed"], 2);
  EXPECT_EQ(json["segmenter_silent"], true);
  EXPECT_EQ(json["mask_age_frames"]["median"], 3);
  EXPECT_EQ(json["mask_age_frames"]["p95"], 5);
  const auto& segment = json["timing_ms"]["segment"];
  EXPECT_NEAR(segment["median"].get<double>(), 50.0, 0.3);
  EXPECT_NEAR(segment["p95"].get<double>(), 95.0, 0.5);
  EXPECT_NEAR(segment["p99"].get<double>(), 99.0, 0.5);
  EXPECT_EQ(segment["max"], 100.0);
  EXPECT_EQ(segment["mean"], 50.5);
  EXPECT_TRUE(json["timing_ms"]["map"].is_null()) << "nothing was mapped";
  for (const char* key : {"startup_s", "wall_s", "peak_rss_mb", "seed", "mode", "segmenter",
                          "precision", "version", "machine", "cpu_ms", "landmarks", "masks_used"})
    EXPECT_TRUE(json.contains(key)) << key;
}

TEST(RunLog, WhatIsLostAfterResetIsALossOfItsOwn) {
  RunLog log(true);
  log.add(record(0, 100, TrackState::kLost), {});
  log.clear();
  log.add(record(1, 101, TrackState::kLost), {});
  ASSERT_EQ(log.statistics().lost_intervals.size(), 1U);
  EXPECT_EQ(log.statistics().lost_intervals[0].first, Timestamp{to_ns(101)});
}

TEST(RunLog, FramesThatNeverCameAreALossAfterHalfASecond) {
  RunLog log(true);
  log.add(record(0, 100, TrackState::kTracking), {});
  for (const double t_s : {100.1, 100.2, 100.4}) log.miss({to_ns(t_s)});
  log.add(record(4, 100.6, TrackState::kTracking), {});
  EXPECT_TRUE(log.statistics().lost_intervals.empty());
  for (const double t_s : {100.7, 101.0, 101.2, 109.0}) log.miss({to_ns(t_s)});
  log.add(record(9, 109.1, TrackState::kLost), {});
  log.miss({to_ns(109.2)});
  log.add(record(11, 109.3, TrackState::kTracking), {});
  ASSERT_EQ(log.statistics().lost_intervals.size(), 1U) << "all of it without a pose";
  EXPECT_EQ(log.statistics().lost_intervals[0].first, Timestamp{to_ns(100.7)});
  EXPECT_EQ(log.statistics().lost_intervals[0].second, Timestamp{to_ns(109.2)});
  EXPECT_EQ(log.statistics().missed, 8U);
  EXPECT_NEAR(coverage(log.outcome()), 3.0 / 12, 1e-12);
}

TEST(RunLog, LossesWithoutEndAreCountedAndTheFirstAreKept) {
  RunLog log(true);
  for (std::uint32_t i = 0; i < 3000; ++i)
    log.add(record(i, i, i % 2 == 0 ? TrackState::kTracking : TrackState::kLost), {});
  EXPECT_EQ(log.statistics().lost_interval_count, 1500U);
  ASSERT_EQ(log.statistics().lost_intervals.size(), kMostIntervalsTold);
  EXPECT_EQ(log.statistics().lost_intervals.back().second, Timestamp{to_ns(1999)});
}

TEST(RunLog, AReadOutThatDiffersNamesWhereTheOneInUseComesFrom) {
  std::vector<std::string> lines;
  const log::ScopedSink sink(std::make_shared<const log::Sink>(
      [&](log::Level, std::string line) { lines.push_back(std::move(line)); }));
  TrackResult result;
  result.shutter = ShutterReport{0.0216, 0.0004, 0.026, false, {0.0216, 0.0216, 0}};
  RunLog(true, "Asus, taken from the name of the folder").add(FrameRecord{}, result);
  RunLog(true).add(FrameRecord{}, result);
  result.shutter->taken_over = true;
  RunLog found(true, "Kinect, guessed by the 525 px");
  for (int times = 0; times < 2; ++times) found.add(FrameRecord{}, result);
  found.clear();
  found.add(FrameRecord{}, result);
  ASSERT_EQ(lines.size(), 5U);
  EXPECT_EQ(lines[0],
            "the camera seems to read an image in 21.6 +- 0.4 ms; 26.0 ms (Asus, taken from the "
            "name of the folder) are in use; see `ygslam calibrate`");
  EXPECT_NE(lines[1].find("26.0 ms (told by the caller) are in use"), std::string::npos);
  EXPECT_NE(lines[2].find("ms, not in 26.0 ms (Kinect, guessed by the 525 px): taken into account"),
            std::string::npos);
  EXPECT_EQ(lines[3].find("guessed"), std::string::npos) << "it is not in use any more";
  EXPECT_EQ(lines[4], lines[2]) << "after reset it is";
}

TEST(Metrics, TheSummaryTellsOfFramesWithoutAPose) {
  SlamOutcome outcome;
  outcome.statistics.frames = outcome.statistics.tracked = 135;
  FrameReaderCounts input;
  input.readable = 135;
  RunFacts facts;
  facts.wall_s = 8.04;
  facts.trajectory_frames = 135;
  EXPECT_EQ(summary_text(outcome, one_keyframe(), input, facts),
            "135 frames, 100.0 % tracked, 1 keyframe, 0 landmarks, 8.0 s");
  input.readable = 240;
  input.dropped = 105;
  outcome.statistics.missed = 135;
  facts.trajectory_frames = 100;
  EXPECT_EQ(summary_text(outcome, one_keyframe(), input, facts),
            "270 frames, 105 dropped (too late), 30 unreadable, 50.0 % tracked (35 frames in a "
            "submap never joined), 1 keyframe, 0 landmarks, 8.0 s");
}

TEST(Metrics, AnEmptyRunHasNoCoverageAndNoCrash) {
  const auto json = metrics_json({}, Map({8, 1.2}), {}, {});
  EXPECT_EQ(json["coverage"], 0.0);
  EXPECT_TRUE(json["mask_age_frames"].is_null());
  EXPECT_TRUE(json["lost_intervals"].empty());
}

TEST(LoopsCsv, TheReportReadsEveryStage) {
  std::vector<LoopAttempt> attempts;
  for (int v = 0; v <= static_cast<int>(PlaceVerdict::kAgrees); ++v) {
    attempts.emplace_back().match.verdict = static_cast<PlaceVerdict>(v);
    if (attempts.back().match.verdict == PlaceVerdict::kAgrees)
      attempts.back().outcome = LoopOutcome::kTooFar;
  }
  for (int o = static_cast<int>(LoopOutcome::kOtherSubmap);
       o <= static_cast<int>(LoopOutcome::kClosed); ++o) {
    attempts.emplace_back().match.verdict = PlaceVerdict::kAgrees;
    attempts.back().outcome = static_cast<LoopOutcome>(o);
  }
  attempts.front().stamp = Timestamp{2'500'000'000};
  attempts.front().place_stamp = Timestamp{1'500'000'000};
  attempts.front().path_m = std::numeric_limits<double>::infinity();
  for (LoopAttempt& attempt : attempts) attempt.keyframe = attempt.match.place = KeyframeId{3};
  const testing::TempFolder folder;
  testing::write(folder.path() / "loops.csv", loops_csv(attempts, 6));
  const auto rows = read_loops(folder.path() / "loops.csv");
  ASSERT_TRUE(rows.ok()) << rows.error().message;
  const auto stages = loop_stages();
  ASSERT_EQ(rows->size(), stages.size());
  for (std::size_t i = 0; i < stages.size(); ++i) EXPECT_EQ((*rows)[i].stage, stages[i]);
  EXPECT_EQ(rows->front().stamp.ns, 2'500'000'000);
  EXPECT_EQ(rows->front().place_stamp.ns, 1'500'000'000);
  EXPECT_TRUE(std::isinf(rows->front().path_m));
}

TEST(LoopsCsv, NumbersBeyondAllIntegersAreWritten) {
  std::vector<LoopAttempt> attempts(1);
  attempts.front().path_m = 1e155;
  attempts.front().correction_m = -1e300;
  const std::string line = loops_csv(attempts, 6);
  EXPECT_NE(line.find(",9000000000000000.000,-9000000000000000.000,"), std::string::npos) << line;
}

TEST(RunWriter, WritesEveryFileAndLeavesOthersAlone) {
  const testing::TempFolder folder;
  testing::write(folder.path() / "mine.txt", "keep");
  testing::write(folder.path() / "trajectory.txt", "old");
  {
    auto files = FrameFiles::create(folder.path(), 6, true);
    ASSERT_TRUE(files.ok());
    for (const FrameRecord& frame : sample()) files->add(frame);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "frames.csv")) << "not before it is whole";
    const auto kept = files->trajectory();
    ASSERT_TRUE(kept.ok());
    ASSERT_EQ(kept->size(), 2U) << "the tracked ones";
    EXPECT_EQ(kept->back().frame, FrameId{4});
    EXPECT_EQ(kept->back().T_camera_reference.unpacked().t(), Vec3(0, 0, -0.1 * 4));
    ASSERT_TRUE(files->commit().ok());
  }
  const SlamOutcome outcome = outcome_of(sample());
  const auto poses = final_trajectory(outcome.trajectory, {}, one_keyframe());
  ASSERT_TRUE(write_run(folder.path(), poses, one_keyframe(), {}, 6).ok());
  EXPECT_EQ(testing::read(folder.path() / "mine.txt"), "keep");
  EXPECT_EQ(read_tum_trajectory(folder.path() / "trajectory.txt")->size(), 2U);
  EXPECT_EQ(read_tum_trajectory(folder.path() / "trajectory_live.txt")->size(), 2U);
  EXPECT_EQ(read_tum_trajectory(folder.path() / "keyframes.txt")->size(), 1U);
  EXPECT_TRUE(testing::read(folder.path() / "map.ply").starts_with("ply\n"));
  EXPECT_EQ(split(testing::read(folder.path() / "frames.csv"), '\n').size(), 7U);
  EXPECT_EQ(split(testing::read(folder.path() / "objects.csv"), '\n').size(), 1U);
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path()))
    ++files;
  EXPECT_EQ(files, 7U) << "no temporary file is left";
  const Status nowhere =
      write_run(folder.path() / "absent" / "deeper", poses, one_keyframe(), {}, 6);
  EXPECT_TRUE(nowhere.ok() || nowhere.error().kind == ErrorKind::kOutput);
}

}  // namespace
}  // namespace ygslam
