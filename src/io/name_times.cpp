#include "io/name_times.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <map>
#include <numeric>
#include <set>
#include <string_view>
#include <utility>

#include "io/text.hpp"

namespace ygslam {
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

/// A name's groups of digits, and what stands around them.
struct SplitName {
  std::string form;  // with \1 for each group
  std::vector<std::string_view> groups;
};

SplitName split(std::string_view stem) {
  constexpr std::string_view kDigits = "0123456789";
  SplitName name;
  while (!stem.empty()) {
    const std::size_t begin = std::min(stem.find_first_of(kDigits), stem.size());
    name.form += stem.substr(0, begin);
    stem.remove_prefix(begin);
    if (stem.empty()) break;
    const std::size_t end = std::min(stem.find_first_not_of(kDigits), stem.size());
    name.form += '\1';
    name.groups.push_back(stem.substr(0, end));
    stem.remove_prefix(end);
  }
  return name;
}

/// One group of digits in all names.
struct Column {
  std::vector<std::string_view> digits;
  std::vector<std::int64_t> values;  // empty: some do not fit
  std::size_t shortest = 0, longest = 0;
  bool varies = false;
};

Column column_of(const std::vector<SplitName>& names, std::size_t group) {
  Column column;
  for (const SplitName& name : names) {
    const std::string_view digits = name.groups[group];
    column.digits.push_back(digits);
    column.varies |= digits != column.digits.front();
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error == std::errc{} && end == digits.data() + digits.size())
      column.values.push_back(value);
  }
  if (column.values.size() < names.size()) column.values.clear();
  const auto [low, high] = std::ranges::minmax(column.digits, {}, &std::string_view::size);
  column.shortest = low.size();
  column.longest = high.size();
  return column;
}

/// One way to read the names.
struct Reading {
  enum class Kind { kNone, kUnclear, kFrames, kTime } kind = Kind::kNone;
  std::vector<std::int64_t> ns;
  int decimals = 6;
  std::string what;  // taken as; or why it is not clear
  bool since_1970 = false;
  std::size_t first = 0, last = 0;  // groups it uses
};

Reading unclear(const std::string& why) {
  Reading reading;
  reading.kind = Reading::Kind::kUnclear;
  reading.what = why;
  return reading;
}

std::vector<std::size_t> order_of(const std::vector<std::int64_t>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return values[i]; });
  return order;
}

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

