#include "core/statistics.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <span>
#include <vector>

#include "core/rng.hpp"

namespace ygslam {
namespace {

TEST(Statistics, OrderStatisticsAreThoseOfTheSortedValues) {
  Rng rng(1);
  for (std::size_t n = 1; n < 40; ++n) {
    std::vector<int> values(n);
    for (int& v : values) v = static_cast<int>(rng.below(20));
    std::vector<int> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    std::vector<int> shuffled = values;
    EXPECT_EQ(median(std::span(shuffled)), sorted[n / 2]);
    EXPECT_TRUE(std::is_permutation(values.begin(), values.end(), shuffled.begin()));
    EXPECT_EQ(quantile(shuffled, 0), sorted.front());
    EXPECT_EQ(quantile(shuffled, 0.5), sorted[(n - 1) / 2]);
    EXPECT_EQ(quantile(shuffled, 1), sorted.back());
    EXPECT_EQ(sorted_median(sorted), 0.5 * (sorted[n / 2] + sorted[(n - 1) / 2]));
  }
}

}  // namespace
}  // namespace ygslam
