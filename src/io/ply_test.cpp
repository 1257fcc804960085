#include "io/ply.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <vector>

#include "core/rng.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

std::vector<ColouredPoint> random_points(std::size_t count, Rng& rng) {
  std::vector<ColouredPoint> points(count);
  for (ColouredPoint& point : points) {
    for (int i = 0; i < 3; ++i) point.p_world[i] = static_cast<float>(rng.normal(0, 3));
    point.colour = {static_cast<std::uint8_t>(rng.below(256)),
                    static_cast<std::uint8_t>(rng.below(256)),
                    static_cast<std::uint8_t>(rng.below(256))};
  }
  return points;
}

TEST(Ply, PointsFollowAHeaderThatSaysSo) {
  const testing::TempFolder folder;
  const auto path = folder.path() / "map.ply";
  Rng rng(1);
  for (const std::size_t count : {0U, 1U, 1000U, 70'000U}) {
    const auto points = random_points(count, rng);
    ASSERT_TRUE(write_ply(path, points).ok());
    const std::string bytes = testing::read(path);
    const std::string header =
        "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(count) +
        "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
        "property uchar green\nproperty uchar blue\nend_header\n";
    ASSERT_EQ(bytes.substr(0, header.size()), header);
    ASSERT_EQ(bytes.size(), header.size() + 15 * count);
    for (std::size_t i = 0; i < count; ++i) {
      ColouredPoint back;
      std::memcpy(back.p_world.data(), &bytes[header.size() + 15 * i], 12);
      std::memcpy(&back.colour, &bytes[header.size() + 15 * i + 12], 3);
      ASSERT_EQ(back.p_world, points[i].p_world);
      ASSERT_EQ(back.colour, points[i].colour);
    }
  }
}

TEST(Ply, APointThatIsNotFiniteIsNotWritten) {
  const testing::TempFolder folder;
  std::vector<ColouredPoint> points(1);
  points[0].p_world.y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW((void)write_ply(folder.path() / "map.ply", points), InternalError);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "map.ply"));
}

}  // namespace
}  // namespace ygslam
