// What Slam::process() tells besides the pose: events and how certain the pose is.
#include <gtest/gtest.h>

#include <algorithm>

#include "facade/testing/film.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam::api {
namespace {

using testing::code_of;
using testing::Film;
using testing::film;
using testing::kHeight;
using testing::kWidth;
using testing::settings_for;

Settings deterministic_for(const Film& seen) {
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  return settings;
}

bool has(const Result& result, Event event) {
  return std::ranges::find(result.events, event) != result.events.end();
}

/// Sees nothing at all.
struct Darkness {
  std::vector<std::uint8_t> rgb = std::vector<std::uint8_t>(3 * kWidth * kHeight);
  std::vector<float> depth_m = std::vector<float>(kWidth * kHeight);
  [[nodiscard]] Frame at(std::int64_t t_ns) const { return {t_ns, rgb.data(), depth_m.data()}; }
};

TEST(Events, TellOfKeyframesOfBeingLostAndFoundAndOfASavedMap) {
  const Film& seen = film("static_xyz");
  const ygslam::testing::TempFolder folder;
  const Darkness dark;
  Slam slam = Slam::open(deterministic_for(seen));
  int keyframes = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    const Result result = slam.process(seen[i]);
    keyframes += has(result, Event::kKeyframe) ? 1 : 0;
    EXPECT_FALSE(has(result, Event::kLost) || has(result, Event::kRelocalised)) << i;
  }
  EXPECT_GT(keyframes, 0);
  EXPECT_EQ(static_cast<std::size_t>(keyframes), slam.map().keyframes.size());
  slam.save_map((folder.path() / "room.ygmap").string());
  EXPECT_TRUE(has(slam.process(dark.at(seen[8].t_ns)), Event::kMapSaved));
  int lost = 0, found = 0;
  for (std::size_t i = 9; i < 16; ++i) {
    const Result result = slam.process(i < 13 ? dark.at(seen[i].t_ns) : seen[i]);
    lost += has(result, Event::kLost) ? 1 : 0;
    found += has(result, Event::kRelocalised) ? 1 : 0;
    EXPECT_FALSE(has(result, Event::kMapSaved)) << "it was told";
  }
  EXPECT_LE(lost, 1);
  EXPECT_EQ(found, 1);
}

TEST(Covariance, IsNoneAtTheOriginSmallWhileTrackingAndUnknownWhileLost) {
  const Film& seen = film("static_xyz");
  const Darkness dark;
  Slam slam = Slam::open(deterministic_for(seen));
  for (const double v : slam.process(seen[0]).covariance) EXPECT_EQ(v, 0);
  double largest = 0;
  for (std::size_t i = 1; i < 8; ++i) {
    const Result result = slam.process(seen[i]);
    ASSERT_EQ(result.state, State::kTracking);
    for (std::size_t row = 0; row < 6; ++row) {
      EXPECT_GT(result.covariance[7 * row], 0);
      EXPECT_LT(result.covariance[7 * row], 1e-3) << "3 cm, 2 degrees";
      largest = std::max(largest, result.covariance[7 * row]);
      for (std::size_t k = 0; k < 6; ++k)
        EXPECT_NEAR(result.covariance[6 * row + k], result.covariance[6 * k + row], 1e-12);
    }
  }
  const Result lost = slam.process(dark.at(seen[8].t_ns));
  ASSERT_EQ(lost.state, State::kLost);
  for (std::size_t row = 0; row < 6; ++row) EXPECT_GT(lost.covariance[7 * row], 1e4 * largest);
}

}  // namespace
}  // namespace ygslam::api
