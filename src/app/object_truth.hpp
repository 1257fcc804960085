// The true things of a rendered world, as `simulate --truth` writes them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "eval/change_score.hpp"

namespace ygslam {

/// @param name for messages. @return kInput naming file and fault.
[[nodiscard]] Result<std::vector<TrueThing>> parse_true_objects(std::string_view text,
                                                                const std::string& name);

}  // namespace ygslam
