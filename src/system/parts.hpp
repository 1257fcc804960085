// Parts of the system that can be left out (`run.without`), to see what each is worth.
#pragma once

#include <string>

#include "core/result.hpp"
#include "system/slam_config.hpp"

namespace ygslam {

/// "name, name, ...".
[[nodiscard]] std::string part_names();
/// kConfig if there is no such part.
[[nodiscard]] Status leave_out(const std::string& part, SlamConfig& config);

}  // namespace ygslam
