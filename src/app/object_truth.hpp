// The true things of a rendered world, as `simulate --truth` writes them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "eval/change_score.hpp"

namespace ygslam {

struct TrueThings {
  std::vector<TrueThing> named;
  std::vector<TrueThing> nameless;  ///< no network knows their class, and they were moved
  [[nodiscard]] std::vector<TrueThing> all() const;
};

/// @param name for messages. @return kInput naming file and fault.
[[nodiscard]] Result<TrueThings> parse_true_objects(std::string_view text, const std::string& name);

}  // namespace ygslam
