// Standard input, output and error as others hand them over: closed, full, or with nobody at the
// other end any more. None of these costs a run its results.
#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

#include "core/printable.hpp"

namespace ygslam {

/// A command whose product goes to standard output and whose reader left: as shells tell of
/// programs that this ends (128 + SIGPIPE).
inline constexpr int kExitReaderLeft = 141;

/// To be called before anything is opened. Standard streams that are closed stay useless, but their
/// numbers are taken, so that no file of ours gets them; a reader that leaves is no signal.
void settle_standard_streams();

/// Text for standard output. What comes from others in it (names, words of files) is shown as
/// several_lines() has it.
void print_text(std::string_view text);
template <typename First, typename... Others>
void print_text(fmt::format_string<First, Others...> format, First&& first, Others&&... others) {
  print_text(fmt::format(format, std::forward<First>(first), std::forward<Others>(others)...));
}

/// Writes what standard output still has to take.
/// @param is_product else what was told there is dropped where nobody reads it.
/// @return code, or what became of the product where code is 0.
[[nodiscard]] int finish_standard_output(int code, bool is_product);

}  // namespace ygslam
