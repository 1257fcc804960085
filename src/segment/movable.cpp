#include "segment/movable.hpp"

#include <algorithm>
#include <string_view>

#include "core/edit_distance.hpp"

namespace ygslam {
namespace {

struct Group {
  std::string_view name;
  std::vector<int> classes;
};

/// COCO ids by what they are, ascending; animals come first.
const std::vector<Group>& groups() {
  static const std::vector<Group> kGroups{
      {"animals", {14, 15, 16, 17, 18, 19, 20, 21, 22, 23}},
      {"vehicles", {1, 2, 3, 4, 5, 6, 7, 8}},
      {"handheld",
       {24, 25, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39, 40, 41, 42, 43, 44,
        45, 46, 47, 48, 49, 50, 51, 52, 53, 54, 55, 63, 64, 65, 66, 67, 73, 76, 77, 78, 79}},
      {"furniture", {13, 56, 57, 58, 59, 60}},
  };
  return kGroups;
}

std::string nearest_name(std::string_view name) {
  std::vector<std::string> known = coco_class_names();
  for (const Group& group : groups()) known.emplace_back(group.name);
  return *std::min_element(known.begin(), known.end(), [&](const auto& a, const auto& b) {
    return edit_distance(name, a) < edit_distance(name, b);
  });
}

}  // namespace

MovableClasses::MovableClasses(std::vector<int> named) : named_(std::move(named)) {
  std::sort(named_.begin(), named_.end());
  named_.erase(std::unique(named_.begin(), named_.end()), named_.end());
}

Result<MovableClasses> MovableClasses::of_names(std::span<const std::string> names) {
  const auto& coco = coco_class_names();
  std::vector<int> ids;
  for (const std::string& name : names) {
    const auto group = std::find_if(groups().begin(), groups().end(),
                                    [&](const Group& g) { return g.name == name; });
    const auto single = std::find(coco.begin(), coco.end(), name);
    if (group != groups().end()) {
      ids.insert(ids.end(), group->classes.begin(), group->classes.end());
    } else if (single != coco.end()) {
      ids.push_back(static_cast<int>(single - coco.begin()));
    } else {
      return Error{ErrorKind::kConfig, "unknown class '" + name.substr(0, 60) +
                                           "'; did you mean '" + nearest_name(name.substr(0, 60)) +
                                           "'?"};
    }
  }
  return MovableClasses(std::move(ids));
}

bool MovableClasses::contains(int class_id) const {
  constexpr int kPerson = 0;
  const std::vector<int>& animals = groups().front().classes;
  return class_id == kPerson || std::binary_search(animals.begin(), animals.end(), class_id) ||
         std::binary_search(named_.begin(), named_.end(), class_id);
}

std::array<std::uint8_t, 256> movable_ids(const Segmentation& segmentation,
                                          const MovableClasses& classes) {
  std::array<std::uint8_t, 256> movable{};
  for (std::size_t i = 0; i < segmentation.instances.size() && i + 1 < movable.size(); ++i)
    movable[i + 1] = classes.contains(segmentation.instances[i].class_id) ? 1 : 0;
  return movable;
}

GreyImage movable_mask(const Segmentation& segmentation, const MovableClasses& classes) {
  const auto movable = movable_ids(segmentation, classes);
  GreyImage mask(segmentation.ids.width(), segmentation.ids.height());
  std::transform(segmentation.ids.begin(), segmentation.ids.end(), mask.begin(),
                 [&](std::uint8_t id) { return static_cast<std::uint8_t>(255 * movable[id]); });
  return mask;
}

}  // namespace ygslam