/// hhmmss, with further digits behind: a clock's minutes have no seconds from 60 to 99.
bool is_clock(const Column& column, std::int64_t per_second) {
  const auto [low, high] = std::ranges::minmax(column.values);
  if (column.shortest != column.longest || high - low < 100 * per_second) return false;
  constexpr std::size_t kManySeconds = 20;
  std::set<std::int64_t> seconds;
  for (const std::int64_t value : column.values) {
    const std::int64_t clock = value / per_second;
    if (clock % 100 >= 60 || clock / 100 % 100 >= 60 || clock >= 240000) return false;
    seconds.insert(clock % 100);
  }
  return seconds.size() >= kManySeconds;
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

/// What a group of digits alone may be.
Reading read_number(const Column& column) {
  if (column.values.empty()) return {};
  const Steps steps = steps_of(column.values);
  if (has_doubles(steps)) return {};
  if (Reading epoch = since_1970(column, steps); epoch.kind != Reading::Kind::kNone) return epoch;
  if (is_clock(column, 1) || is_clock(column, 1000)) return unclear("a time of day");
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

/// Two groups with one sign between them as seconds and their fraction.
/// @param is_pointed the whole name is a number with a decimal point.
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
    if (fits && is_clock(seconds, 1)) return unclear("a time of day");
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

/// Groups that a reading does not use rise with it, or stay.
bool explains(const Reading& reading, const std::vector<Column>& columns) {
  const auto order = order_of(reading.ns);
  for (std::size_t g = 0; g < columns.size(); ++g) {
    const Column& column = columns[g];
    if (!column.varies || (g >= reading.first && g <= reading.last)) continue;
    if (column.values.empty()) return false;
    for (std::size_t i = 1; i < order.size(); ++i)
      if (column.values[order[i]] < column.values[order[i - 1]]) return false;
  }
  return true;
}

/// The last of readings that span the same time: of a pair and its fraction alone the fraction.
Reading agreed(const std::vector<Reading>& readings) {
  const auto span_of = [](const Reading& reading) {
    const auto [low, high] = std::ranges::minmax(reading.ns);
    return static_cast<double>(high - low);
  };
  constexpr double kSame = 1.01;
  const double span = span_of(readings.front());
  for (const Reading& other : readings)
    if (span_of(other) > kSame * span || span > kSame * span_of(other))
      return unclear(readings.front().what + ", or " + other.what);
  return readings.back();
}

/// All that the names of one form may say.
class Readings {
 public:
  explicit Readings(const std::vector<Column>& columns) : columns_(columns) {}

  void offer(Reading reading, std::size_t first, std::size_t last) {
    reading.first = first;
    reading.last = last;
    if (reading.kind == Reading::Kind::kNone) return;
    if (reading.kind == Reading::Kind::kUnclear) {
      doubt_ = reading.what;
    } else if (!explains(reading, columns_)) {
      order_doubt_ = "as " + reading.what + " they are in another order than other digits say";
    } else if (reading.kind == Reading::Kind::kTime) {
      times_.push_back(std::move(reading));
    } else {
      counts_.push_back(std::move(reading));
    }
  }
  /// What needs no comparison: a time by its size.
  [[nodiscard]] const Reading* certain() const {
    const auto found = std::ranges::find(times_, true, &Reading::since_1970);
    return found == times_.end() ? nullptr : &*found;
  }
  [[nodiscard]] Reading best() const {
    if (const Reading* time = certain()) return *time;
    if (!times_.empty()) return agreed(times_);
    if (!doubt_.empty()) return unclear(doubt_);
    if (!counts_.empty()) return agreed(counts_);
    return unclear(order_doubt_.empty() ? "no digits in them rise as times or numbers of frames do"
                                        : order_doubt_);
  }

 private:
  const std::vector<Column>& columns_;
  std::vector<Reading> times_, counts_;
  std::string doubt_, order_doubt_;
};

/// What stands between the groups of digits.
std::vector<std::string> signs_of(const std::string& form) {
  std::vector<std::string> signs;
  for (std::size_t at = form.find('\1'); at != std::string::npos;) {
    const std::size_t next = form.find('\1', at + 1);
    if (next == std::string::npos) break;
    signs.push_back(form.substr(at + 1, next - at - 1));
    at = next;
  }
  return signs;
}

Reading best_reading(const std::vector<Column>& columns, const std::string& form) {
  Readings readings(columns);
  const auto signs = signs_of(form);
  const bool is_pointed = form == "\1.\1";
  for (std::size_t g = 0; g < signs.size(); ++g) {
    const bool is_sign =
        signs[g].size() == 1 && std::isalnum(static_cast<unsigned char>(signs[g].front())) == 0;
    if (!is_sign) continue;
    Reading pair = read_pair(columns[g], columns[g + 1], is_pointed);
    if (is_pointed && pair.kind == Reading::Kind::kTime) return pair;
    readings.offer(std::move(pair), g, g + 1);
  }
  if (readings.certain() != nullptr) return readings.best();
  const std::size_t names = columns.empty() ? 0 : columns.front().digits.size();
  for (std::size_t g = 0; g < columns.size(); ++g)
    if (columns[g].varies || names == 1) readings.offer(read_number(columns[g]), g, g);
  return readings.best();
}

/// The form that most names have; of several the first in the alphabet.
std::string usual_form(const std::vector<SplitName>& names) {
  std::map<std::string, std::size_t> counts;
  for (const SplitName& name : names)
    if (!name.groups.empty()) ++counts[name.form];
  const auto most =
      std::ranges::max_element(counts, {}, &std::map<std::string, std::size_t>::value_type::second);
  return most == counts.end() ? std::string() : most->first;
}

/// "'a_1_2' (1, 2) and 'a_3_4' (3, 4)": the first two names, and their digits that differ.
std::string shown(std::span<const std::string> stems, const std::vector<std::size_t>& members,
                  const std::vector<Column>& columns) {
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(2, members.size()); ++i) {
    std::string digits;
    for (const Column& column : columns)
      if (column.varies || members.size() == 1)
        digits += (digits.empty() ? "" : ", ") + printable(column.digits[i], 24);
    text += (i > 0 ? " and '" : "'") + printable(stems[members[i]], 60) + "' (" + digits + ")";
  }
  return text;
}

}  // namespace

Result<NameTimes> times_of_names(std::span<const std::string> stems) {
  std::vector<SplitName> names;
  for (const std::string& stem : stems) names.push_back(split(stem));
  const std::string form = usual_form(names);
  std::vector<SplitName> alike;
  std::vector<std::size_t> members;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i].groups.empty() || names[i].form != form) continue;
    alike.push_back(names[i]);
    members.push_back(i);
  }
  const auto refuse = [&](const std::string& what) { return Error{ErrorKind::kInput, what}; };
  if (members.empty())
    return refuse("no number in the names of images" +
                  (stems.empty() ? "" : ": '" + printable(stems.front()) + "'"));
  if (2 * members.size() < stems.size())
    return refuse("the names of images have no common form: '" + printable(stems.front()) +
                  "' and '" + printable(stems.back()) + "'");
  std::vector<Column> columns;
  for (std::size_t g = 0; g < alike.front().groups.size(); ++g)
    columns.push_back(column_of(alike, g));
  const Reading reading = best_reading(columns, form);
  if (reading.kind <= Reading::Kind::kUnclear)
    return refuse("times cannot be told from the names " + shown(stems, members, columns) + ": " +
                  reading.what);
  NameTimes times;
  times.stamps.resize(stems.size());
  for (std::size_t i = 0; i < members.size(); ++i)
    times.stamps[members[i]] = Timestamp{reading.ns[i]};
  times.decimals = reading.decimals;
  times.is_frames = reading.kind == Reading::Kind::kFrames;
  times.taken_as = reading.what;
  return times;
}

}  // namespace ygslam
