#include "bag/bag_choice.hpp"

#include "io/text.hpp"

namespace ygslam {

Result<BagChoice> choose(const BagContent& content, const BagTopics& topics,
                         const GivenCameras& cameras) {
  const auto colour = choose_topic(content, topics.rgb, "colour", "--rgb-topic");
  if (!colour.ok()) return colour.error();
  const auto depth = choose_topic(content, topics.depth, "depth", "--depth-topic");
  if (!depth.ok()) return depth.error();
  BagChoice choice;
  choice.colour = *colour;
  choice.depth = *depth;
  if (cameras.colour) {
    choice.camera = *cameras.colour;
    choice.camera_source = cameras.colour_source;
  } else {
    const auto found = camera_of(content, **colour);
    if (!found.ok()) return found.error();
    if (!found.value())
      return Error{ErrorKind::kConfig, "no CameraInfo is in it; give --camera FILE.yaml"};
    const std::string& topic = found.value()->topic;
    choice.camera = found.value()->camera;
    choice.camera_source = "CameraInfo of " + printable(topic);
    choice.camera_changes = content.changed_cameras.contains(topic);
  }
  if (cameras.depth) {
    choice.depth_camera = cameras.depth;
    choice.depth_camera_source = cameras.depth_source;
    return choice;
  }
  const auto apart =
      depth_camera_of(content, **colour, **depth, {choice.camera.width, choice.camera.height});
  if (!apart.ok()) return apart.error();
  choice.depth_camera = apart->camera;
  if (apart->camera) choice.depth_camera_source = "CameraInfo of " + printable(apart->topic);
  choice.depth_camera_changes = apart->camera && content.changed_cameras.contains(apart->topic);
  choice.depth_missing = apart->missing;
  return choice;
}

void warn_of_choice(const BagChoice& choice, Sequence& sequence) {
  if (choice.camera_changes)
    sequence.warnings.push_back(sequence.root.string() + ": " + choice.camera_source +
                                " changes; what it said first is taken");
  if (choice.depth_camera_changes)
    sequence.warnings.push_back(sequence.root.string() + ": " + choice.depth_camera_source +
                                " changes; what it said first is taken");
  if (choice.depth_missing.empty()) return;
  sequence.warnings.push_back(
      sequence.root.string() + ": depth is of frame '" + printable(choice.depth->frame_id) +
      "', colour of '" + printable(choice.colour->frame_id) + "', and there is " +
      choice.depth_missing + ": it is taken as registered; else give --depth-camera FILE");
}

}  // namespace ygslam
