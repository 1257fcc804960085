#include "io/clock_resets.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/statistics.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kLeastLines = 10;  // between two resets
constexpr std::size_t kMostResets = 20;  // no clock is set more often
constexpr std::int64_t kLongestPause_ns = 10'000'000'000;
constexpr std::size_t kFewSteps = 3;  // out of the usual, that sorting may bring in
constexpr double kLatest_ns = 0.25 * static_cast<double>(std::numeric_limits<std::int64_t>::max());

std::vector<std::int64_t> steps_of(std::span<const Timestamp> stamps) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i) steps.push_back(stamps[i].ns - stamps[i - 1].ns);
  return steps;
}

std::size_t unusual(std::span<const std::int64_t> steps, std::int64_t usual_ns) {
  return static_cast<std::size_t>(std::ranges::count_if(
      steps, [&](std::int64_t ns) { return ns / 2 > usual_ns || ns < usual_ns / 2; }));
}

/// Would the lines follow each other evenly if they were sorted?
bool are_merely_out_of_order(std::span<const Timestamp> stamps,
                             std::span<const std::int64_t> rising_steps, std::int64_t usual_ns) {
  std::vector<Timestamp> sorted(stamps.begin(), stamps.end());
  std::ranges::sort(sorted);
  const std::vector<std::int64_t> steps = steps_of(sorted);
  const std::int64_t usual_sorted_ns = median(std::vector(steps));
  const bool is_even =
      unusual(steps, usual_sorted_ns) <= unusual(rising_steps, usual_ns) + kFewSteps;
  return is_even && *std::ranges::max_element(steps) <=
                        std::max(kLongestPause_ns, *std::ranges::max_element(rising_steps));
}

/// Fit into an integer, also one after the other.
bool are_sane(std::span<const Timestamp> stamps, std::span<const std::int64_t> rising_steps) {
  double end_ns = static_cast<double>(std::ranges::max(stamps).ns);
  for (const std::int64_t ns : rising_steps) end_ns += static_cast<double>(ns);
  return end_ns < kLatest_ns;
}

}  // namespace

std::vector<ClockReset> clock_resets(std::span<const Timestamp> stamps) {
  std::vector<ClockReset> resets;
  std::vector<std::int64_t> rising_steps;
  std::size_t begin = 0;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    const std::int64_t step_ns = stamps[i].ns - stamps[i - 1].ns;
    if (step_ns >= 0) {
      rising_steps.push_back(step_ns);
      continue;
    }
    if (i - std::exchange(begin, i) < kLeastLines || resets.size() == kMostResets) return {};
    resets.push_back({i, -step_ns});
  }
  if (resets.empty() || stamps.size() - begin < kLeastLines || !are_sane(stamps, rising_steps))
    return {};
  const std::int64_t usual_ns = std::max<std::int64_t>(1, median(std::vector(rising_steps)));
  if (are_merely_out_of_order(stamps, rising_steps, usual_ns)) return {};
  std::int64_t shift_ns = 0;
  for (ClockReset& reset : resets) reset.shift_ns = shift_ns += reset.back_ns + usual_ns;
  return resets;
}

}  // namespace ygslam
