// `ygslam inspect`, the telling: pictures, JSON, and a table for people.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "app/inspect_run.hpp"

namespace ygslam {

/// One picture per frame, the checks side by side, and one of all: a row per check, as in the
/// paper. @param checks at least one. @return kOutput.
[[nodiscard]] Status write_pictures(const std::filesystem::path& out,
                                    const std::vector<Check>& checks);
/// tracks.txt and tracks_truth.txt of the full system, in MOTChallenge's format. @return kOutput.
[[nodiscard]] Status write_tracks(const std::filesystem::path& out,
                                  const std::vector<Check>& checks);
/// As inspect.json has it; scores only where there is a truth.
[[nodiscard]] nlohmann::ordered_json checks_json(const std::vector<Check>& checks, bool has_truth);
/// The same on stdout, a line per check.
void print_checks(const std::vector<Check>& checks, bool has_truth);

}  // namespace ygslam
