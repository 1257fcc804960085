#include "io/ply.hpp"

#include <gtest/gtest.h>

#include <limits>

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

TEST(Ply, PointsComeBackExactly) {
  const testing::TempFolder folder;
  Rng rng(1);
  for (const std::size_t count : {0U, 1U, 1000U, 70'000U}) {
    const auto points = random_points(count, rng);
    const auto path = folder.path() / "map.ply";
    ASSERT_TRUE(write_ply(path, points).ok());
    const auto back = read_ply(path);
    ASSERT_TRUE(back.ok()) << back.error().message;
    ASSERT_EQ(back->size(), count);
    for (std::size_t i = 0; i < count; ++i) {
      ASSERT_EQ((*back)[i].p_world, points[i].p_world);
      ASSERT_EQ((*back)[i].colour, points[i].colour);
    }
    EXPECT_EQ(testing::read(path), encode_ply(points));
  }
}

TEST(Ply, HeaderSaysWhatFollows) {
  const std::string bytes = encode_ply(std::vector<ColouredPoint>(2));
  EXPECT_EQ(bytes.substr(0, bytes.find("end_header")),
            "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\n"
            "property float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
            "property uchar blue\n");
  EXPECT_EQ(bytes.size() - bytes.find("end_header") - 11, 2U * 15U);
}

TEST(Ply, TruncatedAnywhereOrOfAnotherLayoutIsRefused) {
  Rng rng(2);
  const std::string bytes = encode_ply(random_points(5, rng));
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    ASSERT_FALSE(parse_ply(std::string_view(bytes).substr(0, length), "x").ok()) << length;
  }
  EXPECT_FALSE(parse_ply(bytes + "x", "x").ok());
  EXPECT_FALSE(parse_ply("ply\nformat ascii 1.0\nend_header\n", "x").ok());
  std::string absurd = bytes;  // a count that would need more memory than there is
  absurd.replace(absurd.find("vertex 5"), 8, "vertex 18446744073709551615");
  EXPECT_FALSE(parse_ply(absurd, "x").ok());
}

TEST(Ply, ACoordinateThatIsNotFiniteIsRefused) {
  std::string bytes = encode_ply(std::vector<ColouredPoint>(1));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  bytes.replace(bytes.size() - 15, 4, reinterpret_cast<const char*>(&nan), 4);
  EXPECT_FALSE(parse_ply(bytes, "x").ok());
}

}  // namespace
}  // namespace ygslam
