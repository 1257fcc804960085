#include "eval/associate.hpp"

#include <algorithm>
#include <cstdlib>

#include "core/check.hpp"

namespace ygslam {
namespace {

std::vector<Timestamp> stamps_of(std::span<const StampedPose> poses) {
  std::vector<Timestamp> stamps(poses.size());
  std::transform(poses.begin(), poses.end(), stamps.begin(),
                 [](const StampedPose& pose) { return pose.stamp; });
  return stamps;
}

bool within(Timestamp a, Timestamp b, double max_diff_s) {
  return std::llabs(a.ns - b.ns) <= to_ns(max_diff_s);
}

}  // namespace

std::vector<std::size_t> nearest_stamps(std::span<const Timestamp> stamps,
                                        std::span<const Timestamp> among) {
  CHECK(!among.empty());
  std::vector<std::size_t> nearest(stamps.size());
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const auto after = std::lower_bound(among.begin(), among.end(), stamps[i]);
    auto j = static_cast<std::size_t>(after - among.begin());
    if (j == among.size() ||
        (j > 0 && stamps[i].ns - among[j - 1].ns <= among[j].ns - stamps[i].ns)) {
      --j;
    }
    nearest[i] = j;
  }
  return nearest;
}

PosePairs associate(std::span<const StampedPose> truth, std::span<const StampedPose> estimate,
                    double max_diff_s) {
  PosePairs pairs;
  if (truth.empty() || estimate.empty()) return pairs;
  const bool truth_is_shorter = truth.size() < estimate.size();
  const auto shorter = truth_is_shorter ? truth : estimate;
  const auto longer = truth_is_shorter ? estimate : truth;
  const auto nearest = nearest_stamps(stamps_of(shorter), stamps_of(longer));
  for (std::size_t i = 0; i < shorter.size(); ++i) {
    const StampedPose& other = longer[nearest[i]];
    if (!within(shorter[i].stamp, other.stamp, max_diff_s)) continue;
    pairs.truth.push_back(truth_is_shorter ? shorter[i] : other);
    pairs.estimate.push_back(truth_is_shorter ? other : shorter[i]);
  }
  return pairs;
}

double coverage(std::span<const Timestamp> frames, std::span<const StampedPose> estimate,
                double max_diff_s) {
  if (frames.empty()) return 0.0;
  std::vector<bool> covered(frames.size(), false);
  const auto stamps = stamps_of(estimate);
  const auto nearest = nearest_stamps(stamps, frames);
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (within(stamps[i], frames[nearest[i]], max_diff_s)) covered[nearest[i]] = true;
  }
  const auto count = std::count(covered.begin(), covered.end(), true);
  return static_cast<double>(count) / static_cast<double>(frames.size());
}

}  // namespace ygslam
