// The text lists of a TUM-layout sequence: rgb.txt, depth.txt, associations.txt.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/time.hpp"
#include "io/clock_resets.hpp"

namespace ygslam {

/// What was left out of a list, and why. A sum of zeros means a perfect list.
struct ListCounts {
  std::size_t lines = 0;      ///< lines with data
  std::size_t malformed = 0;  ///< no stamp (NaN, text) or no path
  std::size_t refused = 0;    ///< path absolute or with `..`
  std::size_t negative = 0;   ///< stamp below zero
  std::size_t doubled = 0;    ///< stamp of another line
  std::size_t jumped = 0;     ///< stamp far ahead, after which the lines go back
  std::size_t moved = 0;      ///< older than a line before: sorted, not left out

  [[nodiscard]] std::size_t left_out() const {
    return malformed + refused + negative + doubled + jumped;
  }
  ListCounts& operator+=(const ListCounts& other);
  /// "3 of 100 lines left out: 2 malformed, 1 with the stamp of another line"; empty if nothing was
  /// left out.
  [[nodiscard]] std::string summary() const;
};

struct ListedImage {
  Timestamp stamp;
  int decimals = 0;  ///< of the stamp as written
  std::string file;  ///< relative to the sequence's folder
};

struct ListedPair {
  ListedImage colour, depth;
};

template <typename Entry>
struct ParsedList {
  std::vector<Entry> entries;      ///< colour stamps (of a pair) strictly increasing, not negative;
                                   ///< lines in another order are sorted
  std::vector<ClockReset> resets;  ///< by place in entries, whose stamps are shifted
  ListCounts counts;
  std::string first_fault;  ///< "line 7: ...", for the message
};

/// Lines `stamp path`; the path may contain spaces.
[[nodiscard]] ParsedList<ListedImage> parse_image_list(std::string_view text);
/// Lines `colour_stamp colour_path depth_stamp depth_path`, or depth first where the paths say so
/// (depth/..., rgb/...). A pose in the line is passed over (associated_poses.hpp).
[[nodiscard]] ParsedList<ListedPair> parse_associations(std::string_view text);

/// Shifts both by the same after each reset, so that their images can be paired.
/// @return false if their clocks were not set equally often.
[[nodiscard]] bool align_resets(ParsedList<ListedImage>& colour, ParsedList<ListedImage>& depth);

/// In order of time; of several with one stamp the first. Counts those that are left out.
[[nodiscard]] std::vector<ListedImage> in_time_order(std::vector<ListedImage> images,
                                                     ListCounts& counts);

/// True for a relative path that stays inside its folder.
[[nodiscard]] bool is_inside(std::string_view relative_path);

}  // namespace ygslam
