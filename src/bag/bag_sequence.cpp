#include "bag/bag_sequence.hpp"

#include "bag/bag_choice.hpp"
#include "io/sequence_parts.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

Error in_bag(const Sequence& sequence, const Error& error) {
  return {error.kind, sequence.root.string() + ": " + error.message};
}

void warn(Sequence& sequence, const std::string& what) {
  sequence.warnings.push_back(sequence.root.string() + ": " + what);
}

/// Lists the images of both topics and pairs them.
Status pair_topics(std::unique_ptr<Bag> bag, const BagChoice& choice, Sequence& sequence) {
  warn_of_choice(choice, sequence);
  auto images = std::make_shared<BagImages>(std::move(bag));
  const auto colours = images->list(*choice.colour, sequence.counts);
  const auto depths = images->list(*choice.depth, sequence.counts);
  sequence.images = std::move(images);
  for (const auto& [listed, topic] :
       {std::pair(&colours, choice.colour), std::pair(&depths, choice.depth)})
    if (listed->empty())
      return in_bag(sequence, {ErrorKind::kInput, "no image of " + printable(topic->topic.name) +
                                                      " has a stamp that is not negative"});
  if (const std::size_t left_out = sequence.counts.left_out(); left_out > 0)
    warn(sequence, std::to_string(left_out) + " of " + std::to_string(sequence.counts.lines) +
                       " images are left out: the stamp of another, or a negative one");
  return pair_images(colours, depths, sequence);
}

}  // namespace

Result<Sequence> open_bag_sequence(const std::filesystem::path& path, const BagTopics& topics,
                                   const GivenCameras& cameras,
                                   const std::function<bool()>& interrupted) {
  auto bag = open_bag(path);
  if (!bag.ok()) return bag.error();
  Sequence sequence;
  sequence.root = path;
  const auto content = read_content(**bag, interrupted);
  if (!content.ok()) return content.error();
  sequence.warnings = (*bag)->warnings();
  if (content->too_many > 0)
    warn(sequence, std::to_string(content->too_many) + " images are left out: too many");
  const auto choice = choose(*content, topics, cameras);
  if (!choice.ok()) return in_bag(sequence, choice.error());
  sequence.camera_source = choice->camera_source;
  Status paired = pair_topics(std::move(*bag), *choice, sequence);
  if (!paired.ok()) return paired.error();
  Status completed = complete_sequence(choice->camera, sequence);
  if (!completed.ok()) return completed.error();
  if (choice->depth_camera) {
    Status placed = set_depth_camera(*choice->depth_camera, choice->depth_camera_source, sequence);
    if (!placed.ok()) return in_bag(sequence, placed.error());
  }
  return sequence;
}

}  // namespace ygslam
