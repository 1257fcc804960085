#include "core/printable.hpp"

#include <array>
#include <cstdint>
#include <cstdio>
#include <utility>

namespace ygslam {
namespace {

struct Character {
  std::uint32_t code = 0;
  std::size_t bytes = 0;  ///< 0: not UTF-8
};

constexpr bool is_continuation(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U;
}

/// The first character (RFC 3629: no longer than need be, no half of a pair, none beyond the last).
Character first_character(std::string_view text) {
  constexpr std::array<std::uint32_t, 5> kLeast{0, 0, 0x80, 0x800, 0x10000};
  const auto lead = static_cast<unsigned char>(text.front());
  if (lead < 0x80) return {lead, 1};
  const std::size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < bytes) return {};
  std::uint32_t code = lead & (0xFFU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) {
    if (!is_continuation(text[i])) return {};
    code = code << 6U | (static_cast<unsigned char>(text[i]) & 0x3FU);
  }
  const bool is_half = code >= 0xD800 && code <= 0xDFFF;
  if (code < kLeast[bytes] || code > 0x10FFFF || is_half) return {};
  return {code, bytes};
}

/// What no reader sees as it is.
bool is_unsafe(std::uint32_t code) {
  constexpr std::array<std::pair<std::uint32_t, std::uint32_t>, 10> kUnsafe{{
      {0x00, 0x1F},        // C0
      {0x7F, 0x9F},        // delete, C1
      {0x061C, 0x061C},    // Arabic letter mark
      {0x200B, 0x200B},    // zero width space
      {0x200E, 0x200F},    // left-to-right mark, right-to-left mark
      {0x2028, 0x202E},    // line and paragraph ends; embeddings and overrides of direction
      {0x2060, 0x206F},    // word joiner; isolates of direction
      {0xFEFF, 0xFEFF},    // byte order mark
      {0xFFF9, 0xFFFB},    // annotations
      {0xE0000, 0xE007F},  // tags
  }};
  for (const auto& [first, last] : kUnsafe)
    if (code >= first && code <= last) return true;
  return false;
}

void append_escape(std::string& to, std::uint32_t code) {
  std::array<char, 16> escape{};
  const char* format = code < 0x80 ? "\\x%02x" : code < 0x10000 ? "\\u%04x" : "\\U%08x";
  if (code == '\n') format = "\\n";
  if (code == '\r') format = "\\r";
  if (code == '\t') format = "\\t";
  std::snprintf(escape.data(), escape.size(), format, code);
  to += escape.data();
}

std::string escaped(std::string_view text, std::string_view kept) {
  std::string safe;
  safe.reserve(text.size());
  while (!text.empty()) {
    const Character next = first_character(text);
    const std::size_t bytes = next.bytes == 0 ? 1 : next.bytes;
    if (next.bytes == 0) {
      std::array<char, 8> escape{};
      std::snprintf(escape.data(), escape.size(), "\\x%02x",
                    static_cast<unsigned>(static_cast<unsigned char>(text.front())));
      safe += escape.data();
    } else if (is_unsafe(next.code) && kept.find(text.front()) == kept.npos) {
      append_escape(safe, next.code);
    } else {
      safe += text.substr(0, bytes);
    }
    text.remove_prefix(bytes);
  }
  return safe;
}

}  // namespace

std::string one_line(std::string_view text) { return escaped(text, ""); }

std::string several_lines(std::string_view text) { return escaped(text, "\n"); }

}  // namespace ygslam
