// Lists of associated images that have a pose in each line, as `associate.py` of TUM makes them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ygslam {

/// A line of a list of associations without its pose, and the pose.
struct AssociationLine {
  std::string_view images;
  std::vector<std::string_view> pose;  ///< x y z qx qy qz qw, a stamp before it or not; or empty
};
/// A pose may stand behind the images or, with its stamp, before them.
[[nodiscard]] AssociationLine split_association(std::string_view line);

/// The poses of such a list as lines of TUM's format, with the line numbers of the list; poses
/// without stamps get that of the line's first image. @return nothing where not every line names
/// an image and has a pose.
[[nodiscard]] std::optional<std::string> poses_of_associations(std::string_view text);

}  // namespace ygslam
