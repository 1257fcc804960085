#include "bag/input_file.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

TEST(ExpansionLimit, GrowsWithTheFileAndStaysReached) {
  ExpansionLimit limit(10);
  EXPECT_TRUE(limit.take(ExpansionLimit::kFreeBytes));
  EXPECT_TRUE(limit.take(10 * ExpansionLimit::kMostRatio));
  EXPECT_FALSE(limit.is_reached());
  EXPECT_FALSE(limit.take(1));
  EXPECT_TRUE(limit.is_reached());
  EXPECT_FALSE(limit.take(0));
}

TEST(ExpansionLimit, HoldsForFilesOfAnySize) {
  ExpansionLimit limit(~std::uint64_t{0});
  EXPECT_TRUE(limit.take(std::uint64_t{1} << 57));
  EXPECT_FALSE(limit.take(~std::uint64_t{0}));
}

TEST(BlockCache, KeepsSmallBlocksAndOfLargeOnesTheNewest) {
  int loads = 0;
  std::size_t block_bytes = 1000;
  BlockCache cache([&](std::uint64_t) -> Result<Bytes> {
    ++loads;
    return Bytes(block_bytes);
  });
  const auto read = [&](std::uint64_t block) { return cache.read(block, 990, 10).ok(); };
  for (const std::uint64_t block : {1, 2, 1, 2}) EXPECT_TRUE(read(block));
  EXPECT_EQ(loads, 2);
  block_bytes = std::size_t{160} << 20;
  for (const std::uint64_t block : {3, 4, 4, 3}) EXPECT_TRUE(read(block));
  EXPECT_EQ(loads, 5);
}

}  // namespace
}  // namespace ygslam
