#include "segment/depth_outages.hpp"

#include <algorithm>
#include <array>

namespace ygslam {
namespace {

constexpr float kNobody = -4.0F;  // logit
// Depth fails, and nobody stands before the lens.
constexpr float kLeastMeasuredShare = 0.15F;
constexpr int kLeastHoleCells = 200;
constexpr int kStraightCells = 20;      // of a border on one line of the grid
constexpr float kStraightShare = 0.3F;  // of a hole's border
// Depth that is registered to the colour image ends so far before its edges at most, in all frames.
constexpr int kEdgeCells = 5;

/// The border of a hole in the depth, told by the lines of the grid that it lies on. Lines along
/// the image's edges say nothing: registered depth ends there.
class HoleBorder {
 public:
  explicit HoleBorder(const PeopleGrid& grid) : grid_(grid) {}

  /// @param from in the hole, to measured beside it.
  void add(int from, int to) {
    const bool across = from / kPeopleColumns == to / kPeopleColumns;
    const int line = across ? from % kPeopleColumns : from / kPeopleColumns;
    const int lines = across ? grid_.columns : grid_.rows;
    const int outside = to > from ? line + 1 : lines - line;  // of cells between border and edge
    if (outside <= kEdgeCells) return;
    ++on_line_[across ? 0 : 1][to > from ? 0 : 1][line];
    ++length_;
  }
  /// People have no straight edges along the image's rows and columns.
  [[nodiscard]] bool is_straight() const {
    int straight = 0;
    for (const auto& way : on_line_)
      for (const auto& side : way)
        for (const int cells : side) straight += cells >= kStraightCells ? cells : 0;
    return straight > kStraightShare * static_cast<float>(length_);
  }

 private:
  const PeopleGrid& grid_;
  std::array<std::array<std::array<int, kPeopleColumns>, 2>, 2> on_line_{};
  int length_ = 0;
};

}  // namespace

std::vector<float> without_outages(std::span<const float> logits, const DepthImage& cells_m,
                                   const PeopleGrid& grid) {
  std::vector<float> result(logits.begin(), logits.end());
  const float* depth_m = cells_m.data();
  const auto forget = [&](int cell) { result[cell] = std::min(result[cell], kNobody); };
  const auto measured =
      std::count_if(cells_m.begin(), cells_m.end(), [](float z) { return z > 0; });
  const auto cells = static_cast<float>(grid.columns * grid.rows);
  const bool is_off = static_cast<float>(measured) < kLeastMeasuredShare * cells;
  std::vector<bool> is_seen(kPeopleCells, false);
  std::vector<int> hole;
  for (int cell = 0; cell < kPeopleCells; ++cell) {
    const bool begins_hole = cell % kPeopleColumns < grid.columns &&
                             cell / kPeopleColumns < grid.rows && depth_m[cell] <= 0 &&
                             !is_seen[cell];
    if (!begins_hole) continue;
    HoleBorder border(grid);
    hole.assign(1, cell);
    is_seen[cell] = true;
    for (std::size_t next = 0; next < hole.size(); ++next)
      for_neighbours(hole[next], grid, [&, from = hole[next]](int to) {
        if (depth_m[to] > 0) return border.add(from, to);
        if (is_seen[to]) return;
        is_seen[to] = true;
        hole.push_back(to);
      });
    const bool is_outage =
        is_off || (static_cast<int>(hole.size()) >= kLeastHoleCells && border.is_straight());
    if (is_outage) std::ranges::for_each(hole, forget);
  }
  return result;
}

}  // namespace ygslam
