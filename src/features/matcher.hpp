// Matching by descriptor distance.
#pragma once

#include <cstdint>
#include <vector>

#include "features/feature.hpp"

namespace ygslam {

inline constexpr int kNoDistance = 257;  ///< larger than any Hamming distance

struct Match {
  std::uint32_t a = 0;  ///< index into the first set
  std::uint32_t b = 0;  ///< index into the second set
  int distance = 0;     ///< bits
  bool operator==(const Match&) const = default;
};

struct MatchConfig {
  int max_distance = 64;   ///< bits, inclusive
  double max_ratio = 0.8;  ///< best distance < max_ratio * second best; >= 1: no test
};

/// The two smallest distances of a query; equal distances: the first candidate wins.
struct BestTwo {
  std::uint32_t index = 0;  ///< of the best; meaningless if distance is kNoDistance
  int distance = kNoDistance;
  int second_distance = kNoDistance;

  void offer(std::uint32_t candidate, int candidate_distance) {
    if (candidate_distance < distance) {
      second_distance = distance;
      distance = candidate_distance;
      index = candidate;
    } else if (candidate_distance < second_distance) {
      second_distance = candidate_distance;
    }
  }
  [[nodiscard]] bool passes(int max_distance, double max_ratio) const {
    return distance <= max_distance && distance < kNoDistance &&
           (max_ratio >= 1 || distance < max_ratio * second_distance);
  }
};

/// Compares every feature of a with every one of b; who is another's best must have it as its own.
/// @return in the order of a; each b at most once.
[[nodiscard]] std::vector<Match> match_brute_force(const Features& a, const Features& b,
                                                   const MatchConfig& config = {});

}  // namespace ygslam
