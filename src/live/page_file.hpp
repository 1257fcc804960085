// The files of the live page, built into the program.
#pragma once

#include <optional>
#include <string_view>

namespace ygslam {

/// @param name e.g. "index.html". @return nullopt if there is none of that name.
[[nodiscard]] std::optional<std::string_view> page_file(std::string_view name);

}  // namespace ygslam
