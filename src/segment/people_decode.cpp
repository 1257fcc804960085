#include "segment/people_decode.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "segment/depth_outages.hpp"

namespace ygslam {
namespace {

constexpr float kGap_m = 0.15F;  // an arm before the body is of it, whoever walks behind is not
// The network's last features lie on every fourth cell: what is smaller than one of them is noise.
constexpr int kLeastCells = 16;
constexpr std::size_t kMostInstances = 255;    // ids are bytes, 0 = none
constexpr float kHeadAndShoulders_m2 = 0.15F;  // facing the camera: so much is surely a body

// One body in several parts: something stands before its middle, or a limb is stretched out.
constexpr float kTallest_m = 2.1F;
constexpr float kWidest_m = 1.3F;
constexpr float kApart_m = 0.45F;      // in depth: a seated body's knees before its chest
constexpr float kLimbApart_m = 0.25F;  // in depth, of an arm before or a foot behind the body
constexpr float kHidden_m = 0.35F;     // of height, by what stands before a body
constexpr float kSameHeight = 0.3F;    // more, as a share of the lower part's height, is beside it
constexpr float kReach_m = 0.05F;      // sideways

/// Where cells lie along a direction, told by mean and variance: single wrong depths count little.
struct Extent {
  float sum = 0, squares = 0;
  void add(float value) {
    sum += value;
    squares += value * value;
  }
};

struct Range {
  float low = 0, high = 0;
  [[nodiscard]] float length() const { return high - low; }
};

/// As long as a uniform distribution of this mean and variance.
Range range_of(const Extent& extent, int count) {
  const float mean = extent.sum / static_cast<float>(count);
  const float variance = std::max(0.0F, extent.squares / static_cast<float>(count) - mean * mean);
  const float half = std::sqrt(3 * variance);
  return {mean - half, mean + half};
}

Extent operator+(const Extent& a, const Extent& b) {
  return {a.sum + b.sum, a.squares + b.squares};
}

Range joined(const Range& a, const Range& b) {
  return {std::min(a.low, b.low), std::max(a.high, b.high)};
}

/// How much two ranges share; < 0: how far they are apart.
float common(const Range& a, const Range& b) {
  return std::min(a.high, b.high) - std::max(a.low, b.low);
}

struct Part {
  int cells = 0;
  float score_sum = 0;
  int measured = 0;            ///< cells with depth
  Extent across, down, depth;  ///< of its measured cells [m]

  [[nodiscard]] Range across_m() const { return range_of(across, measured); }
  [[nodiscard]] Range down_m() const { return range_of(down, measured); }
  [[nodiscard]] Range depth_m() const { return range_of(depth, measured); }
};

Part joined(const Part& a, const Part& b) {
  return {a.cells + b.cells,   a.score_sum + b.score_sum, a.measured + b.measured,
          a.across + b.across, a.down + b.down,           a.depth + b.depth};
}

/// Whether two parts can be of one body: one above the other, or a limb beside it.
bool is_one_body(const Part& a, const Part& b) {
  if (a.measured == 0 || b.measured == 0) return false;
  const Range a_across = a.across_m(), b_across = b.across_m();
  const Range a_down = a.down_m(), b_down = b.down_m();
  const bool fits = joined(a_down, b_down).length() < kTallest_m &&
                    joined(a_across, b_across).length() < kWidest_m &&
                    common(a_across, b_across) > -kReach_m && common(a_down, b_down) > -kHidden_m;
  if (!fits) return false;
  const float apart_m = -common(a.depth_m(), b.depth_m());
  const bool is_above =
      common(a_down, b_down) < kSameHeight * std::min(a_down.length(), b_down.length());
  const bool is_limb = std::min(a_across.length() * a_down.length(),
                                b_across.length() * b_down.length()) < kHeadAndShoulders_m2;
  return (is_above && apart_m < kApart_m) || (is_limb && apart_m < kLimbApart_m);
}

/// A hand or a foot alone is no body: what is smaller counts for less, so that it continues an
/// object but begins none.
float score_of(const Part& part, float focal_cells) {
  const auto cells = static_cast<float>(part.cells);
  const float score = part.score_sum / cells;
  if (part.measured == 0) return score;
  const float cell_m2 =
      part.depth.squares / static_cast<float>(part.measured) / (focal_cells * focal_cells);
  return score * std::min(1.0F, cells * cell_m2 / kHeadAndShoulders_m2);
}

/// The cells that show somebody, parted where depth jumps.
class Parts {
 public:
  Parts(std::span<const float> logits, const DepthImage& cells_m, const PeopleGrid& grid,
        float focal_cells)
      : logits_(logits),
        cells_m_(cells_m),
        grid_(grid),
        focal_cells_(focal_cells),
        part_of_(kPeopleCells, kNone) {
    for (int row = 0; row < grid.rows; ++row)
      for (int column = 0; column < grid.columns; ++column) begin_part(index(column, row));
    absorb_crumbs();
  }

