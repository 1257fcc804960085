#include "core/assignment.hpp"

#include <limits>

#include "core/check.hpp"

namespace ygslam {
namespace {

/// For at most as many rows as columns. Row 0 and column 0 stand for "none yet".
std::vector<int> assign_rows(const Eigen::MatrixXd& cost) {
  const int rows = static_cast<int>(cost.rows());
  const int columns = static_cast<int>(cost.cols());
  std::vector<double> row_price(rows + 1, 0.0), column_price(columns + 1, 0.0);
  std::vector<int> row_of(columns + 1, 0), came_from(columns + 1, 0);
  for (int row = 1; row <= rows; ++row) {
    std::vector<double> least(columns + 1, std::numeric_limits<double>::infinity());
    std::vector<char> done(columns + 1, 0);
    int column = 0;
    row_of[0] = row;
    do {  // grow the tree of cheapest paths until it reaches a free column
      done[column] = 1;
      const int from = row_of[column];
      double step = std::numeric_limits<double>::infinity();
      int next = 0;
      for (int c = 1; c <= columns; ++c) {
        if (done[c]) continue;
        const double reduced = cost(from - 1, c - 1) - row_price[from] - column_price[c];
        if (reduced < least[c]) least[c] = reduced, came_from[c] = column;
        if (least[c] < step) step = least[c], next = c;
      }
      for (int c = 0; c <= columns; ++c) {
        if (done[c]) {
          row_price[row_of[c]] += step;
          column_price[c] -= step;
        } else {
          least[c] -= step;
        }
      }
      column = next;
    } while (row_of[column] != 0);
    for (; column != 0; column = came_from[column]) row_of[column] = row_of[came_from[column]];
  }
  std::vector<int> column_of(rows, -1);
  for (int c = 1; c <= columns; ++c)
    if (row_of[c] > 0) column_of[row_of[c] - 1] = c - 1;
  return column_of;
}

}  // namespace

std::vector<int> assign(const Eigen::MatrixXd& cost) {
  CHECK(cost.allFinite());
  if (cost.rows() <= cost.cols()) return assign_rows(cost);
  std::vector<int> column_of(static_cast<std::size_t>(cost.rows()), -1);
  const std::vector<int> row_of = assign_rows(cost.transpose());
  for (std::size_t c = 0; c < row_of.size(); ++c) column_of[row_of[c]] = static_cast<int>(c);
  return column_of;
}

}  // namespace ygslam
