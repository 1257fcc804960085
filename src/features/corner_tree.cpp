#include "features/corner_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <tuple>

namespace ygslam {

namespace {

constexpr std::uint32_t kLeafSize = 6;
constexpr int kMaxRadius_px = 100;
constexpr int kDuplicate_px2 = 6;
// A corner suppresses others only if it is stronger by more than noise (Brown et al. use the same).
constexpr float kClearly = 1.0F / 0.9F;

bool raster_before(const Corner& a, const Corner& b) {
  return std::tuple(a.v, a.u) < std::tuple(b.v, b.u);
}

// "Less" is better: higher rank, then earlier in raster order.
struct Ranked {
  double rank;
  Corner corner;
  bool operator<(const Ranked& other) const {
    return std::tuple(-rank, corner.v, corner.u) <
           std::tuple(-other.rank, other.corner.v, other.corner.u);
  }
};

int squared(int x) { return x * x; }

// Distance from a coordinate to the interval [begin, begin + size).
int outside(int x, int begin, int size) { return std::max({begin - x, x - (begin + size - 1), 0}); }

}  // namespace

CornerTree::CornerTree(std::vector<Corner>& corners) : corners_(corners) {
  if (corners.empty()) return;
  int size = 1;
  for (const Corner& c : corners) {
    while (size <= std::max(c.u, c.v)) size *= 2;
  }
  nodes_.reserve(corners.size());
  nodes_.push_back({0, 0, size, 0, static_cast<std::uint32_t>(corners.size()), 0, 0});
  const auto partition = [&](std::uint32_t begin, std::uint32_t end, auto predicate) {
    const auto first = corners.begin();
    return static_cast<std::uint32_t>(std::partition(first + begin, first + end, predicate) -
                                      first);
  };
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Node n = nodes_[i];
    if (n.end - n.begin <= kLeafSize || n.size == 1) continue;
    const int half = n.size / 2;
    const auto is_left = [&](const Corner& c) { return c.u < n.u + half; };
    const std::uint32_t middle =
        partition(n.begin, n.end, [&](const Corner& c) { return c.v < n.v + half; });
    const std::uint32_t upper = partition(n.begin, middle, is_left);
    const std::uint32_t lower = partition(middle, n.end, is_left);
    nodes_[i].child = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back({n.u, n.v, half, n.begin, upper, 0, 0});
    nodes_.push_back({n.u + half, n.v, half, upper, middle, 0, 0});
    nodes_.push_back({n.u, n.v + half, half, middle, lower, 0, 0});
    nodes_.push_back({n.u + half, n.v + half, half, lower, n.end, 0, 0});
  }
  for (std::size_t i = nodes_.size(); i-- > 0;) {  // children come after their parents
    Node& n = nodes_[i];
    n.best = -1;
    if (n.child != 0) {
      for (std::size_t k = 0; k < 4; ++k) n.best = std::max(n.best, nodes_[n.child + k].best);
    } else {
      for (std::uint32_t k = n.begin; k < n.end; ++k) n.best = std::max(n.best, corners[k].score);
    }
  }
}

int CornerTree::nearest_stronger_px2(const Corner& from, float score, int limit_px2,
                                     int enough_px2) const {
  int nearest = limit_px2;
  std::array<std::uint32_t, 64> stack;
  std::size_t depth = 0;
  if (!nodes_.empty()) stack[depth++] = 0;
  while (depth > 0 && nearest > enough_px2) {
    const Node& n = nodes_[stack[--depth]];
    if (n.best < score) continue;
    if (squared(outside(from.u, n.u, n.size)) + squared(outside(from.v, n.v, n.size)) >= nearest) {
      continue;
    }
    if (n.child != 0) {  // the child that holds the corner is taken first, the opposite one last
      const std::uint32_t own =
          (from.u >= n.u + n.size / 2 ? 1U : 0U) + (from.v >= n.v + n.size / 2 ? 2U : 0U);
      for (const std::uint32_t k : {3U, 2U, 1U, 0U}) stack[depth++] = n.child + (own ^ k);
      continue;
    }
    for (std::uint32_t k = n.begin; k < n.end; ++k) {
      const Corner& c = corners_[k];
      if (c.score < score || (c.score == score && !raster_before(c, from))) continue;
      const int d = squared(c.u - from.u) + squared(c.v - from.v);
      if (d > 0) nearest = std::min(nearest, d);
    }
  }
  return nearest;
}

std::vector<Corner> spread_corners(std::vector<Corner> corners, int quota, double evenness) {
  if (quota <= 0) return {};
  const CornerTree tree(corners);
  std::vector<Corner> by_score = corners;
  std::sort(by_score.begin(), by_score.end(), [](const Corner& a, const Corner& b) {
    return std::tuple(-a.score, a.v, a.u) < std::tuple(-b.score, b.v, b.u);
  });
  // The best so far, the worst of them on top. Later corners are weaker: each must stand ever
  // farther from stronger ones to get in, and in the end none can.
  std::priority_queue<Ranked> best;
  for (const Corner& c : by_score) {
    if (c.score <= 0) break;
    const bool full = static_cast<int>(best.size()) == quota;
    double needed_px2 = 0;
    if (full) {
      if (evenness <= 0) break;
      needed_px2 = std::pow(best.top().rank / c.score, 1 / evenness);
      if (needed_px2 > squared(kMaxRadius_px) + 1) break;
    }
    const int r_px2 = tree.nearest_stronger_px2(c, c.score * kClearly, squared(kMaxRadius_px),
                                                static_cast<int>(needed_px2) - 1);
    const Ranked ranked{c.score * std::pow(static_cast<double>(r_px2), evenness), c};
    if (full && !(ranked < best.top())) continue;
    if (tree.nearest_stronger_px2(c, c.score, kDuplicate_px2, 0) < kDuplicate_px2) continue;
    if (full) best.pop();
    best.push(ranked);
  }
  std::vector<Corner> chosen;
  for (; !best.empty(); best.pop()) chosen.push_back(best.top().corner);
  std::sort(chosen.begin(), chosen.end(), raster_before);
  return chosen;
}

}  // namespace ygslam
