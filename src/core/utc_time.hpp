#pragma once

#include <string>

namespace ygslam {

/// The clock on the wall, for files to tell when they were made: "2024-01-31T12:34:56Z".
[[nodiscard]] std::string utc_time_now();

}  // namespace ygslam
