#include "io/name_readings.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <numeric>
#include <set>
#include <utility>

namespace ygslam::name_digits {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kShortestStep_ns = kSecond_ns / 240;
constexpr std::int64_t kLongestStep_ns = kSecond_ns;
constexpr std::int64_t kFramesPerSecond = 30;
constexpr std::int64_t kMostFrames = 1'000'000'000;    // at 30 Hz: a year
constexpr std::int64_t kEpochBegin_s = 1'000'000'000;  // 2001
constexpr std::int64_t kEpochEnd_s = 2'500'000'000;    // 2049
constexpr std::int64_t kLongestUptime_s = 10'000'000;  // of clocks that do not count from 1970
constexpr std::int64_t kMostStride = 100;    // of numbers of frames that are equally far apart
constexpr std::int64_t kMostIrregular = 15;  // of others; as milliseconds faster than cameras
// Or milliseconds of a usual camera: 15, 25, 30, 60 Hz.
constexpr std::array<std::int64_t, 7> kUnclearStrides = {16, 17, 33, 34, 40, 66, 67};

struct Steps {
  std::vector<std::int64_t> all;  // in order; some 0 where values are doubled
  std::int64_t median = 0, divisor = 0;

  /// The share of steps that are about as long as the median one.
  [[nodiscard]] bool are_regular(double tolerance) const {
    constexpr double kLeastShare = 0.6;
    const double reach = tolerance * static_cast<double>(median);
    const auto near = std::ranges::count_if(all, [&](std::int64_t step) {
      return static_cast<double>(std::llabs(step - median)) <= reach;
    });
    return static_cast<double>(near) >= kLeastShare * static_cast<double>(all.size());
  }
};

Steps steps_of(std::vector<std::int64_t> values) {
  std::ranges::sort(values);
  Steps steps;
  for (std::size_t i = 1; i < values.size(); ++i) {
    steps.all.push_back(values[i] - values[i - 1]);
    steps.divisor = std::gcd(steps.divisor, steps.all.back());
  }
  std::vector<std::int64_t> sorted = steps.all;
  std::ranges::sort(sorted);
  if (!sorted.empty()) steps.median = sorted[(sorted.size() - 1) / 2];
  return steps;
}

bool has_doubles(const Steps& steps) { return std::ranges::find(steps.all, 0) != steps.all.end(); }

struct Unit {
  const char* name;
  std::int64_t in_ns;
  int decimals;
};
constexpr std::array<Unit, 3> kUnits = {
    {{"milliseconds", 1'000'000, 3}, {"microseconds", 1'000, 6}, {"nanoseconds", 1, 9}}};

Reading time_in(const Unit& unit, const std::vector<std::int64_t>& values) {
  Reading reading;
  reading.kind = Reading::Kind::kTime;
  for (const std::int64_t value : values) reading.ns.push_back(value * unit.in_ns);
  reading.decimals = unit.decimals;
  reading.what = unit.name;
  return reading;
}

bool is_camera_step(std::int64_t step_ns) {
  return step_ns >= kShortestStep_ns && step_ns <= kLongestStep_ns;
}

/// From the end of one minute to the beginning of the next, where all else stays within seconds.
bool leaps_over_a_minute(const Column& column, std::int64_t per_second) {
  std::vector<std::int64_t> values = column.values;
  std::ranges::sort(values);
  for (std::size_t i = 1; i < values.size(); ++i) {
    const std::int64_t before = values[i - 1] / per_second, after = values[i] / per_second;
    const bool is_next_minute = after / 100 == before / 100 + 1 ||
                                (before / 100 % 100 == 59 && after / 100 == before / 100 + 41);
    if (is_next_minute && before % 100 > 50 && before % 100 < 60 && after % 100 < 10) return true;
  }
  return false;
}

/// hhmmss, with further digits behind: a clock's minutes have no seconds from 60 to 99.
bool is_clock(const Column& column, std::int64_t per_second) {
  const auto [low, high] = std::ranges::minmax(column.values);
  if (column.shortest != column.longest) return false;
  const bool leaps = leaps_over_a_minute(column, per_second);
  if (high - low < 100 * per_second && !leaps) return false;
  constexpr std::size_t kManySeconds = 20;
  std::set<std::int64_t> seconds;
  for (const std::int64_t value : column.values) {
    const std::int64_t clock = value / per_second;
    if (clock % 100 >= 60 || clock / 100 % 100 >= 60 || clock >= 240000) return false;
    seconds.insert(clock % 100);
  }
  return leaps || seconds.size() >= kManySeconds;
}

/// Times since 1970 in some unit, by their size alone.
Reading since_1970(const Column& column, const Steps& steps) {
  const std::int64_t highest = std::ranges::max(column.values);
  constexpr std::array<Unit, 4> kAll = {
      {{"seconds", kSecond_ns, 0}, kUnits[0], kUnits[1], kUnits[2]}};
  for (const Unit& unit : kAll) {
    const std::int64_t per_second = kSecond_ns / unit.in_ns;
    if (highest < kEpochBegin_s * per_second || highest >= kEpochEnd_s * per_second) continue;
    if (!steps.all.empty() && steps.median < kShortestStep_ns / unit.in_ns) return {};
    const bool is_slow = steps.median > per_second && steps.are_regular(0.3);
    for (const Unit& finer : kAll)
      if (is_slow && finer.in_ns < unit.in_ns && is_camera_step(steps.median * finer.in_ns))
        return unclear(std::string(unit.name) + " since 1970, or " + finer.name);
    Reading reading = time_in(unit, column.values);
    reading.since_1970 = true;
    reading.what = std::string(unit.name) + " since 1970";
    return reading;
  }
  return {};
}

Reading frames(const Column& column, const Steps& steps) {
  if (std::ranges::max(column.values) >= kMostFrames) return {};
  Reading reading;
  reading.kind = Reading::Kind::kFrames;
  for (const std::int64_t value : column.values)
    reading.ns.push_back(value * 1'000'000 / kFramesPerSecond * 1000);
  reading.what = "numbers of frames at " + std::to_string(kFramesPerSecond) + " Hz";
  if (steps.divisor > 1 && steps.all.size() > 1)
    reading.what += ", " + std::to_string(steps.divisor) + " apart";
  return reading;
}

std::string fraction_name(std::size_t digits) {
  for (const Unit& unit : kUnits)
    if (digits == static_cast<std::size_t>(unit.decimals))
      return std::string("seconds and ") + unit.name;
  return "seconds";
}

/// @param digits of the unit that a fraction is a number of; 0: they stand behind a decimal point.
Reading seconds_and(const Column& seconds, const Column& fraction, std::size_t digits) {
  constexpr std::size_t kMostDigits = 9;
  Reading reading;
  reading.kind = Reading::Kind::kTime;
  for (std::size_t i = 0; i < seconds.values.size(); ++i) {
    std::int64_t part_ns = fraction.values[i];
    for (std::size_t d = digits > 0 ? digits : fraction.digits[i].size(); d < kMostDigits; ++d)
      part_ns *= 10;
    reading.ns.push_back(seconds.values[i] * kSecond_ns + part_ns);
  }
  reading.decimals = static_cast<int>(digits > 0 ? digits : fraction.longest);
  reading.what = fraction.shortest == fraction.longest || digits > 0
                     ? fraction_name(static_cast<std::size_t>(reading.decimals))
                     : "seconds";
  return reading;
}

/// A fraction runs through the whole of a second: where the seconds change, time does not leap.
bool runs_through(const Reading& reading, const Column& seconds, const Steps& steps) {
  const auto order = order_of(reading.ns);
  std::vector<std::int64_t> at_change;
  for (std::size_t i = 1; i < order.size(); ++i)
    if (seconds.values[order[i]] != seconds.values[order[i - 1]])
      at_change.push_back(reading.ns[order[i]] - reading.ns[order[i - 1]]);
  constexpr std::size_t kLeastChanges = 2;
  constexpr std::int64_t kLeap = 3;
  if (at_change.size() < kLeastChanges) return true;
  std::ranges::sort(at_change);
  return at_change[(at_change.size() - 1) / 2] <= kLeap * steps.median;
}

/// Whether a group rises with every change of another one: no fraction of it.
bool rises_throughout(const Column& fraction, const Column& seconds) {
  std::vector<std::size_t> order(seconds.values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) {
    return std::pair{seconds.values[i], fraction.values[i]};
  });
  std::size_t changes = 0;
  for (std::size_t i = 1; i < order.size(); ++i) {
    const bool changed = seconds.values[order[i]] != seconds.values[order[i - 1]];
    changes += changed ? 1 : 0;
    if (changed && fraction.values[order[i]] <= fraction.values[order[i - 1]]) return false;
  }
  return changes >= 2;
}

/// How fractions of different lengths are meant: "12.05" has no unit, "12.50" beside "12.125" no
/// decimal point.
enum class Fraction { kDecimal, kUnit, kEither };
Fraction kind_of(const Column& fraction) {
  if (fraction.shortest == fraction.longest) return Fraction::kDecimal;
  bool leads = false;
  bool trails = false;
  for (const std::string_view digits : fraction.digits) {
    if (digits.size() == fraction.longest || digits == "0") continue;
    leads |= digits.front() == '0';
    trails |= digits.back() == '0';
  }
  if (leads == trails) return Fraction::kEither;
  return leads ? Fraction::kDecimal : Fraction::kUnit;
}

}  // namespace

std::vector<std::size_t> order_of(const std::vector<std::int64_t>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return values[i]; });
  return order;
}

