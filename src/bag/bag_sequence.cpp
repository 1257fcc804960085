#include "bag/bag_sequence.hpp"

#include "bag/bag_choice.hpp"
#include "io/sequence_parts.hpp"

namespace ygslam {
namespace {

/// Lists the images of both topics and pairs them.
Status pair_topics(std::unique_ptr<Bag> bag, const BagChoice& choice, Sequence& sequence) {
  warn_of_frames(choice, sequence);
  auto images = std::make_shared<BagImages>(std::move(bag));
  const auto colours = images->list(*choice.colour, sequence.counts);
  const auto depths = images->list(*choice.depth, sequence.counts);
  sequence.images = std::move(images);
  if (const std::size_t left_out = sequence.counts.left_out(); left_out > 0)
    sequence.warnings.push_back(sequence.root.string() + ": " + std::to_string(left_out) + " of " +
                                std::to_string(sequence.counts.lines) +
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
  const auto choice = choose(*content, topics, camera);
  if (!choice.ok())
    return Error{choice.error().kind, path.string() + ": " + choice.error().message};
  sequence.camera_source = choice->camera_source;
  Status paired = pair_topics(std::move(*bag), *choice, sequence);
  if (!paired.ok()) return paired.error();
  Status completed = complete_sequence(choice->camera, sequence);
  if (!completed.ok()) return completed.error();
  return sequence;
}

}  // namespace ygslam
