#include "bag/bag_sequence.hpp"

#include <algorithm>

#include "bag/bag_choice.hpp"
#include "bag/bag_order.hpp"
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

/// "/device_0/sensor_1/Color_0/image/data": images as the SDK writes them lack what says how far
/// depth is, and where its camera is, so that their topics cannot be used as those of ROS.
bool is_of_realsense_sdk(const Bag& bag) {
  return std::ranges::any_of(bag.topics(), [](const BagTopic& topic) {
    return topic.name.starts_with("/device_") && topic.name.find("/sensor_") != std::string::npos;
  });
}

/// Without those whose stamps cannot be right. @return what pair_images() takes.
std::vector<ListedImage> in_time(const std::vector<ListedImage>& listed, const TopicOrder& order,
                                 ListCounts& counts) {
  std::vector<ListedImage> kept;
  counts.lines += listed.size();
  for (std::size_t i = 0; i < listed.size(); ++i) {
    if (listed[i].stamp.ns < 0)
      ++counts.negative;
    else if (order.is_far[i])
      ++counts.jumped;
    else
      kept.push_back(listed[i]);
  }
  return in_time_order(std::move(kept), counts);
}

void warn_of_clock(const ImageTopic& topic, const TopicOrder& order, Sequence& sequence) {
  if (!order.back) return;
  const Timestamp back = topic.images[order.back->number].stamp;
  const std::string image = listed_image(topic.topic, back, order.back->number).file;
  warn(sequence, image + ": stamps go back by " + std::to_string(-order.back->ns / 1'000'000'000) +
                     " s here and stay there" +
                     (order.is_mixed ? "; what follows is counted on from those before"
                                     : "; images are used in order of their stamps"));
}

/// Lists the images of both topics and pairs them.
Status pair_topics(std::unique_ptr<Bag> bag, const BagChoice& choice, Sequence& sequence) {
  warn_of_choice(choice, sequence);
  auto images = std::make_shared<BagImages>(std::move(bag));
  const auto all_colours = images->add(*choice.colour);
  const auto all_depths = images->add(*choice.depth);
  sequence.images = std::move(images);
  const TopicOrder colour_order = order_of(*choice.colour);
  const TopicOrder depth_order = order_of(*choice.depth);
  warn_of_clock(*choice.colour, colour_order, sequence);
  if (colour_order.is_mixed && depth_order.is_mixed) {
    sequence.without_depth =
        pair_as_recorded(*choice.colour, all_colours, *choice.depth, all_depths, sequence.pairs);
    if (!sequence.pairs.empty()) return Ok{};
  }
  const auto colours = in_time(all_colours, colour_order, sequence.counts);
  const auto depths = in_time(all_depths, depth_order, sequence.counts);
  for (const auto& [listed, topic] :
       {std::pair(&colours, choice.colour), std::pair(&depths, choice.depth)})
    if (listed->empty())
      return in_bag(sequence, {ErrorKind::kInput, "no image of " + printable(topic->topic.name) +
                                                      " has a stamp that is not negative"});
  if (const std::size_t left_out = sequence.counts.left_out(); left_out > 0)
    warn(sequence, std::to_string(left_out) + " of " + std::to_string(sequence.counts.lines) +
                       " images are left out: the stamp of another, a negative one, or one far "
                       "from the others");
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
  const auto is_sdks = [&] { return !cameras.colour && is_of_realsense_sdk(**bag); };
  // Its topics come with the first messages: no more is read then.
  const auto content =
      read_content(**bag, [&] { return is_sdks() || (interrupted && interrupted()); });
  if (is_sdks())
    return in_bag(sequence, {ErrorKind::kInput,
                             "a recording of the RealSense SDK; tools/convert_recording.py makes "
                             "an MCAP recording of it (docs/inputs.md)"});
  if (!content.ok()) return content.error();
  sequence.warnings = (*bag)->warnings();
  if (content->too_many > 0)
    warn(sequence, std::to_string(content->too_many) + " images are left out: too many");
  const auto choice = choose(*content, topics, cameras);
  if (!choice.ok()) return in_bag(sequence, choice.error());
  content->motion.list((*bag)->topics(), content->frames, choice->colour->frame_id, sequence);
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
