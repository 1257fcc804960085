// Text of other origin (names of files and topics, words of files, what other programs said) made
// safe to be shown: nothing in it steers a terminal, hides, or turns the order of what stands
// there.
#pragma once

#include <string>
#include <string_view>

namespace ygslam {

/// On one line. Control characters (C0, C1), those that set the direction of writing or cannot be
/// seen, and bytes that are no UTF-8 become escapes: \n, \x1b, \u009b, \u202e, \xff. All else
/// stays.
[[nodiscard]] std::string one_line(std::string_view text);
/// The same of a text of several lines: its line ends stay.
[[nodiscard]] std::string several_lines(std::string_view text);

}  // namespace ygslam