  /// Of each cell the number of its part, the largest part is 1; 0 = none.
  [[nodiscard]] std::vector<std::uint8_t> numbers(std::vector<Part>& numbered) const {
    std::vector<std::size_t> order(parts_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::erase_if(order, [&](std::size_t i) { return parts_[i].cells < kLeastCells; });
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return parts_[a].cells > parts_[b].cells;
    });
    std::vector<std::uint8_t> number_of(parts_.size(), 0);
    for (const std::size_t i : order) {
      const auto body = std::find_if(numbered.begin(), numbered.end(), [&](const Part& known) {
        return is_one_body(known, parts_[i]);
      });
      if (body == numbered.end() && numbered.size() == kMostInstances) continue;
      number_of[i] = static_cast<std::uint8_t>(body - numbered.begin() + 1);
      if (body == numbered.end())
        numbered.push_back(parts_[i]);
      else
        *body = joined(*body, parts_[i]);
    }
    std::vector<std::uint8_t> numbers(part_of_.size(), 0);
    for (std::size_t i = 0; i < numbers.size(); ++i)
      if (part_of_[i] != kNone) numbers[i] = number_of[static_cast<std::size_t>(part_of_[i])];
    return numbers;
  }

 private:
  static constexpr int kNone = -1;
  static int index(int column, int row) { return row * kPeopleColumns + column; }

  void put(int cell, int part) {
    part_of_[cell] = part;
    Part& grown = parts_[part];
    grown.cells += 1;
    grown.score_sum += 1.0F / (1.0F + std::exp(-logits_[cell]));
    waiting_.push_back(cell);
    const float depth_m = cells_m_.data()[cell];
    if (depth_m <= 0) return;
    grown.measured += 1;
    grown.depth.add(depth_m);
    const int column = cell % kPeopleColumns;
    const int row = cell / kPeopleColumns;
    const float cell_m = depth_m / focal_cells_;  // the optical axis: about the middle
    grown.across.add(cell_m *
                     (static_cast<float>(column) - 0.5F * static_cast<float>(grid_.columns)));
    grown.down.add(cell_m * (static_cast<float>(row) - 0.5F * static_cast<float>(grid_.rows)));
  }

  void begin_part(int cell) {
    if (logits_[cell] <= 0 || part_of_[cell] != kNone) return;
    parts_.emplace_back();
    put(cell, static_cast<int>(parts_.size()) - 1);
    spread([&](int from, int to) {
      const float a = cells_m_.data()[from];
      const float b = cells_m_.data()[to];
      return part_of_[to] == kNone && (a <= 0 || b <= 0 || std::abs(a - b) < kGap_m);
    });
  }

  // Crumbs along the jumps of depth go to the part that they touch; others stay what they are.
  void absorb_crumbs() {
    const auto is_crumb = [&](int cell) { return parts_[part_of_[cell]].cells < kLeastCells; };
    for (int cell = 0; cell < kPeopleCells; ++cell)
      if (part_of_[cell] != kNone && !is_crumb(cell)) waiting_.push_back(cell);
    spread([&](int, int to) { return is_crumb(to); });
  }

  /// From the waiting cells on to neighbours that show somebody, as far as `joins` says.
  template <typename Joins>
  void spread(const Joins& joins) {
    for (std::size_t next = 0; next < waiting_.size(); ++next) {
      const int from = waiting_[next];
      for_neighbours(from, grid_, [&](int to) {
        if (logits_[to] > 0 && joins(from, to)) put(to, part_of_[from]);
      });
    }
    waiting_.clear();
  }

  std::span<const float> logits_;
  const DepthImage& cells_m_;
  const PeopleGrid& grid_;
  float focal_cells_;
  std::vector<int> part_of_;
  std::vector<Part> parts_;
  std::vector<int> waiting_;
};

/// Cells beside a part take its number: its outline lies somewhere in them.
std::vector<std::uint8_t> with_rim(const std::vector<std::uint8_t>& numbers,
                                   std::span<const float> logits, const PeopleGrid& grid) {
  std::vector<std::uint8_t> wider = numbers;
  std::vector<float> surest(numbers.size(), 0.0F);  // of the cells beside each
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const int cell = row * kPeopleColumns + column;
      if (numbers[cell] == 0) continue;
      for (int r = std::max(0, row - 1); r < std::min(grid.rows, row + 2); ++r) {
        for (int c = std::max(0, column - 1); c < std::min(grid.columns, column + 2); ++c) {
          const int other = r * kPeopleColumns + c;
          if (logits[other] > 0 || logits[cell] <= surest[other]) continue;
          surest[other] = logits[cell];
          wider[other] = numbers[cell];
        }
      }
    }
  }
  return wider;
}

