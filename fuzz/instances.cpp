#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "segment/recorded_masks.hpp"
#include "segment/segmenter.hpp"

namespace ygslam::fuzz {

void instances(std::string_view bytes) {
  const auto classes = parse_instances(std::string(bytes), "instances.json");
  if (!classes.ok()) return;
  for (const int class_id : *classes)
    CHECK(class_id >= -1 && class_id < std::ssize(coco_class_names()));
}

}  // namespace ygslam::fuzz
