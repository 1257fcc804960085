#include "inertial/time_offset.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace ygslam {
namespace {

constexpr std::size_t kFewestTurns = 15;
constexpr double kLeastRate_radps = 0.05;  // how much the rates of turns must differ, RMS
constexpr double kCoarse_s = 0.004;
constexpr double kLongTurn_s = 0.25;  // of several, put together
constexpr std::size_t kFewestLongTurns = 8;
constexpr double kClearRate_radps = 0.15;  // of those
constexpr double kFinest_s = 2e-4;

/// Sums of a gyroscope's readings, to have its mean over any interval.
class TurnSum {
 public:
  explicit TurnSum(const std::deque<ImuSample>& samples) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (i > 0)
        sum += 0.5 * seconds_between(samples[i].stamp, samples[i - 1].stamp) *
               (samples[i].angular_velocity_radps + samples[i - 1].angular_velocity_radps);
      stamps_.push_back(samples[i].stamp);
      sums_.push_back(sum);
    }
  }
  [[nodiscard]] bool reaches(Timestamp from, Timestamp to) const {
    return stamps_.size() >= 2 && stamps_.front() <= from && stamps_.back() >= to;
  }
  [[nodiscard]] Vec3 at(Timestamp t) const {
    const auto next = std::clamp(std::upper_bound(stamps_.begin(), stamps_.end(), t),
                                 stamps_.begin() + 1, stamps_.end() - 1);
    const auto i = static_cast<std::size_t>(next - stamps_.begin());
    const double share =
        seconds_between(t, stamps_[i - 1]) / seconds_between(*next, stamps_[i - 1]);
    return sums_[i - 1] + share * (sums_[i] - sums_[i - 1]);
  }

 private:
  std::vector<Timestamp> stamps_;
  std::vector<Vec3> sums_;
};

/// Mean squared difference of the rates [rad2/s2], the best bias taken out.
double cost(std::span<const SeenTurn> turns, const TurnSum& gyro, double offset_s) {
  Vec3 sum = Vec3::Zero();
  double squares = 0;
  const std::int64_t shift_ns = to_ns(offset_s);
  for (const SeenTurn& turn : turns) {
    const Vec3 measured = gyro.at({turn.to.ns + shift_ns}) - gyro.at({turn.from.ns + shift_ns});
    const Vec3 difference = (measured - turn.turn_imu_rad) / seconds_between(turn.to, turn.from);
    sum += difference;
    squares += difference.squaredNorm();
  }
  const auto count = static_cast<double>(turns.size());
  return std::max(0.0, squares / count - (sum / count).squaredNorm());
}

double spread(std::span<const SeenTurn> turns) {
  Vec3 sum = Vec3::Zero();
  double squares = 0;
  for (const SeenTurn& turn : turns) {
    const Vec3 rate = turn.turn_imu_rad / seconds_between(turn.to, turn.from);
    sum += rate;
    squares += rate.squaredNorm();
  }
  const auto count = static_cast<double>(turns.size());
  return squares / count - (sum / count).squaredNorm();
}

/// Of an offset, by the noise of the attitudes that turns lie between: what makes one turn too long
/// makes the next one too short. @param left cost() there.
double offset_sigma(std::span<const SeenTurn> turns, const TurnSum& gyro, double offset_s,
                    double left) {
  constexpr double kStep_s = 1e-3;
  const auto turned = [&](const SeenTurn& turn, double at_s) {
    return Vec3(gyro.at({turn.to.ns + to_ns(at_s)}) - gyro.at({turn.from.ns + to_ns(at_s)}));
  };
  double gain = 0, noise = 0, duration_s = 0;
  Vec3 before = Vec3::Zero();  // how the turn before changes with the offset
  Timestamp end;
  for (const SeenTurn& turn : turns) {
    const Vec3 change =
        (turned(turn, offset_s + kStep_s) - turned(turn, offset_s - kStep_s)) / (2 * kStep_s);
    noise += turn.from == end ? (change - before).squaredNorm()
                              : before.squaredNorm() + change.squaredNorm();
    gain += change.squaredNorm();
    duration_s += seconds_between(turn.to, turn.from);
    before = change;
    end = turn.to;
  }
  noise += before.squaredNorm();
  const double step_s = duration_s / static_cast<double>(turns.size());
  const double attitude_variance = left * step_s * step_s / 6;  // 3 axes of 2 ends
  return gain > 0 ? std::sqrt(attitude_variance * noise) / gain : duration_s;
}

