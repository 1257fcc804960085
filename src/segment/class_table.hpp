// Which of COCO's 80 classes the classes of a network are.
#pragma once

#include <array>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace ygslam {

inline constexpr int kCocoClasses = 80;  ///< of scene/coco.hpp
inline constexpr int kNoCocoClass = -1;

/// Of COCO's classes, which are in.
using ClassSet = std::array<bool, kCocoClasses>;
/// Per class of a network its number in scene/coco.hpp, or kNoCocoClass.
using ClassTable = std::vector<int>;
/// Number of a network's class to its name.
using ClassNames = std::map<int, std::string>;

/// The 80 classes without gaps, as Ultralytics and MMDetection number them.
[[nodiscard]] ClassTable coco_table();
/// Numbers 0 to 90 of COCO's own annotations, which leave eleven out (0 among them).
[[nodiscard]] ClassTable coco_annotation_table();

/// The text of a Python dictionary of number to name, as Ultralytics' exports carry it under
/// "names". @return what could be read of it; empty if it is none.
[[nodiscard]] ClassNames parse_python_names(std::string_view text);
/// "class_id_to_name" of the JSON text that exports of rfdetr carry under "rfdetr_inference".
[[nodiscard]] ClassNames parse_rfdetr_names(std::string_view text);

/// @param classes how many the network has, 0 if its outputs do not tell.
/// @param names what its file says of them, empty if nothing.
/// @return a table of at least one COCO class, or why there is none.
[[nodiscard]] Result<ClassTable> make_class_table(int classes, const ClassNames& names);

}  // namespace ygslam
