#include "eval/error_series.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "eval/report.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

// A truth at 30 Hz and an estimate of it with a slow drift and a gap.
Evaluation drifting(int count) {
  std::vector<StampedPose> truth, estimate;
  for (int i = 0; i < count; ++i) {
    const double s = 0.03 * i;
    const SE3 pose(so3_exp({0, 0.1 * s, 0}), {s, std::sin(s), std::cos(2 * s)});
    const Timestamp stamp{1'000'000'000 + i * std::int64_t{33'333'333}};
    truth.push_back({stamp, pose});
    if (i < 20 || i > 25) estimate.push_back({stamp, pose * SE3(Mat3::Identity(), {0, 0, s * s})});
  }
  return *evaluate_in_detail(truth, estimate);
}

std::vector<std::vector<std::string>> cells(const std::string& csv) {
  std::vector<std::vector<std::string>> rows;
  for (const TextLine& line : data_lines(csv)) {
    std::vector<std::string> row(1);
    for (const char c : line.text) {
      if (c == ',') {
        row.emplace_back();
      } else {
        row.back().push_back(c);
      }
    }
    rows.push_back(row);
  }
  return rows;
}

TEST(ErrorSeries, TheStatisticsOfTheRowsAreThoseOfTheReport) {
  const Evaluation evaluation = drifting(100);
  const auto rows = cells(errors_csv(evaluation.series));
  ASSERT_EQ(rows.size(), 1 + evaluation.report.pairs);
  const auto column = [&](const char* name) {
    const auto at = std::find(rows[0].begin(), rows[0].end(), name) - rows[0].begin();
    std::vector<double> values;
    for (std::size_t i = 1; i < rows.size(); ++i) {
      EXPECT_EQ(rows[i].size(), rows[0].size());
      const std::string& cell = rows[i][static_cast<std::size_t>(at)];
      if (!cell.empty()) values.push_back(*parse_number(cell));
    }
    return values;
  };
  const EvalReport& report = evaluation.report;
  EXPECT_NEAR(summarize(column("ate_m")).rmse, report.ate_m.rmse, 1e-8);
  EXPECT_NEAR(summarize(column("ate_deg")).max, report.ate_rot_deg.max, 1e-8);
  EXPECT_EQ(column("rpe30_m").size(), report.rpe_frames->trans_m.count);
  EXPECT_NEAR(summarize(column("rpe30_deg")).mean, report.rpe_frames->rot_deg.mean, 1e-8);
  EXPECT_EQ(column("rpe1s_m").size(), report.rpe_seconds->trans_m.count);
  EXPECT_NEAR(summarize(column("rpe1s_m")).rmse, report.rpe_seconds->trans_m.rmse, 1e-8);
}

TEST(ErrorSeries, ARowIsTheDistanceOfItsOwnPositions) {
  for (const auto& row : cells(error_rows(drifting(60).series))) {
    const auto value = [&](std::size_t i) { return *parse_number(row[i]); };
    const Vec3 estimate(value(1), value(2), value(3));
    const Vec3 truth(value(4), value(5), value(6));
    EXPECT_NEAR((estimate - truth).norm(), value(7), 1e-8);
  }
}

TEST(ErrorSeries, CellsWithoutAPairAreEmpty) {
  const auto rows = cells(error_rows(drifting(40).series, "x,"));
  EXPECT_EQ(rows.front().front(), "x");
  EXPECT_FALSE(rows.front()[10].empty());
  EXPECT_TRUE(rows.back()[10].empty()) << "no pose 30 frames later";
  EXPECT_TRUE(rows.back()[13].empty());
}

TEST(Comparison, MarksTheBestOfEachColumn) {
  const Evaluation good = drifting(60);
  Evaluation bad = drifting(100);
  const std::string text = format_comparison(
      std::vector<NamedReport>{{"good.txt", good.report}, {"bäd.txt", bad.report}});
  const auto lines = data_lines(text);
  ASSERT_GE(lines.size(), 3U);
  EXPECT_GE(std::count(lines[1].text.begin(), lines[1].text.end(), '*'), 5);
  EXPECT_EQ(lines[2].text.find("bäd.txt"), 0U);
  EXPECT_EQ(lines[1].text.find("good.txt"), 0U);
  const std::string alone = format_comparison(std::vector<NamedReport>{{"good.txt", good.report}});
  EXPECT_EQ(data_lines(alone)[1].text.find('*'), std::string_view::npos);
}

TEST(Evaluate, PosesWithoutStampsSayNothingAboutSeconds) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < 60; ++i) poses.push_back({{i}, SE3(Mat3::Identity(), {0.1 * i, 0, 0})});
  const auto report = evaluate(poses, poses, {.max_diff_s = 0, .has_stamps = false});
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->pairs, 60U);
  EXPECT_TRUE(report->rpe_frames.has_value());
  EXPECT_FALSE(report->rpe_seconds.has_value());
  EXPECT_TRUE(report->warnings.empty());
}

}  // namespace
}  // namespace ygslam
