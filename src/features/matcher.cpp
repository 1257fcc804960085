#include "features/matcher.hpp"

#include <cstddef>

namespace ygslam {

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
    if (best_of_b[best.index].index != i) continue;
    matches.push_back({static_cast<std::uint32_t>(i), best.index, best.distance});
  }
  return matches;
}

}  // namespace ygslam