Reading unclear(const std::string& why) {
  Reading reading;
  reading.kind = Reading::Kind::kUnclear;
  reading.what = why;
  return reading;
}

Reading read_number(const Column& column) {
  if (column.values.empty()) return {};
  const Steps steps = steps_of(column.values);
  if (has_doubles(steps)) return {};
  if (Reading epoch = since_1970(column, steps); epoch.kind != Reading::Kind::kNone) return epoch;
  if (is_clock(column, 1) || is_clock(column, 1000)) return unclear(kTimeOfDay);
  constexpr std::int64_t kCounted = 3;
  if (steps.median <= kCounted) return frames(column, steps);
  const bool strides = steps.divisor == steps.median;
  if (strides && std::ranges::find(kUnclearStrides, steps.median) != kUnclearStrides.end())
    return unclear("numbers of frames " + std::to_string(steps.median) + " apart, or milliseconds");
  constexpr double kTimersJitter = 0.15;
  const bool is_time = !strides && steps.are_regular(kTimersJitter);
  if (!is_time && steps.median <= (strides ? kMostStride : kMostIrregular))
    return frames(column, steps);
  const std::int64_t highest = std::ranges::max(column.values);
  for (const Unit& unit : kUnits) {
    const bool fits = highest / (kSecond_ns / unit.in_ns) < kLongestUptime_s;
    if (!fits || !is_camera_step(steps.median * unit.in_ns)) continue;
    if (!is_time && unit.in_ns == kUnits[0].in_ns)
      return unclear("numbers of frames far apart, or milliseconds");
    if (steps.are_regular(0.3)) return time_in(unit, column.values);
  }
  return {};
}

