// Checks of options' values that say in few words what was wrong.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>

namespace ygslam {

/// A number within bounds. In place of CLI::Range, which writes a bound with up to 309 digits and
/// itself into the help.
template <typename T>
[[nodiscard]] CLI::Validator in_range(T least, T most) {
  const auto check = [least, most](const std::string& text) {
    T value{};
    const bool is_number = CLI::detail::lexical_cast(text, value);
    return is_number && value >= least && value <= most
               ? std::string()
               : fmt::format("{} is not in {} .. {}", text, least, most);
  };
  return CLI::Validator(check, "");
}

}  // namespace ygslam
