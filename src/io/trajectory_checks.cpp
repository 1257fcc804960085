#include "io/trajectory_checks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMostWholeNumbers = 12;  // more columns have no format, all without a point

// How many digits a text begins with.
std::size_t digits_of(std::string_view text) {
  const auto end =
      std::find_if(text.begin(), text.end(), [](char c) { return c < '0' || c > '9'; });
  return static_cast<std::size_t>(end - text.begin());
}

std::string_view without_sign(std::string_view word) {
  if (!word.empty() && (word.front() == '-' || word.front() == '+')) word.remove_prefix(1);
  return word;
}

bool is_exponent_or_empty(std::string_view rest) {
  if (rest.empty()) return true;
  if (rest.front() != 'e' && rest.front() != 'E') return false;
  rest = without_sign(rest.substr(1));
  return !rest.empty() && digits_of(rest) == rest.size();
}

bool is_written_whole(std::string_view word) {
  word = without_sign(word);
  const std::size_t digits = digits_of(word);
  return digits > 0 && is_exponent_or_empty(word.substr(digits));
}

// Whether the rows of a 3x4 matrix have rotations that fit each other; a row with the missing
// number in it (NaN) is left out. At least two rows must be known.
bool has_rotation(const std::vector<double>& m) {
  std::vector<const double*> rows;
  for (std::size_t r = 0; r < 3; ++r) {
    const double* row = m.data() + 4 * r;
    if (!std::isnan(row[0] + row[1] + row[2])) rows.push_back(row);
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t j = i; j < rows.size(); ++j) {
      const double dot =
          rows[i][0] * rows[j][0] + rows[i][1] * rows[j][1] + rows[i][2] * rows[j][2];
      if (std::abs(dot - (i == j ? 1 : 0)) > kRotationTolerance) return false;
    }
  }
  return true;
}

}  // namespace

Status check_line_ends(std::string_view text, const std::string& name) {
  int number = 1;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const bool is_last = end == std::string_view::npos;
    const std::string_view line = trimmed(text.substr(0, end));
    const bool is_comment = line.starts_with('#') && !(is_last && number == 1);
    if (!is_comment && line.find('\r') != std::string_view::npos) {
      return Error{ErrorKind::kInput, name + ":" + std::to_string(number) +
                                          ": a carriage return within the line; lines must end in "
                                          "LF or CR LF"};
    }
    text.remove_prefix(is_last ? text.size() : end + 1);
    ++number;
  }
  return Ok{};
}

Status check_is_text(std::string_view text, const std::string& name) {
  if (const std::string fault = no_text_fault(text); !fault.empty())
    return Error{ErrorKind::kInput, name + ": " + fault};
  if (text.find('\0') == std::string_view::npos) return Ok{};
  return Error{ErrorKind::kInput, name + ": no text (zero bytes in it)"};
}

bool is_decimal_comma(std::string_view word) {
  word = without_sign(word);
  const std::size_t before = digits_of(word);
  if (before == 0 || before == word.size() || word[before] != ',') return false;
  word.remove_prefix(before + 1);
  const std::size_t after = digits_of(word);
  return after > 0 && is_exponent_or_empty(word.substr(after));
}

bool has_decimal_commas(std::string_view line) {
  if (line.find(',') == std::string_view::npos) return false;
  const auto words = words_of(line, ";");
  if (words.size() > 1) {
    return std::any_of(words.begin(), words.end(), is_decimal_comma) &&
           std::all_of(words.begin(), words.end(), [](std::string_view word) {
             return is_decimal_comma(word) || is_written_whole(word);
           });
  }
  const auto parts = words_of(line, ",");
  return parts.size() > kMostWholeNumbers &&
         std::all_of(parts.begin(), parts.end(), is_written_whole);
}

int line_with_brackets(std::string_view text) {
  constexpr std::string_view kBrackets = "[](){}";
  bool is_first = true;
  for (const TextLine& line : data_lines(text)) {
    const bool begins_json = line.text.front() == '{' || line.text.front() == '[';
    if (std::exchange(is_first, false) && begins_json) return line.number;
    if (line.text.find_first_of(kBrackets) == std::string_view::npos) continue;
    for (std::string_view word : words_of(line.text, ",;")) {
      const std::size_t length = word.size();
      word.remove_prefix(std::min(word.find_first_not_of(kBrackets), length));
      word = word.substr(0, word.find_last_not_of(kBrackets) + 1);
      if (word.size() < length && parse_number(word)) return line.number;
    }
  }
  return 0;
}

std::optional<SE3> rigid_motion(std::span<const double> numbers) {
  if (numbers.size() != kKittiColumns && numbers.size() != 16) return std::nullopt;
  using Matrix3x4 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  const Eigen::Map<const Matrix3x4> T(numbers.data());
  const Mat3 R = T.leftCols<3>();
  const bool is_last_row = numbers.size() == kKittiColumns ||
                           std::ranges::equal(numbers.last(4), std::array{0.0, 0.0, 0.0, 1.0});
  if (!is_last_row || !(R * R.transpose()).isIdentity(kRotationTolerance) || R.determinant() < 0)
    return std::nullopt;
  return SE3(Eigen::Quaterniond(R), T.col(3));
}

bool looks_like_kitti(std::string_view line) {
  const auto words = words_of(line, ",;");
  if (words.size() != kKittiColumns && words.size() + 1 != kKittiColumns) return false;
  std::vector<double> numbers;
  for (const std::string_view word : words) {
    const auto value = parse_number(word);
    if (!value) return false;
    numbers.push_back(*value);
  }
  if (numbers.size() == kKittiColumns) return has_rotation(numbers);
  for (std::size_t missing = 0; missing < kKittiColumns; ++missing) {
    std::vector<double> filled = numbers;
    filled.insert(filled.begin() + static_cast<std::ptrdiff_t>(missing), std::nan(""));
    if (has_rotation(filled)) return true;
  }
  return false;
}

}  // namespace ygslam
