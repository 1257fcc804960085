// Reading small text files line by line, the same in every locale.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"

namespace ygslam {

/// The whole content of a regular file (no pipes or devices: they could block for ever).
/// @return kInput naming path and cause; also if the file is larger than max_bytes.
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& path,
                                            std::size_t max_bytes = std::size_t{256} << 20);

/// What is wrong with a file that should be text, by how it begins: UTF-16 (as some editors write
/// it), a NumPy array, an image, a recording, an archive. Empty where it may be text.
[[nodiscard]] std::string no_text_fault(std::string_view bytes);

struct TextLine {
  int number = 0;  ///< 1 = first line of the file
  std::string_view text;
};
/// Lines that carry data: without comments (`#` as first character), blank lines, surrounding
/// space, carriage returns and a UTF-8 byte order mark. The views point into `text`.
[[nodiscard]] std::vector<TextLine> data_lines(std::string_view text);

[[nodiscard]] std::string_view trimmed(std::string_view text);
/// Words separated by spaces, tabs or any character of `also`.
[[nodiscard]] std::vector<std::string_view> words_of(std::string_view line,
                                                     std::string_view also = {});

/// The whole word as a finite number with '.' as decimal point; nullopt otherwise.
[[nodiscard]] std::optional<double> parse_number(std::string_view word);

/// A stamp in seconds, and how it was written.
struct ParsedStamp {
  Timestamp stamp;
  int decimals = 0;  ///< digits after the point, at most 9
};
/// Seconds as decimal text (an exponent is allowed), converted without rounding through double.
/// @return nullopt for anything that is no finite number or does not fit 64-bit nanoseconds.
[[nodiscard]] std::optional<ParsedStamp> parse_stamp(std::string_view word);
/// Inverse of parse_stamp: seconds with exactly `decimals` (0 to 9) digits after the point.
[[nodiscard]] std::string format_stamp(Timestamp stamp, int decimals);

/// The candidate with the smallest edit distance to `word`, for "did you mean"; empty if none is
/// near.
[[nodiscard]] std::string_view nearest_word(std::string_view word,
                                            std::span<const std::string_view> candidates);

/// A word of other origin within a message: one_line() of at most its first `longest` bytes.
[[nodiscard]] std::string printable(std::string_view text, std::size_t longest = 80);

}  // namespace ygslam
