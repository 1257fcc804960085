#include "core/assignment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "core/rng.hpp"

namespace ygslam {
namespace {

double cost_of(const Eigen::MatrixXd& cost, const std::vector<int>& column_of) {
  double sum = 0;
  for (std::size_t r = 0; r < column_of.size(); ++r)
    if (column_of[r] >= 0) sum += cost(static_cast<Eigen::Index>(r), column_of[r]);
  return sum;
}

/// Tries every order of the columns (rows <= columns).
double least_cost(const Eigen::MatrixXd& cost) {
  std::vector<int> order(static_cast<std::size_t>(cost.cols()));
  std::iota(order.begin(), order.end(), 0);
  double least = 1e300;
  do {
    const std::vector<int> first(order.begin(), order.begin() + cost.rows());
    least = std::min(least, cost_of(cost, first));
  } while (std::next_permutation(order.begin(), order.end()));
  return least;
}

TEST(Assignment, IsTheCheapestOfAll) {
  Rng rng(3);
  for (int trial = 0; trial < 200; ++trial) {
    const auto rows = static_cast<Eigen::Index>(rng.uniform(1, 6));
    const auto columns = rows + static_cast<Eigen::Index>(rng.uniform(0, 3));
    Eigen::MatrixXd cost(rows, columns);
    // Whole numbers as well: equal costs are the hard case.
    for (double& c : cost.reshaped())
      c = trial % 2 == 0 ? rng.uniform(-5, 5) : static_cast<int>(rng.uniform(0, 4));
    for (const bool tall : {false, true}) {
      const auto column_of = tall ? assign(cost.transpose()) : assign(cost);
      ASSERT_EQ(std::ssize(column_of), tall ? columns : rows);
      std::vector<int> used(column_of);
      std::erase(used, -1);
      EXPECT_EQ(std::ssize(used), rows);
      std::sort(used.begin(), used.end());
      EXPECT_EQ(std::unique(used.begin(), used.end()), used.end());
      EXPECT_NEAR(tall ? cost_of(cost.transpose(), column_of) : cost_of(cost, column_of),
                  least_cost(cost), 1e-9);
    }
  }
}

TEST(Assignment, NobodyAndNothing) {
  EXPECT_TRUE(assign(Eigen::MatrixXd(0, 3)).empty());
  EXPECT_EQ(assign(Eigen::MatrixXd(2, 0)), (std::vector<int>{-1, -1}));
}

}  // namespace
}  // namespace ygslam
