// The files of a run that are read later: whether they are what the run left, and make sense.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "benchmark_runs/run_record.hpp"
#include "core/result.hpp"

namespace ygslam {

/// metrics.json of a run.
/// @return kInput naming the file: unreadable, no JSON, or a figure that cannot be: coverage
/// outside of 0 to 1 or missing; an error or a time that is negative or no finite number.
[[nodiscard]] Result<nlohmann::json> read_metrics(const std::filesystem::path& file);

/// The number at a JSON pointer such as "/ate/rmse"; nothing if there is none.
[[nodiscard]] std::optional<double> number_at(const nlohmann::json& json, const char* pointer);

/// Name to fingerprint of those of metrics.json, trajectory.txt and errors.csv that are there.
[[nodiscard]] std::map<std::string, std::string> fingerprints_of(
    const std::filesystem::path& folder);

/// What is wrong with the files of a finished run: "metrics.json: not as the run left it"; nothing
/// if all is well. Where the record has no fingerprints only metrics.json is looked at.
[[nodiscard]] std::optional<std::string> fault_of_files(const std::filesystem::path& folder,
                                                        const RunRecord& record);

}  // namespace ygslam
