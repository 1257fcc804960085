#include "io/trajectory_columns.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <set>

#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr std::array<std::string_view, 4> kUnitNames = {"seconds", "milliseconds", "microseconds",
                                                        "nanoseconds"};
// A stamp counted from 1970 in seconds, milliseconds, ...: 1990 to 2100.
constexpr double kEarliestEpoch_s = 6.3e8, kLatestEpoch_s = 4.1e9;

using Tokens = std::vector<std::string>;

// "field.pose.position.x" -> field pose position x; "q_RS_w []" -> q rs w.
Tokens tokens_of_name(std::string_view name) {
  Tokens tokens(1);
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      tokens.back().push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
    } else if (!tokens.back().empty()) {
      tokens.emplace_back();
    }
  }
  if (tokens.back().empty()) tokens.pop_back();
  return tokens;
}

bool has_any(const Tokens& tokens, std::initializer_list<std::string_view> words) {
  return std::any_of(tokens.begin(), tokens.end(), [&](const std::string& token) {
    return std::find(words.begin(), words.end(), token) != words.end();
  });
}

std::optional<StampUnit> unit_of_name(Tokens& tokens) {
  if (tokens.size() < 2) return std::nullopt;
  std::optional<StampUnit> unit;
  const std::string& last = tokens.back();
  if (last == "s" || last == "sec" || last == "secs" || last == "seconds")
    unit = StampUnit::kSeconds;
  if (last == "ms") unit = StampUnit::kMilliseconds;
  if (last == "us") unit = StampUnit::kMicroseconds;
  if (last == "ns") unit = StampUnit::kNanoseconds;
  if (unit || last == "m" || last == "rad") tokens.pop_back();
  return unit;
}

// x, y, z, w as 0 to 3.
std::optional<std::size_t> axis_of(char letter) {
  constexpr std::string_view kAxes = "xyzw";
  const std::size_t axis = kAxes.find(letter);
  return axis == std::string_view::npos ? std::nullopt : std::optional(axis);
}

enum class Role { kOther, kStamp, kHeaderStamp, kSeconds, kNanoseconds, kPosition, kQuaternion };
struct NamedColumn {
  Role role = Role::kOther;
  std::size_t axis = 0;
};

NamedColumn pose_role(const Tokens& tokens) {
  if (has_any(tokens, {"twist", "linear", "angular", "covariance", "v", "vel", "velocity", "b",
                       "bw", "ba", "bias", "omega", "acceleration", "euler", "point3d"}))
    return {};
  const std::string& last = tokens.back();
  const auto axis = axis_of(last.back());
  if (!axis) return {};
  const std::string stem = last.substr(0, last.size() - 1);
  Tokens rest(tokens.begin(), tokens.end() - 1);
  if (!stem.empty()) rest.push_back(stem);
  if (has_any(rest, {"q", "quat", "quaternion", "orientation", "rot", "rotation"}))
    return {Role::kQuaternion, *axis};
  if (*axis == 3) return {};
  const bool is_position =
      rest.empty() ||
      (stem.empty() && has_any(rest, {"p", "position", "pos", "t", "trans", "translation"})) ||
      stem == "t" || stem == "p" || stem == "pos";
  return is_position ? NamedColumn{Role::kPosition, *axis} : NamedColumn{};
}

NamedColumn role_of(const Tokens& tokens) {
  if (tokens.empty()) return {};
  const std::string& last = tokens.back();
  const bool in_header = has_any(tokens, {"stamp", "header"});
  if (in_header && (last == "sec" || last == "secs")) return {Role::kSeconds};
  if (last == "nanosec" || last == "nanosecs" || last == "nsec" || last == "nsecs")
    return {Role::kNanoseconds};
  if (last == "sec" || last == "secs") return {Role::kSeconds};
  if (last == "stamp" && has_any(tokens, {"header"})) return {Role::kHeaderStamp};
  if (last == "stamp" || last == "time" || last == "timestamp" || last == "timestamps" ||
      (tokens.size() == 1 && last == "t"))
    return {Role::kStamp};
  return pose_role(tokens);
}

// The columns found so far; a role that is named twice is remembered.
struct Naming {
  std::array<std::optional<std::size_t>, 3> position;
  std::array<std::optional<std::size_t>, 4> quaternion;
  std::optional<std::size_t> stamp, header_stamp, seconds, nanoseconds;
  std::optional<StampUnit> unit;
  std::optional<std::size_t> twice;

  void put(std::optional<std::size_t>& place, std::size_t column) {
    if (place) twice = column;
    if (!place) place = column;
  }
  void add(const NamedColumn& named, std::size_t column) {
    if (named.role == Role::kPosition) put(position[named.axis], column);
    if (named.role == Role::kQuaternion) put(quaternion[named.axis], column);
    const auto first = [column](auto& place) {
      if (!place) place = column;
    };
    if (named.role == Role::kStamp) first(stamp);
    if (named.role == Role::kHeaderStamp) first(header_stamp);
    if (named.role == Role::kSeconds) first(seconds);
    if (named.role == Role::kNanoseconds) first(nanoseconds);
  }
  [[nodiscard]] bool has_position() const {
    return std::all_of(position.begin(), position.end(), [](auto p) { return p.has_value(); });
  }
  [[nodiscard]] bool has_quaternion() const {
    return std::all_of(quaternion.begin(), quaternion.end(), [](auto p) { return p.has_value(); });
  }
};

