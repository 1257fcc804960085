#include "core/histogram.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "core/rng.hpp"

namespace ygslam {
namespace {

TEST(Histogram, AgreesWithTheSortedValues) {
  Rng rng(1);
  Histogram histogram;
  std::vector<double> values;
  for (int i = 0; i < 5000; ++i) {
    values.push_back(std::exp(rng.uniform(-6, 8)));
    histogram.add(values.back());
  }
  std::sort(values.begin(), values.end());
  for (const double share : {0.001, 0.1, 0.5, 0.95, 0.99, 1.0}) {
    const double expected = values[static_cast<std::size_t>(std::ceil(share * 5000)) - 1];
    EXPECT_NEAR(histogram.percentile(share), expected, 0.006 * expected) << share;
  }
  EXPECT_EQ(histogram.max(), values.back());
  EXPECT_EQ(histogram.count(), values.size());
}

TEST(Histogram, TakesWhatIsNoDuration) {
  Histogram histogram;
  EXPECT_EQ(histogram.percentile(0.5), 0);
  EXPECT_EQ(histogram.mean(), 0);
  for (const double value : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), 1e300})
    histogram.add(value);
  EXPECT_EQ(histogram.percentile(0.5), 0);
  EXPECT_EQ(histogram.max(), 1e300);
}

}  // namespace
}  // namespace ygslam
