// Matching by descriptor distance.
#pragma once

#include <cstdint>
#include <span>
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
  int max_distance = 64;        ///< bits, inclusive
  double max_ratio = 0.8;       ///< best distance < max_ratio * second best; >= 1: no test
  bool mutual = true;           ///< a's best b must have a as its best
  double max_rotation_rad = 0;  ///< see keep_common_rotation(); 0 = no test
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

/// Best of all descriptors.
[[nodiscard]] BestTwo best_two(const Descriptor& query, std::span<const Descriptor> all);
/// Best of those listed in `candidates` (indices into `all`).
[[nodiscard]] BestTwo best_two(const Descriptor& query, std::span<const Descriptor> all,
                               std::span<const std::uint32_t> candidates);

/// Compares every feature of a with every one of b. @return in the order of a; each b at most once
/// if mutual.
[[nodiscard]] std::vector<Match> match_brute_force(const Features& a, const Features& b,
                                                   const MatchConfig& config = {});

/// Keeps the matches whose change of orientation lies within max_rotation_rad of the commonest one
/// (the fullest window of that half-width over a histogram of one-degree bins).
[[nodiscard]] std::vector<Match> keep_common_rotation(const Features& a, const Features& b,
                                                      std::vector<Match> matches,
                                                      double max_rotation_rad);

}  // namespace ygslam