/// Where pixels lie between the centres of cells.
struct Axis {
  std::vector<int> low, high, nearest;
  std::vector<float> weight;  ///< of `high`
  Axis(int pixels, int cells, double scale) {
    for (int i = 0; i < pixels; ++i) {
      const double cell = std::clamp((i + 0.5) / scale - 0.5, 0.0, cells - 1.0);
      low.push_back(static_cast<int>(cell));
      high.push_back(std::min(low.back() + 1, cells - 1));
      weight.push_back(static_cast<float>(cell - low.back()));
      nearest.push_back(weight.back() < 0.5F ? low.back() : high.back());
    }
  }
};

/// Pixels [begin, end) of a row of logits get their numbers where the logit is positive. Without a
/// branch, so that a compiler does several at once.
void number_pixels(const float* line, const Axis& columns, const std::uint8_t* number, int begin,
                   int end, std::uint8_t* __restrict ids) {
  const int* low = columns.low.data();
  const int* high = columns.high.data();
  const float* weight = columns.weight.data();
  for (int u = begin; u < end; ++u) {
    const float left = line[low[u]];
    const float value = left + weight[u] * (line[high[u]] - left);
    ids[u] = static_cast<std::uint8_t>(number[u] & (value > 0 ? 0xff : 0));
  }
}

/// Fits the boxes about the numbered pixels [begin, end) of a row.
void widen_boxes(const std::uint8_t* ids, int begin, int end, int v,
                 std::vector<Instance>& instances) {
  for (int u = begin; u < end;) {
    const int first = u;
    while (u < end && ids[u] == ids[first]) ++u;
    if (ids[first] == 0) continue;
    Instance& person = instances[ids[first] - 1];
    if (person.y0 < 0) person.y0 = static_cast<float>(v);
    person.x0 = std::min(person.x0, static_cast<float>(first));
    person.x1 = std::max(person.x1, static_cast<float>(u));
    person.y1 = static_cast<float>(v + 1);
  }
}

/// Numbers the pixels where the logit, interpolated between cells, is positive, and fits the boxes
/// about them; of an instance without a pixel y0 stays -1.
void paint(std::span<const float> logits, const std::vector<std::uint8_t>& numbers,
           const PeopleGrid& grid, DecodedPeople& people) {
  GreyImage& ids = people.ids;
  const Axis columns(ids.width(), grid.columns, grid.scale);
  const Axis rows(ids.height(), grid.rows, grid.scale);
  std::array<float, kPeopleColumns> line{};
  std::vector<std::uint8_t> number(static_cast<std::size_t>(ids.width()));  // of the nearest cells
  int numbered_row = -1;
  int begin = 0, end = 0;  // of the numbered pixels
  for (int v = 0; v < ids.height(); ++v) {
    if (const int row = rows.nearest[v]; row != numbered_row) {
      numbered_row = row;
      for (int u = 0; u < ids.width(); ++u)
        number[u] = numbers[row * kPeopleColumns + columns.nearest[u]];
      begin = 0;
      end = ids.width();
      while (begin < end && number[begin] == 0) ++begin;
      while (begin < end && number[end - 1] == 0) --end;
    }
    if (begin == end) continue;
    const float* low = logits.data() + rows.low[v] * kPeopleColumns;
    const float* high = logits.data() + rows.high[v] * kPeopleColumns;
    for (int c = 0; c < grid.columns; ++c) line[c] = low[c] + rows.weight[v] * (high[c] - low[c]);
    number_pixels(line.data(), columns, number.data(), begin, end, ids.row(v));
    widen_boxes(ids.row(v), begin, end, v, people.instances);
  }
}

/// What is too thin to have a pixel goes.
void drop_unseen(DecodedPeople& people) {
  std::array<std::uint8_t, kMostInstances + 1> id_of{};
  std::vector<Instance> seen;
  for (std::size_t i = 0; i < people.instances.size(); ++i) {
    if (people.instances[i].y0 < 0) continue;
    seen.push_back(people.instances[i]);
    id_of[i + 1] = static_cast<std::uint8_t>(seen.size());
  }
  if (seen.size() < people.instances.size())
    for (std::uint8_t& id : people.ids) id = id_of[id];
  people.instances = std::move(seen);
}

}  // namespace

DecodedPeople decode_people(std::span<const float> network_logits, const DepthImage& cells_m,
                            const PeopleGrid& grid, float focal_cells, int image_width,
                            int image_height) {
  DecodedPeople people{{}, GreyImage(image_width, image_height)};
  const std::vector<float> logits = without_outages(network_logits, cells_m, grid);
  std::vector<Part> parts;
  const std::vector<std::uint8_t> numbers =
      Parts(logits, cells_m, grid, focal_cells).numbers(parts);
  if (parts.empty()) return people;
  const auto width = static_cast<float>(image_width);
  for (const Part& part : parts)
    people.instances.push_back({0, score_of(part, focal_cells), width, -1, 0, 0});
  paint(logits, with_rim(numbers, logits, grid), grid, people);
  drop_unseen(people);
  return people;
}

}  // namespace ygslam
