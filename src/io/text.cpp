#include "io/text.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>

#include "core/edit_distance.hpp"
#include "core/printable.hpp"

namespace ygslam {
namespace {

constexpr std::string_view kBlank = " \t\r\v\f";

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// The digits of a decimal number and where its point lies: 12.5e1 = {"125", 3}.
struct Decimal {
  bool negative = false;
  std::string digits;
  int point = 0;  // digits before the point; may be negative or beyond the digits
};

std::optional<Decimal> parse_decimal(std::string_view word) {
  Decimal number;
  if (!word.empty() && (word.front() == '-' || word.front() == '+')) {
    number.negative = word.front() == '-';
    word.remove_prefix(1);
  }
  bool seen_point = false;
  std::size_t i = 0;
  for (; i < word.size() && (is_digit(word[i]) || (word[i] == '.' && !seen_point)); ++i) {
    if (word[i] == '.') {
      seen_point = true;
      continue;
    }
    number.digits.push_back(word[i]);
    if (!seen_point) ++number.point;
  }
  if (number.digits.empty() || number.digits.size() > 64) return std::nullopt;
  if (i == word.size()) return number;
  if (word[i] != 'e' && word[i] != 'E') return std::nullopt;
  std::string_view exponent_text = word.substr(i + 1);
  if (!exponent_text.empty() && exponent_text.front() == '+') exponent_text.remove_prefix(1);
  int exponent = 0;
  const auto [end, error] =
      std::from_chars(exponent_text.data(), exponent_text.data() + exponent_text.size(), exponent);
  if (error != std::errc{} || end != exponent_text.data() + exponent_text.size() ||
      std::abs(exponent) > 40) {
    return std::nullopt;
  }
  number.point += exponent;
  // An exponent form says nothing about decimals: keep those that carry information.
  while (number.digits.size() > 1 && number.digits.back() == '0') number.digits.pop_back();
  return number;
}

bool is_utf16(std::string_view bytes) {
  if (bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF")) return true;
  constexpr std::size_t kLooked = 64;
  // Latin letters and digits: every other byte is zero.
  std::array<std::size_t, 2> zeros{};
  const std::string_view begin = bytes.substr(0, kLooked);
  for (std::size_t i = 0; i < begin.size(); ++i) zeros[i % 2] += begin[i] == '\0' ? 1 : 0;
  return begin.size() >= 4 && std::min(zeros[0], zeros[1]) == 0 &&
         3 * std::max(zeros[0], zeros[1]) >= begin.size();
}

}  // namespace

Result<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes) {
  std::error_code code;
  const auto status = std::filesystem::status(path, code);
  if (!std::filesystem::exists(status)) {
    return Error{ErrorKind::kInput, path.string() + ": no such file"};
  }
  if (!std::filesystem::is_regular_file(status)) {
    return Error{ErrorKind::kInput, path.string() + ": not a regular file"};
  }
  const std::uintmax_t size = std::filesystem::file_size(path, code);
  if (code) return Error{ErrorKind::kInput, path.string() + ": " + code.message()};
  const auto too_large = [&](std::uintmax_t bytes) {
    return Error{ErrorKind::kInput,
                 path.string() + ": too large (" + std::to_string(bytes) + " bytes)"};
  };
  if (size > max_bytes) return too_large(size);
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string content;
  // A byte more than there should be: a file may have grown, and some have no size to tell.
  for (std::size_t more = static_cast<std::size_t>(size) + 1; file; more = content.size() + 1) {
    const std::size_t before = content.size();
    content.resize(before + more);
    file.read(content.data() + before, static_cast<std::streamsize>(more));
    content.resize(before + static_cast<std::size_t>(file.gcount()));
    if (content.size() > max_bytes) return too_large(content.size());
  }
  if (!file.is_open() || file.bad() || content.size() < size) {
    return Error{ErrorKind::kInput,
                 path.string() + ": cannot be read" +
                     (errno != 0 ? std::string(": ") + std::strerror(errno) : std::string())};
  }
  return content;
}

std::string no_text_fault(std::string_view bytes) {
  if (is_utf16(bytes)) return "is UTF-16 text; save it as UTF-8";
  using namespace std::string_view_literals;
  constexpr std::array<std::pair<std::string_view, std::string_view>, 15> kKinds = {
      {{"\x93NUMPY"sv, "a NumPy array (numpy.savetxt writes text)"sv},
       {"PK\x03\x04"sv, "a zip archive (.npz?)"sv},
       {"\x80\x03"sv, "a Python pickle"sv},
       {"\x80\x04"sv, "a Python pickle"sv},
       {"\x80\x05"sv, "a Python pickle"sv},
       {"MATLAB 5.0 MAT-file"sv, "a MAT-file"sv},
       {"\x89HDF"sv, "an HDF5 file"sv},
       {"\x89PNG"sv, "a PNG image"sv},
       {"\xFF\xD8\xFF"sv, "a JPEG image"sv},
       {"\x89MCAP"sv, "an MCAP recording"sv},
       {"#ROSBAG"sv, "a ROS 1 bag"sv},
       {"SQLite format 3"sv, "an SQLite database"sv},
       {"%PDF"sv, "a PDF"sv},
       {"\x1F\x8B"sv, "compressed (gzip)"sv},
       {"\x28\xB5\x2F\xFD"sv, "compressed (zstd)"sv}}};
  for (const auto& [begin, kind] : kKinds)
    if (bytes.starts_with(begin)) return "is " + std::string(kind) + ", not text";
  return {};
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::vector<TextLine> data_lines(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  std::vector<TextLine> lines;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    if (!line.empty() && line.front() != '#') lines.push_back({number, line});
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return lines;
}

std::vector<std::string_view> words_of(std::string_view line, std::string_view also) {
  const std::string separators = std::string(kBlank) + std::string(also);
  std::vector<std::string_view> words;
  std::size_t begin = line.find_first_not_of(separators);
  while (begin != std::string_view::npos) {
    const std::size_t end = std::min(line.find_first_of(separators, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(separators, end);
  }
  return words;
}

std::optional<double> parse_number(std::string_view word) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

std::optional<ParsedStamp> parse_stamp(std::string_view word) {
  const auto number = parse_decimal(word);
  if (!number || number->point > 64) return std::nullopt;
  const auto digit_at = [&](int i) {
    return i >= 0 && i < static_cast<int>(number->digits.size())
               ? number->digits[static_cast<std::size_t>(i)] - '0'
               : 0;
  };
  constexpr std::int64_t kMaxSeconds = 9'000'000'000;  // 285 years; 9.2e9 s overflow 64 bits of ns
  std::int64_t ns = 0;
  for (int i = std::min(number->point, 0); i < number->point + 9; ++i) {
    ns = ns * 10 + digit_at(i);
    if (i < number->point ? ns > kMaxSeconds : ns > kMaxSeconds * 1'000'000'000) {
      return std::nullopt;
    }
  }
  if (digit_at(number->point + 9) >= 5) ++ns;
  const int written = static_cast<int>(number->digits.size()) - number->point;
  return ParsedStamp{{number->negative ? -ns : ns}, std::clamp(written, 0, 9)};
}

std::string format_stamp(Timestamp stamp, int decimals) {
  decimals = std::clamp(decimals, 0, 9);
  std::int64_t unit = 1;  // ns per last digit
  for (int i = decimals; i < 9; ++i) unit *= 10;
  const std::int64_t magnitude = stamp.ns < 0 ? -stamp.ns : stamp.ns;
  std::string digits = std::to_string((magnitude + unit / 2) / unit);
  const auto wanted = static_cast<std::size_t>(decimals) + 1;
  if (digits.size() < wanted) digits.insert(0, wanted - digits.size(), '0');
  if (decimals > 0) digits.insert(digits.size() - static_cast<std::size_t>(decimals), 1, '.');
  return stamp.ns < 0 ? "-" + digits : digits;
}

std::string_view nearest_word(std::string_view word, std::span<const std::string_view> candidates) {
  std::string_view best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 2) + 1;
  for (const std::string_view candidate : candidates) {
    const std::size_t distance = edit_distance(word.substr(0, 64), candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

std::string printable(std::string_view text, std::size_t longest) {
  if (text.size() <= longest) return one_line(text);
  std::size_t end = longest;
  const auto is_inside = [&](std::size_t at) {  // of a character
    return (static_cast<unsigned char>(text[at]) & 0xC0U) == 0x80U;
  };
  for (int back = 0; back < 3 && end > 0 && is_inside(end); ++back) --end;
  return one_line(text.substr(0, end)) + "...";
}

}  // namespace ygslam
