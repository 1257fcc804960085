// The scores of a tracker of things as JSON and as a table for people.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "eval/tracking_score.hpp"

namespace ygslam {

[[nodiscard]] nlohmann::ordered_json to_json(const TrackingScore& score);
/// A few lines of text: the scores, then each true thing.
[[nodiscard]] std::string format_tracking(const TrackingScore& score);

}  // namespace ygslam
