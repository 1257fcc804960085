// What an exception means to a user, for the borders where it is caught.
#pragma once

#include <exception>
#include <string>

namespace ygslam {

/// "out of memory" where that is the reason, else "internal: " and what it says.
[[nodiscard]] std::string describe(const std::exception& failure);

}  // namespace ygslam
