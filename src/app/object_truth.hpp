// The true things of a rendered world, as `simulate --truth` writes them.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"
#include "eval/object_score.hpp"

namespace ygslam {

/// A time at which a thing stood still.
struct TruePlace {
  UprightBox box;
  Timestamp from, until;
  int frames = 0;  ///< that showed it there
};

struct TrueThing {
  std::string class_name;
  bool is_group = false;
  std::vector<TruePlace> places;  ///< in the order of time
};

/// @param name for messages. @return kInput naming file and fault.
[[nodiscard]] Result<std::vector<TrueThing>> parse_true_objects(std::string_view text,
                                                                const std::string& name);

/// Those that stand still at the end.
[[nodiscard]] std::vector<TrueObject> standing_at_end(const std::vector<TrueThing>& things);

}  // namespace ygslam
