#include "bag/bag_choice.hpp"

#include "io/text.hpp"

namespace ygslam {

Result<BagChoice> choose(const BagContent& content, const BagTopics& topics,
                         const std::optional<CameraConfig>& camera) {
  const auto colour = choose_topic(content, topics.rgb, "colour", "--rgb-topic");
  if (!colour.ok()) return colour.error();
  const auto depth = choose_topic(content, topics.depth, "depth", "--depth-topic");
  if (!depth.ok()) return depth.error();
  if (camera) return BagChoice{*colour, *depth, *camera, "given camera", false};
  const auto found = camera_of(content, **colour);
  if (!found.ok()) return found.error();
  if (!found.value())
    return Error{ErrorKind::kConfig, "no CameraInfo is in it; give --camera FILE.yaml"};
  const std::string& topic = found.value()->topic;
  return BagChoice{*colour, *depth, found.value()->camera, "CameraInfo of " + printable(topic),
                   content.changed_cameras.contains(topic)};
}

void warn_of_choice(const BagChoice& choice, Sequence& sequence) {
  if (choice.camera_changes)
    sequence.warnings.push_back(sequence.root.string() + ": " + choice.camera_source +
                                " changes; what it said first is taken");
  const std::string& colour = choice.colour->frame_id;
  const std::string& depth = choice.depth->frame_id;
  if (colour.empty() || depth.empty() || colour == depth) return;
  sequence.warnings.push_back(sequence.root.string() + ": depth is of frame '" + printable(depth) +
                              "', colour of '" + printable(colour) +
                              "': depth must be registered to colour");
}

}  // namespace ygslam