Reading read_pair(const Column& seconds, const Column& fraction, bool is_pointed) {
  if (seconds.values.empty() || fraction.values.empty() || fraction.longest > 9) return {};
  const std::int64_t latest_s = std::ranges::max(seconds.values);
  const bool epoch = latest_s >= kEpochBegin_s && latest_s < kEpochEnd_s;
  if (latest_s >= kEpochEnd_s || (!epoch && latest_s >= kLongestUptime_s && !is_pointed)) return {};
  if (!epoch && !is_pointed && (!fraction.varies || rises_throughout(fraction, seconds))) return {};
  const auto judged = [&](std::size_t digits) {
    Reading reading = seconds_and(seconds, fraction, digits);
    reading.since_1970 = epoch;
    const Steps steps = steps_of(reading.ns);
    bool fits = !has_doubles(steps) && (steps.all.empty() || steps.median >= kShortestStep_ns) &&
                runs_through(reading, seconds, steps);
    if (!epoch && !is_pointed)
      fits = fits && steps.median <= kLongestStep_ns && steps.are_regular(0.3);
    if (!fits) reading.kind = Reading::Kind::kNone;
    if (fits && is_clock(seconds, 1)) return unclear(kTimeOfDay);
    return reading;
  };
  const std::size_t unit_digits = (fraction.longest + 2) / 3 * 3;
  const Fraction kind = kind_of(fraction);
  if (kind == Fraction::kDecimal) return judged(0);
  if (kind == Fraction::kUnit) return judged(unit_digits);
  Reading decimal = judged(0);
  Reading unit = judged(unit_digits);
  if (unit.kind == Reading::Kind::kNone) return decimal;
  if (decimal.kind == Reading::Kind::kNone) return unit;
  const bool decimal_regular = steps_of(decimal.ns).are_regular(0.15);
  if (decimal_regular == steps_of(unit.ns).are_regular(0.15))
    return unclear(unit.what + ", or seconds with a decimal point");
  return decimal_regular ? decimal : unit;
}

}  // namespace ygslam::name_digits
