#include "io/name_times.hpp"

#include <algorithm>
#include <cctype>
#include <optional>
#include <utility>

#include "io/name_digits.hpp"
#include "io/name_readings.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

using name_digits::Column;
using name_digits::Reading;
using name_digits::SplitName;
using name_digits::unclear;

/// Groups that a reading does not use rise with it, or stay.
bool explains(const Reading& reading, const std::vector<Column>& columns) {
  const auto order = name_digits::order_of(reading.ns);
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

/// The first of three groups that are the hours, minutes and seconds of a clock.
std::optional<std::size_t> clock_groups(const std::vector<Column>& columns,
                                        const std::vector<std::string>& signs) {
  const auto is_two_digits_below = [&](std::size_t g, std::int64_t limit) {
    const Column& column = columns[g];
    return column.shortest == 2 && column.longest == 2 && !column.values.empty() &&
           std::ranges::max(column.values) < limit;
  };
  for (std::size_t g = columns.size(); g-- > 2;) {  // the last: a date may stand before it
    const bool are_parted = signs[g - 2].size() == 1 && signs[g - 1].size() == 1;
    const bool varies = columns[g].varies || columns[g - 1].varies;
    if (are_parted && varies && is_two_digits_below(g - 2, 24) && is_two_digits_below(g - 1, 60) &&
        is_two_digits_below(g, 60))
      return g - 2;
  }
  return std::nullopt;
}

/// Whether a reading of names with a clock's groups in them does without these, or is of the
/// seconds and their fraction within one minute.
bool needs_no_clock(const Reading& reading, const std::vector<Column>& columns, std::size_t hours) {
  if (reading.kind <= Reading::Kind::kUnclear) return false;
  if (reading.since_1970 || reading.last < hours || reading.first > hours + 2) return true;
  return reading.kind == Reading::Kind::kTime && reading.first == hours + 2 &&
         reading.last == hours + 3 && !columns[hours].varies && !columns[hours + 1].varies;
}

Reading reading_without_clock(const std::vector<Column>& columns, const std::string& form) {
  Readings readings(columns);
  const auto signs = name_digits::signs_of(form);
  const bool is_pointed = form == "\1.\1";
  for (std::size_t g = 0; g < signs.size(); ++g) {
    const bool is_sign =
        signs[g].size() == 1 && std::isalnum(static_cast<unsigned char>(signs[g].front())) == 0;
    if (!is_sign) continue;
    Reading pair = name_digits::read_pair(columns[g], columns[g + 1], is_pointed);
    if (is_pointed && pair.kind == Reading::Kind::kTime) return pair;
    readings.offer(std::move(pair), g, g + 1);
  }
  if (readings.certain() != nullptr) return readings.best();
  const std::size_t names = columns.empty() ? 0 : columns.front().digits.size();
  for (std::size_t g = 0; g < columns.size(); ++g)
    if (columns[g].varies || names == 1) readings.offer(name_digits::read_number(columns[g]), g, g);
  return readings.best();
}

Reading best_reading(const std::vector<Column>& columns, const std::string& form) {
  Reading reading = reading_without_clock(columns, form);
  const auto hours = clock_groups(columns, name_digits::signs_of(form));
  if (hours && !needs_no_clock(reading, columns, *hours)) return unclear(name_digits::kTimeOfDay);
  return reading;
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
  for (const std::string& stem : stems) names.push_back(name_digits::split(stem));
  const std::string form = name_digits::usual_form(names);
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
    columns.push_back(name_digits::column_of(alike, g));
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