PoseColumns columns_of(const Naming& naming) {
  PoseColumns columns;
  for (std::size_t i = 0; i < 3; ++i) columns.position_at[i] = *naming.position[i];
  for (std::size_t i = 0; i < 4; ++i) columns.quaternion_at[i] = *naming.quaternion[i];
  columns.stamp = PoseColumns::Stamp::kNone;
  const auto number = naming.header_stamp ? naming.header_stamp : naming.stamp;
  if (naming.seconds && naming.nanoseconds) {
    columns.stamp = PoseColumns::Stamp::kSecondsAndNanoseconds;
    columns.stamp_at = *naming.seconds;
    columns.nanoseconds_at = *naming.nanoseconds;
  } else if (number || naming.seconds || naming.nanoseconds) {
    columns.stamp = PoseColumns::Stamp::kNumber;
    columns.stamp_at = number ? *number : naming.seconds ? *naming.seconds : *naming.nanoseconds;
    columns.unit = naming.unit;
    if (!number && !naming.seconds) columns.unit = StampUnit::kNanoseconds;
  }
  return columns;
}

}  // namespace

std::string_view name_of(StampUnit unit) { return kUnitNames.at(static_cast<std::size_t>(unit)); }

std::optional<Timestamp> parse_stamp(std::string_view word, StampUnit unit) {
  const std::size_t e = std::min(word.find_first_of("eE"), word.size());
  double exponent = 0;
  if (e < word.size()) {
    const auto written = parse_number(word.substr(e + 1));
    if (!written || std::abs(*written) > 40 || *written != std::floor(*written))
      return std::nullopt;
    exponent = *written;
  }
  const std::string_view mantissa = word.substr(0, e);
  const std::size_t point = std::min(mantissa.find('.'), mantissa.size());
  if (unit == StampUnit::kNanoseconds && exponent == 0 &&
      mantissa.find_first_not_of(".0", point) != std::string_view::npos)
    return std::nullopt;  // nothing is finer
  const int shifted = static_cast<int>(exponent) - 3 * static_cast<int>(unit);
  const auto stamp = parse_stamp(std::string(mantissa) + "e" + std::to_string(shifted));
  return stamp ? std::optional(stamp->stamp) : std::nullopt;
}

double quaternion_length(const PoseRecord& record, const std::array<std::size_t, 4>& at) {
  double squares = 0;
  for (const std::size_t column : at) {
    const auto value =
        column < record.fields.size() ? parse_number(record.fields[column]) : std::nullopt;
    if (!value) return std::numeric_limits<double>::quiet_NaN();
    squares += *value * *value;
  }
  return std::sqrt(squares);
}

StampUnit unit_of_stamps(const std::vector<PoseRecord>& records, std::size_t stamp_at) {
  for (const PoseRecord& record : records) {
    const auto value =
        stamp_at < record.fields.size() ? parse_number(record.fields[stamp_at]) : std::nullopt;
    if (!value) continue;
    for (const StampUnit unit :
         {StampUnit::kMilliseconds, StampUnit::kMicroseconds, StampUnit::kNanoseconds}) {
      const double s = *value * std::pow(1e-3, static_cast<int>(unit));
      if (s > kEarliestEpoch_s && s < kLatestEpoch_s) return unit;
    }
    return StampUnit::kSeconds;
  }
  return StampUnit::kSeconds;
}

Result<std::optional<PoseColumns>> columns_of_names(const std::vector<std::string_view>& names) {
  Naming naming;
  bool has_angles = false;
  for (std::size_t column = 0; column < names.size(); ++column) {
    Tokens tokens = tokens_of_name(names[column]);
    const Role as_written = role_of(tokens).role;
    const bool is_split_stamp = as_written == Role::kSeconds || as_written == Role::kNanoseconds;
    const auto unit =
        is_split_stamp && has_any(tokens, {"stamp"}) ? std::nullopt : unit_of_name(tokens);
    const NamedColumn named = role_of(tokens);
    if (unit && named.role == Role::kStamp && !naming.stamp) naming.unit = unit;
    naming.add(named, column);
    has_angles = has_angles || has_any(tokens, {"roll", "pitch", "yaw", "rx", "ry", "rz"});
  }
  if (!naming.has_position()) return std::optional<PoseColumns>();
  if (!naming.has_quaternion()) {
    if (!has_angles) return std::optional<PoseColumns>();
    return Error{ErrorKind::kInput,
                 "the header names angles; a rotation must be a quaternion or a matrix"};
  }
  if (naming.twice)
    return Error{ErrorKind::kInput, "the header names two columns like '" +
                                        printable(names[*naming.twice]) + "': which is the pose?"};
  return std::optional(columns_of(naming));
}

std::vector<std::string_view> csv_fields(std::string_view line) {
  std::vector<std::string_view> fields;
  while (true) {
    const std::size_t end = line.find_first_of(",;");
    std::string_view field = trimmed(line.substr(0, end));
    if (field.size() >= 2 && field.front() == '"' && field.back() == '"')
      field = trimmed(field.substr(1, field.size() - 2));
    fields.push_back(field);
    if (end == std::string_view::npos) return fields;
    line.remove_prefix(end + 1);
  }
}

}  // namespace ygslam
