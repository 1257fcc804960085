// The 80 classes of Microsoft COCO, as networks trained on it number them.
#pragma once

#include <string>
#include <vector>

namespace ygslam {

/// In the order of a network's outputs; index 0 is "person".
[[nodiscard]] const std::vector<std::string>& coco_class_names();
/// "unknown" for a class that is none of them.
[[nodiscard]] std::string coco_class_name(int class_id);

}  // namespace ygslam
