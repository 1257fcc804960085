// What the digits in the names of a folder's images say of time, decided by all names together.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"

namespace ygslam {

struct NameTimes {
  std::vector<std::optional<Timestamp>> stamps;  ///< of each name; nothing: of another form
  int decimals = 6;                              ///< of seconds that the names are good for
  bool is_frames = true;                         ///< numbers of frames at 30 Hz, else times
  std::string taken_as;  ///< "seconds and nanoseconds", "numbers of frames at 30 Hz", ...
};

/// Names of one form (the same but for their digits) are compared: groups of digits that are the
/// same in all say nothing (640x480). Times are numbers of seconds with a fraction, or of milli-,
/// micro- or nanoseconds, as regular as a camera's at 1 to 240 Hz (those since 1970 at any lower
/// rate, too); a group that counts is a number of frames. Further groups must rise with the time.
/// @param stems names without extension, all different. @return kInput without a place: two names,
/// what differs in them, and why this is not clear.
[[nodiscard]] Result<NameTimes> times_of_names(std::span<const std::string> stems);

}  // namespace ygslam
