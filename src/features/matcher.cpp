#include "features/matcher.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <numbers>

namespace ygslam {

namespace {

constexpr int kTurn_deg = 360;

// Change of orientation from a to b, rounded to degrees, in [0, 360).
int rotation_deg(const Features& a, const Features& b, const Match& match) {
  const double change_rad = static_cast<double>(b.points[match.b].angle_rad) -
                            static_cast<double>(a.points[match.a].angle_rad);
  const auto degrees = static_cast<int>(std::lround(change_rad * 180.0 / std::numbers::pi));
  return (degrees % kTurn_deg + kTurn_deg) % kTurn_deg;
}

}  // namespace

BestTwo best_two(const Descriptor& query, std::span<const Descriptor> all) {
  BestTwo best;
  for (std::size_t i = 0; i < all.size(); ++i) {
    best.offer(static_cast<std::uint32_t>(i), distance(query, all[i]));
  }
  return best;
}

BestTwo best_two(const Descriptor& query, std::span<const Descriptor> all,
                 std::span<const std::uint32_t> candidates) {
  BestTwo best;
  for (const std::uint32_t i : candidates) best.offer(i, distance(query, all[i]));
  return best;
}

std::vector<Match> match_brute_force(const Features& a, const Features& b,
                                     const MatchConfig& config) {
  std::vector<BestTwo> best_of_b(b.size());
  std::vector<BestTwo> best_of_a(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Descriptor query = a.descriptors[i];
    BestTwo best;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const int d = distance(query, b.descriptors[j]);
      best.offer(static_cast<std::uint32_t>(j), d);
      best_of_b[j].offer(static_cast<std::uint32_t>(i), d);
    }
    best_of_a[i] = best;
  }
  std::vector<Match> matches;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const BestTwo& best = best_of_a[i];
    if (!best.passes(config.max_distance, config.max_ratio)) continue;
    if (config.mutual && best_of_b[best.index].index != i) continue;
    matches.push_back({static_cast<std::uint32_t>(i), best.index, best.distance});
  }
  if (config.max_rotation_rad <= 0) return matches;
  return keep_common_rotation(a, b, std::move(matches), config.max_rotation_rad);
}

std::vector<Match> keep_common_rotation(const Features& a, const Features& b,
                                        std::vector<Match> matches, double max_rotation_rad) {
  const auto reach = static_cast<int>(std::lround(max_rotation_rad * 180.0 / std::numbers::pi));
  if (2 * reach + 1 >= kTurn_deg) return matches;
  std::array<int, kTurn_deg> histogram{};
  for (const Match& m : matches) ++histogram[static_cast<std::size_t>(rotation_deg(a, b, m))];
  int fullest = -1;
  int common_deg = 0;
  for (int centre = 0; centre < kTurn_deg; ++centre) {
    int sum = 0;
    for (int d = -reach; d <= reach; ++d) {
      sum += histogram[static_cast<std::size_t>((centre + d + kTurn_deg) % kTurn_deg)];
    }
    if (sum > fullest) {
      fullest = sum;
      common_deg = centre;
    }
  }
  std::erase_if(matches, [&](const Match& m) {
    const int away = std::abs(rotation_deg(a, b, m) - common_deg);
    return std::min(away, kTurn_deg - away) > reach;
  });
  return matches;
}

}  // namespace ygslam
