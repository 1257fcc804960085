#include "eval/loop_report.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

const std::string kHeader =
    "stamp,keyframe,place,place_stamp,outcome,verdict,score,matches,guided,inliers,contradiction,"
    "path_m,correction_m,correction_rad,agreeing,stretch\n";
const std::string kClosedLine =
    "40.000000,90,7,2.000000,closed,agrees,0.310,50,200,120,0.020,31.500,0.250,0.100,4,1.250\n";
const std::string kRefusedLine =
    "41.000000,92,8,3.000000,refused,few inliers,0.200,30,60,12,0.000,0.000,0.000,0.000,0,0.000\n";

Result<std::vector<LoopRow>> read_text(const std::string& text) {
  const testing::TempFolder folder;
  testing::write(folder.path() / "loops.csv", text);
  return read_loops(folder.path() / "loops.csv");
}

StampedPose pose_at(double t_s, const Vec3& at, double yaw_rad = 0) {
  return {Timestamp{to_ns(t_s)}, SE3(so3_exp(Vec3(0, yaw_rad, 0)), at)};
}

TEST(LoopReport, ReadsWhatARunWrites) {
  const auto rows = read_text(kHeader + kClosedLine + kRefusedLine);
  ASSERT_TRUE(rows.ok()) << rows.error().message;
  ASSERT_EQ(rows->size(), 2U);
  const LoopRow& closed = rows->front();
  EXPECT_EQ(closed.stamp.ns, 40'000'000'000);
  EXPECT_EQ(closed.place_stamp.ns, 2'000'000'000);
  EXPECT_EQ(closed.keyframe, 90);
  EXPECT_EQ(closed.place, 7);
  EXPECT_EQ(closed.stage, kClosedStage);
  EXPECT_EQ(closed.inliers, 120);
  EXPECT_DOUBLE_EQ(closed.path_m, 31.5);
  EXPECT_DOUBLE_EQ(closed.correction_m, 0.25);
  EXPECT_EQ(closed.agreeing, 4);
  EXPECT_DOUBLE_EQ(closed.stretch, 1.25);
  EXPECT_EQ(rows->back().stage, "few inliers");
}

TEST(LoopReport, ARunWithoutComparisonsIsNoFault) {
  const auto rows = read_text(kHeader);
  ASSERT_TRUE(rows.ok()) << rows.error().message;
  EXPECT_TRUE(rows->empty());
  EXPECT_NE(format_loops({}, true).find("no keyframe was compared"), std::string::npos);
}

TEST(LoopReport, FaultsNameFileAndLine) {
  const auto with = [](const char* was, const char* is) {
    std::string line = kClosedLine;
    return line.replace(line.find(was), std::string_view(was).size(), is);
  };
  const std::pair<std::string, const char*> faults[] = {
      {"", "loops.csv:1: "},
      {"stamp,keyframe\n" + kClosedLine, "loops.csv:1: no column place"},
      {kHeader + kClosedLine + kClosedLine.substr(0, 40) + "\n", "loops.csv:3: has "},
      {kHeader + with("31.500", "far"), "loops.csv:2: path_m 'far'"},
      {kHeader + with("31.500", "nan"), "loops.csv:2: path_m 'nan'"},
      {kHeader + with("closed", "done"), "loops.csv:2: outcome 'done'"},
      {kHeader + with(",90,", ",9.5,"), "loops.csv:2: keyframe '9.5'"},
      {kHeader + with(",90,", ",-1,"), "loops.csv:2: keyframe '-1'"},
      {kHeader + with("40.000000", "now"), "loops.csv:2: stamp 'now'"}};
  for (const auto& [text, said] : faults) {
    const auto rows = read_text(text);
    ASSERT_FALSE(rows.ok()) << said;
    EXPECT_EQ(rows.error().kind, ErrorKind::kInput);
    EXPECT_NE(rows.error().message.find(said), std::string::npos) << rows.error().message;
  }
  EXPECT_FALSE(read_loops("/nowhere/loops.csv").ok());
}

TEST(LoopReport, APlaceIsTrueWhereTheCamerasStoodNearAndLookedAlike) {
  std::vector<LoopRow> rows(5);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].stamp.ns = to_ns(10 + static_cast<double>(i));
    rows[i].place_stamp.ns = 0;
    rows[i].stage = i == 0 || i == 1 ? "closed" : "contradicts";
  }
  constexpr double kDeg = std::numbers::pi / 180;
  const std::vector<StampedPose> truth = {
      pose_at(0, Vec3::Zero()), pose_at(10.001, Vec3(2.9, 0, 0), 50 * kDeg),
      pose_at(11, Vec3(3.1, 0, 0)), pose_at(12, Vec3(0.1, 0, 0), 70 * kDeg),
      pose_at(13, Vec3(0, 1, 0))};
  const auto judged = judge_loops(rows, truth, 0.02);
  ASSERT_TRUE(judged[0].truth && judged[1].truth && judged[2].truth && judged[3].truth);
  EXPECT_FALSE(judged[4].truth);  // no pose of the truth at 14 s
  EXPECT_TRUE(judged[0].truth->same_place());
  EXPECT_NEAR(judged[0].truth->turned_rad, 50 * kDeg, 1e-6);
  EXPECT_FALSE(judged[1].truth->same_place());
  EXPECT_FALSE(judged[2].truth->same_place());
  EXPECT_TRUE(judged[3].truth->same_place());
  const auto json = loops_json(judged, true);
  EXPECT_EQ(json["stages"]["closed"]["true_places"], 1);
  EXPECT_EQ(json["stages"]["closed"]["false_places"], 1);
  EXPECT_EQ(json["stages"]["contradicts"]["compared"], 3);
  EXPECT_EQ(json["stages"]["contradicts"]["true_places"], 1);
  EXPECT_EQ(json["closed"].size(), 2U);
  EXPECT_NE(format_loops(judged, true).find("NO"), std::string::npos);
}

}  // namespace
}  // namespace ygslam