std::vector<SeenTurn> within_reach(std::span<const SeenTurn> turns, const TurnSum& gyro,
                                   double reach_s) {
  std::vector<SeenTurn> usable;
  const std::int64_t reach_ns = to_ns(reach_s);
  for (const SeenTurn& turn : turns)
    if (turn.to > turn.from && gyro.reaches({turn.from.ns - reach_ns}, {turn.to.ns + reach_ns}))
      usable.push_back(turn);
  return usable;
}

template <typename CostAt>
double best_coarse(const CostAt& cost_at, double reach_s) {
  double best = -reach_s, least = cost_at(-reach_s);
  const int steps = static_cast<int>(std::round(reach_s / kCoarse_s));
  for (int i = -steps; i <= steps; ++i) {
    const double cost = cost_at(i * kCoarse_s);
    if (cost >= least) continue;
    best = i * kCoarse_s;
    least = cost;
  }
  return best;
}

/// Those that follow each other as one, up to kLongTurn_s.
std::vector<SeenTurn> put_together(std::span<const SeenTurn> turns) {
  std::vector<SeenTurn> result;
  for (const SeenTurn& turn : turns) {
    const bool goes_on = !result.empty() && result.back().to == turn.from &&
                         seconds_between(turn.to, result.back().from) <= kLongTurn_s;
    if (!goes_on) {
      result.push_back(turn);
      continue;
    }
    SeenTurn& sum = result.back();
    sum.to = turn.to;
    sum.turn_imu_rad = so3_log(so3_exp(sum.turn_imu_rad) * so3_exp(turn.turn_imu_rad));
  }
  return result;
}

}  // namespace

std::optional<TimeOffset> estimate_time_offset(std::span<const SeenTurn> turns,
                                               const std::deque<ImuSample>& samples,
                                               double reach_s) {
  const TurnSum gyro(samples);
  const std::vector<SeenTurn> usable = within_reach(turns, gyro, reach_s);
  if (usable.size() < kFewestTurns) return std::nullopt;
  const double seen = spread(usable);
  if (seen < kLeastRate_radps * kLeastRate_radps) return std::nullopt;

  const auto cost_at = [&](double offset_s) { return cost(usable, gyro, offset_s); };
  double best = best_coarse(cost_at, reach_s);
  if (std::abs(best) > reach_s - 1.5 * kCoarse_s) return std::nullopt;  // it may lie beyond
  for (double step = kCoarse_s; step > kFinest_s; step /= 4) {  // the parabola's lowest point
    const double before = cost_at(best - step), here = cost_at(best), after = cost_at(best + step);
    const double bend = before - 2 * here + after;
    if (bend <= 0) break;  // finer than the samples tell
    best += std::clamp(0.5 * (before - after) / bend, -1.0, 1.0) * step;
  }
  const double left = cost_at(best);
  return TimeOffset{best, offset_sigma(usable, gyro, best, left), 1 - left / seen};
}

double most_explained(std::span<const SeenTurn> turns, const std::deque<ImuSample>& samples,
                      double reach_s) {
  const TurnSum gyro(samples);
  const std::vector<SeenTurn> usable = within_reach(put_together(turns), gyro, reach_s);
  const double seen = usable.size() < kFewestLongTurns ? 0 : spread(usable);
  if (seen < kClearRate_radps * kClearRate_radps) return 1;
  const auto cost_at = [&](double offset_s) { return cost(usable, gyro, offset_s); };
  return 1 - cost_at(best_coarse(cost_at, reach_s)) / seen;
}

}  // namespace ygslam
