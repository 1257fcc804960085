#include "io/trajectory_checks.hpp"

#include <algorithm>
#include <vector>

#include "geometry/se3.hpp"
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

bool looks_like_kitti(std::string_view line) {
  constexpr double kTolerance = 1e-2;  // printed with few decimals it is only nearly orthonormal
  const auto words = words_of(line, ",;");
  Eigen::Matrix<double, 3, 4, Eigen::RowMajor> matrix;
  if (words.size() != static_cast<std::size_t>(matrix.size())) return false;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto value = parse_number(words[i]);
    if (!value) return false;
    matrix.data()[i] = *value;
  }
  const Mat3 R = matrix.leftCols<3>();
  return (R * R.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() < kTolerance;
}

}  // namespace ygslam
