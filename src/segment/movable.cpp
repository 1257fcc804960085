#include "segment/movable.hpp"

#include <algorithm>
#include <set>
#include <string_view>

#include "core/edit_distance.hpp"

namespace ygslam {
namespace {

struct Group {
  std::string_view name;
  std::vector<int> classes;
};

/// COCO ids by what they are.
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

Result<std::vector<int>> movable_classes(std::span<const std::string> names) {
  const auto& coco = coco_class_names();
  std::set<int> ids;
  for (const std::string& name : names) {
    const auto group = std::find_if(groups().begin(), groups().end(),
                                    [&](const Group& g) { return g.name == name; });
    const auto single = std::find(coco.begin(), coco.end(), name);
    if (group != groups().end()) {
      ids.insert(group->classes.begin(), group->classes.end());
    } else if (single != coco.end()) {
      ids.insert(static_cast<int>(single - coco.begin()));
    } else {
      return Error{ErrorKind::kConfig, "unknown class '" + name.substr(0, 60) +
                                           "'; did you mean '" + nearest_name(name.substr(0, 60)) +
                                           "'?"};
    }
  }
  return std::vector<int>(ids.begin(), ids.end());
}

std::vector<int> living_classes() {
  std::vector<int> classes{0};
  const std::vector<int>& animals = groups().front().classes;
  classes.insert(classes.end(), animals.begin(), animals.end());
  return classes;
}

std::vector<int> with_living_classes(std::span<const int> movable) {
  std::vector<int> classes = living_classes();
  classes.insert(classes.end(), movable.begin(), movable.end());
  return classes;
}

std::array<std::uint8_t, 256> movable_ids(const Segmentation& segmentation,
                                          std::span<const int> classes) {
  std::array<std::uint8_t, 256> movable{};
  for (std::size_t i = 0; i < segmentation.instances.size() && i + 1 < movable.size(); ++i) {
    const int class_id = segmentation.instances[i].class_id;
    if (std::find(classes.begin(), classes.end(), class_id) != classes.end()) movable[i + 1] = 1;
  }
  return movable;
}

GreyImage movable_mask(const Segmentation& segmentation, std::span<const int> classes) {
  const auto movable = movable_ids(segmentation, classes);
  GreyImage mask(segmentation.ids.width(), segmentation.ids.height());
  std::transform(segmentation.ids.begin(), segmentation.ids.end(), mask.begin(),
                 [&](std::uint8_t id) { return static_cast<std::uint8_t>(255 * movable[id]); });
  return mask;
}

}  // namespace ygslam
