#include "bag/bag_sequence.hpp"

#include "bag/bag_images.hpp"
#include "io/sequence_parts.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

Error in_bag(const Sequence& sequence, const Error& error) {
  return {error.kind, sequence.root.string() + ": " + error.message};
}

Result<CameraConfig> bag_camera(const std::optional<CameraConfig>& given, const BagContent& content,
                                const ImageTopic& colour, Sequence& sequence) {
  if (given) {
    sequence.camera_source = "given camera";
    return *given;
  }
  const auto found = camera_of(content, colour);
  if (!found.ok()) return in_bag(sequence, found.error());
  if (!found.value())
    return in_bag(sequence,
                  {ErrorKind::kConfig, "no CameraInfo is in it; give --camera FILE.yaml"});
  sequence.camera_source = "CameraInfo of " + printable(found.value()->topic);
  return found.value()->camera;
}

void warn(Sequence& sequence, const std::string& what) {
  sequence.warnings.push_back(sequence.root.string() + ": " + what);
}

/// Lists the images of both topics and pairs them.
Status pair_topics(std::unique_ptr<Bag> bag, const ImageTopic& colour, const ImageTopic& depth,
                   Sequence& sequence) {
  if (!colour.frame_id.empty() && !depth.frame_id.empty() && colour.frame_id != depth.frame_id)
    warn(sequence, "depth is of frame '" + printable(depth.frame_id) + "', colour of '" +
                       printable(colour.frame_id) + "': depth must be registered to colour");
  auto images = std::make_shared<BagImages>(std::move(bag));
  const auto colours = images->list(colour, sequence.counts);
  const auto depths = images->list(depth, sequence.counts);
  sequence.images = std::move(images);
  if (const std::size_t left_out = sequence.counts.left_out(); left_out > 0)
    warn(sequence, std::to_string(left_out) + " of " + std::to_string(sequence.counts.lines) +
                       " images are left out: the stamp of another, or a negative one");
  return pair_images(colours, depths, sequence);
}

}  // namespace

Result<Sequence> open_bag_sequence(const std::filesystem::path& path, const BagTopics& topics,
                                   const std::optional<CameraConfig>& camera) {
  auto bag = open_bag(path);
  if (!bag.ok()) return bag.error();
  Sequence sequence;
  sequence.root = path;
  const auto content = read_content(**bag);
  if (!content.ok()) return content.error();
  sequence.warnings = (*bag)->warnings();
  const auto colour = choose_topic(*content, topics.rgb, "colour", "--rgb-topic");
  if (!colour.ok()) return in_bag(sequence, colour.error());
  const auto depth = choose_topic(*content, topics.depth, "depth", "--depth-topic");
  if (!depth.ok()) return in_bag(sequence, depth.error());
  const auto found = bag_camera(camera, *content, **colour, sequence);
  if (!found.ok()) return found.error();
  Status paired = pair_topics(std::move(*bag), **colour, **depth, sequence);
  if (!paired.ok()) return paired.error();
  Status completed = complete_sequence(*found, sequence);
  if (!completed.ok()) return completed.error();
  return sequence;
}

}  // namespace ygslam
