// JSON from files of unknown origin: depth-limited (a deeply nested document crashes dump()).
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace ygslam {

inline constexpr int kMaxJsonDepth = 64;

/// @param name for messages. @return kInput: nested deeper than kMaxJsonDepth, or no JSON (with the
/// byte where it ends to be).
[[nodiscard]] Result<nlohmann::json> parse_json(std::string_view text, const std::string& name);
[[nodiscard]] Result<nlohmann::json> read_json(const std::filesystem::path& path);

}  // namespace ygslam
