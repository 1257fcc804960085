#include "io/pairing.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <queue>
#include <tuple>

namespace ygslam {
namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

// Both lists merged in order of time, linked to their free neighbours.
struct Node {
  Timestamp stamp;
  bool is_first = false;
  std::size_t position = 0;
  std::size_t left = kNone, right = kNone;
  bool free = true;
};

std::vector<Node> merged(std::span<const Timestamp> first, std::span<const Timestamp> second) {
  std::vector<Node> nodes;
  nodes.reserve(first.size() + second.size());
  for (std::size_t i = 0; i < first.size(); ++i) nodes.push_back({first[i], true, i});
  for (std::size_t i = 0; i < second.size(); ++i) nodes.push_back({second[i], false, i});
  std::stable_sort(nodes.begin(), nodes.end(),
                   [](const Node& a, const Node& b) { return a.stamp < b.stamp; });
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    nodes[i].left = i == 0 ? kNone : i - 1;
    nodes[i].right = i + 1 == nodes.size() ? kNone : i + 1;
  }
  return nodes;
}

// Nearest first, then earliest.
using Candidate = std::tuple<std::int64_t, std::size_t, std::size_t>;
using Queue = std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>>;

}  // namespace

std::vector<StampPair> pair_one_to_one(std::span<const Timestamp> first,
                                       std::span<const Timestamp> second,
                                       std::int64_t max_difference_ns) {
  std::vector<Node> nodes = merged(first, second);
  Queue queue;
  // The closest free pair of the two lists is always adjacent among the free stamps: anything
  // between its two would be closer to one of them.
  const auto offer = [&](std::size_t left, std::size_t right) {
    if (left == kNone || right == kNone || nodes[left].is_first == nodes[right].is_first) return;
    const std::int64_t difference_ns = nodes[right].stamp.ns - nodes[left].stamp.ns;
    if (difference_ns <= max_difference_ns) queue.emplace(difference_ns, left, right);
  };
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) offer(i, i + 1);
  std::vector<StampPair> pairs;
  while (!queue.empty()) {
    const auto [difference_ns, left, right] = queue.top();
    queue.pop();
    Node& a = nodes[left];
    Node& b = nodes[right];
    if (!a.free || !b.free) continue;
    a.free = b.free = false;
    pairs.push_back(a.is_first ? StampPair{a.position, b.position}
                               : StampPair{b.position, a.position});
    if (a.left != kNone) nodes[a.left].right = b.right;
    if (b.right != kNone) nodes[b.right].left = a.left;
    offer(a.left, b.right);
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const StampPair& a, const StampPair& b) { return a.first < b.first; });
  return pairs;
}

namespace {

constexpr std::size_t kMostStamps = 2000;  // enough to see an offset, bounded for absurd lists

/// Differences that are nearly the same.
struct Peak {
  std::size_t count = 0;
  std::int64_t sum_ns = 0;

  [[nodiscard]] std::int64_t mean_ns() const { return sum_ns / static_cast<std::int64_t>(count); }
  [[nodiscard]] bool is_better_than(const Peak& other) const {
    if (count != other.count || count == 0) return count > other.count;
    return std::llabs(mean_ns()) < std::llabs(other.mean_ns());
  }
};

/// All differences within the range, sorted; of absurdly many the first.
std::vector<std::int64_t> differences_of(std::span<const Timestamp> first,
                                         std::span<const Timestamp> second) {
  constexpr std::int64_t kRange_ns = 500'000'000;
  constexpr std::size_t kMostDifferences = 1'000'000;
  std::vector<std::int64_t> differences;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < std::min(first.size(), kMostStamps); ++i) {
    while (begin < second.size() && second[begin].ns < first[i].ns - kRange_ns) ++begin;
    for (std::size_t j = begin; j < second.size() && j < begin + kMostStamps; ++j) {
      const std::int64_t difference_ns = second[j].ns - first[i].ns;
      if (difference_ns > kRange_ns || differences.size() == kMostDifferences) break;
      differences.push_back(difference_ns);
    }
  }
  std::ranges::sort(differences);
  return differences;
}

}  // namespace

std::optional<std::int64_t> estimate_offset_ns(std::span<const Timestamp> first,
                                               std::span<const Timestamp> second) {
  constexpr std::int64_t kWindow_ns = 4'000'000;
  const auto differences = differences_of(first, second);
  Peak best;
  Peak near;  // of those under which images are paired
  Peak window;
  for (std::size_t begin = 0, end = 0; begin < differences.size(); ++begin) {
    for (; end < differences.size() && differences[end] - differences[begin] <= kWindow_ns; ++end)
      ++window.count, window.sum_ns += differences[end];
    if (window.is_better_than(best)) best = window;
    if (std::llabs(window.mean_ns()) <= kMaxPairDifference_ns && window.is_better_than(near))
      near = window;
    --window.count, window.sum_ns -= differences[begin];
  }
  const std::size_t most = std::min({first.size(), second.size(), kMostStamps});
  if (best.count == 0 || 2 * best.count < most) return std::nullopt;
  // Regular stamps coincide under every whole number of intervals; how many do says which it is,
  // but for chance: what jitter and clocks of unequal rate take from a peak.
  const auto missing = static_cast<double>(most - std::min(most, best.count));
  if (near.count > 0 && static_cast<double>(best.count - near.count) <= 2 * std::sqrt(missing) &&
      missing > 0)
    return near.mean_ns();
  return best.mean_ns();
}

}  // namespace ygslam
