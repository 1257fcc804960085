#include "bag/bag_images.hpp"

#include <algorithm>
#include <cctype>
#include <unordered_map>

#include "io/depth_calibration.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

/// The first field of every message with a header.
struct Stamped {
  ros::Header header;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header);
  }
};

/// Digits after the point without which the stamp would be another; at least as many as TUM's.
int stamp_decimals(Timestamp stamp) {
  constexpr int kLeast = 6;
  int decimals = 9;
  for (std::int64_t ns = stamp.ns; decimals > kLeast && ns % 10 == 0; ns /= 10) --decimals;
  return decimals;
}

std::string joined(const std::vector<const ImageTopic*>& topics) {
  constexpr std::size_t kMost = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(topics.size(), kMost); ++i)
    text += (i == 0 ? "" : ", ") + printable(topics[i]->topic.name) +
            (topics[i]->encoding.empty() ? "" : " ('" + topics[i]->encoding + "')");
  return text + (topics.size() > kMost ? ", ..." : "");
}

/// "; not read: /camera (foxglove.CompressedImage as protobuf)", of many the first.
std::string unread_text(const BagContent& content) {
  constexpr std::size_t kMost = 4;
  std::string text;
  for (std::size_t i = 0; const std::string& topic : content.unread) {
    if (i == kMost) return text + ", ...";
    text += (i++ == 0 ? "; not read: " : ", ") + topic;
  }
  return text;
}

std::string before_last(const std::string& topic) {
  const std::size_t at = topic.rfind('/');
  return at == std::string::npos ? "" : topic.substr(0, at);
}

// A few bytes can unpack to messages without end: 18 hours at 30 Hz are enough for anybody.
constexpr std::size_t kMostImages = 2'000'000;
constexpr std::size_t kMostImagesOfAll = 4 * kMostImages;

bool is_same_camera(const ros::CameraInfo& a, const ros::CameraInfo& b) {
  return a.width == b.width && a.height == b.height && a.k == b.k && a.d == b.d && a.p == b.p;
}

/// Keeps the first of a topic that is calibrated, without the terms that no lens has.
void take_camera(const std::string& topic, ros::CameraInfo& info, BagContent& content) {
  constexpr std::size_t kMostTerms = 16;
  if (info.d.size() > kMostTerms) {
    const bool has_more = std::any_of(info.d.begin() + kMostTerms, info.d.end(),
                                      [](double term) { return term != 0; });
    info.d.resize(kMostTerms);
    info.d.shrink_to_fit();
    if (has_more) info.d.back() = 1;  // which no model that is read has
  }
  for (std::string* text : {&info.distortion_model, &info.header.frame_id})
    *text = cut_name(std::move(*text));
  const auto known = content.cameras.find(topic);
  if (known == content.cameras.end()) {
    content.cameras.emplace(topic, std::move(info));
  } else if (known->second.k[0] == 0 && info.k[0] != 0) {
    known->second = std::move(info);
  } else if (!is_same_camera(known->second, info)) {
    content.changed_cameras.insert(topic);
  }
}

/// Without what the transports of images append.
std::string base_of(const BagTopic& topic) {
  return topic.type == ros::kCompressedType ? before_last(topic.name) : topic.name;
}

}  // namespace

std::optional<std::size_t> ContentReader::take(const BagTopic& topic, const BagMessage& message) {
  content_.has_messages = true;
  if (topic.type == ros::kCameraType) {
    ros::CameraInfo info;
    if (from_cdr(message.bytes, info, topic.layout)) take_camera(topic.name, info, content_);
    return std::nullopt;
  }
  if (has_transforms(topic)) content_.frames.take(topic, message.bytes);
  content_.motion.take(topic, message);
  if (topic.type != ros::kImageType && topic.type != ros::kCompressedType) {
    constexpr std::size_t kMostUnread = 100;
    if (shows_images(topic.type) && content_.unread.size() < kMostUnread)
      content_.unread.insert(printable(topic.name) + " (" + printable(topic.type) + ")");
    return std::nullopt;
  }
  const auto [at, is_new] = place_of_.try_emplace(message.topic, content_.images.size());
  if (is_new) content_.images.emplace_back().topic = topic;
  ImageTopic& images = content_.images[at->second];
  Stamped head;
  if (!from_cdr(message.bytes, head, topic.layout)) return std::nullopt;
  if (images.kind == ros::ImageKind::kOther) {
    images.kind = ros::image_kind(topic, message.bytes).value_or(ros::ImageKind::kOther);
    images.frame_id = cut_name(head.header.frame_id);
    images.encoding = images.kind == ros::ImageKind::kOther
                          ? ros::shown_encoding(topic, message.bytes)
                          : std::string();
  }
  if (images.images.size() >= kMostImages || image_count_ >= kMostImagesOfAll) {
    ++content_.too_many;
    return std::nullopt;
  }
  images.images.push_back({*image_stamp(topic, message), message.place, image_count_++});
  return at->second;
}

Result<BagContent> read_content(Bag& bag, const Bag::Interrupted& interrupted) {
  ContentReader reader;
  const auto visited = bag.visit(
      [&](const BagMessage& message) { reader.take(bag.topics()[message.topic], message); },
      interrupted);
  if (!visited.ok()) return visited.error();
  return reader.content();
}

std::optional<Timestamp> image_stamp(const BagTopic& topic, const BagMessage& message) {
  Stamped head;
  if (!from_cdr(message.bytes, head, topic.layout)) return std::nullopt;
  const Timestamp stamp = ros::from_ros(head.header.stamp);
  return stamp.ns == 0 ? message.logged : stamp;
}

ListedImage listed_image(const BagTopic& topic, Timestamp stamp, std::size_t number) {
  const std::string slash = topic.name.starts_with('/') ? "" : "/";
  return {stamp, stamp_decimals(stamp),
          slash + printable(topic.name) + "[" + std::to_string(number) + "]"};
}

Result<const ImageTopic*> choose_topic(const BagContent& content, const std::string& name,
                                       const std::string& what, const std::string& option) {
  const auto refuse = [](std::string text) { return Error{ErrorKind::kInput, std::move(text)}; };
  std::vector<const ImageTopic*> all;
  std::vector<const ImageTopic*> fitting;
  const auto collect = [&](ros::ImageKind kind) {
    for (const ImageTopic& topic : content.images)
      if (topic.kind == kind) fitting.push_back(&topic);
  };
  for (const ImageTopic& topic : content.images) all.push_back(&topic);
  if (!name.empty()) {
    const auto it = std::find_if(all.begin(), all.end(),
                                 [&](const ImageTopic* t) { return t->topic.name == name; });
    if (it != all.end()) return *it;
    return refuse("no images under " + option + " " + printable(name) +
                  (all.empty() ? "" : "; there are " + joined(all)));
  }
  if (what == "depth") {
    collect(ros::ImageKind::kDepth);
  } else {
    collect(ros::ImageKind::kColour);
    if (fitting.empty()) collect(ros::ImageKind::kGrey);
  }
  std::vector<const ImageTopic*> chosen;
  for (const ImageTopic* topic : fitting) {
    const bool is_there_raw = std::any_of(fitting.begin(), fitting.end(), [&](const auto* other) {
      return topic->topic.type == ros::kCompressedType && other->topic.type == ros::kImageType &&
             other->topic.name == base_of(topic->topic);
    });
    if (!is_there_raw) chosen.push_back(topic);
  }
  if (chosen.size() == 1) return chosen.front();
  if (chosen.empty())
    return refuse("no topic with " + what + " images" +
                  (content.has_messages ? "" : ": the recording holds no message") +
                  (all.empty() ? "" : " that can be read; there are " + joined(all)) +
                  unread_text(content));
  return refuse("several topics have " + what + " images: " + joined(chosen) + "; choose with " +
                option);
}

namespace {

std::string camera_topic_of(const BagTopic& images) {
  return before_last(base_of(images)) + "/camera_info";
}

bool is_rectified(const BagTopic& images) {
  const std::string base = base_of(images);
  return base.substr(before_last(base).size()).starts_with("/image_rect");
}

/// depth_registered, aligned_depth_to_color; not "unregistered".
bool calls_itself_registered(const BagTopic& depth) {
  for (const std::string_view word : {"registered", "aligned"})
    for (std::size_t at = depth.name.find(word); at != std::string::npos;
         at = depth.name.find(word, at + 1))
      if (at == 0 || std::isalpha(static_cast<unsigned char>(depth.name[at - 1])) == 0) return true;
  return false;
}

}  // namespace

Result<BagDepthCamera> depth_camera_of(const BagContent& content, const ImageTopic& colour,
                                       const ImageTopic& depth, const ImageSize& colour_size) {
  if (calls_itself_registered(depth.topic)) return BagDepthCamera{};
  BagDepthCamera found;
  found.topic = camera_topic_of(depth.topic);
  const auto info = content.cameras.find(found.topic);
  SE3 T_colour_depth;
  if (are_other_frames(colour.frame_id, depth.frame_id)) {
    const auto T = content.frames.T_target_source(colour.frame_id, depth.frame_id);
    if (!T.ok()) found.missing = T.error().message;
    if (info == content.cameras.end()) found.missing = "no CameraInfo beside the depth images";
    if (!found.missing.empty()) return found;
    T_colour_depth = *T;
  } else {
    auto width = static_cast<std::uint32_t>(std::max(0, colour_size.width));
    auto height = static_cast<std::uint32_t>(std::max(0, colour_size.height));
    if (const auto own = content.cameras.find(camera_topic_of(colour.topic));
        own != content.cameras.end() && width == 0)
      width = own->second.width, height = own->second.height;
    const bool is_of_other_size = info != content.cameras.end() && width > 0 &&
                                  info->second.width > 0 &&
                                  (info->second.width != width || info->second.height != height);
    if (!is_of_other_size) return BagDepthCamera{};
  }
  const auto refuse = [&](const std::string& what) {
    return Error{ErrorKind::kConfig,
                 printable(found.topic) + ": " + what + "; give --depth-camera FILE"};
  };
  const auto lens = ros::camera_of(info->second, is_rectified(depth.topic));
  if (!lens.ok()) return refuse(lens.error().message);
  if (const auto wrong = fault_of_placement(T_colour_depth.quaternion(), T_colour_depth.t());
      !wrong.empty())
    return refuse(wrong);
  found.camera = DepthCamera{*lens, T_colour_depth};
  found.camera->camera.depth_scale = 0;  // a --camera may give one
  return found;
}

Result<std::optional<BagCamera>> camera_of(const BagContent& content, const ImageTopic& colour) {
  auto it = content.cameras.find(camera_topic_of(colour.topic));
  if (it == content.cameras.end() && content.cameras.size() == 1 &&
      !are_other_frames(content.cameras.begin()->second.header.frame_id, colour.frame_id))
    it = content.cameras.begin();
  if (it == content.cameras.end()) {
    if (content.cameras.empty()) return std::optional<BagCamera>();
    return Error{ErrorKind::kConfig, "none of its " + std::to_string(content.cameras.size()) +
                                         " CameraInfo topics stands beside " +
                                         printable(colour.topic.name) +
                                         "; give --camera FILE.yaml"};
  }
  const auto camera = ros::camera_of(it->second, is_rectified(colour.topic));
  if (camera.ok()) return std::optional(BagCamera{it->first, *camera});
  return Error{ErrorKind::kConfig,
               printable(it->first) + ": " + camera.error().message + "; give --camera FILE.yaml"};
}

std::vector<ListedImage> BagImages::add(const ImageTopic& topic) {
  std::vector<ListedImage> listed;
  topics_.push_back(topic.topic);
  for (std::size_t i = 0; i < topic.images.size(); ++i) {
    const BagImage& image = topic.images[i];
    ListedImage entry = listed_image(topic.topic, image.stamp, i);
    while (place_of_.contains(entry.file)) entry.file += '\'';  // long names are shown cut
    place_of_[entry.file] = {topics_.size() - 1, image.place};
    listed.push_back(std::move(entry));
  }
  return listed;
}

Result<ImageHeader> BagImages::header(const std::string& name) const {
  const Place& place = place_of_.at(name);
  const auto bytes = bag_->read(place.place);
  if (!bytes.ok()) return bytes.error();
  return ros::decode_header(topics_[place.topic], *bytes);
}

Result<ColourImage> BagImages::colour(const std::string& name, const ImageSize& size,
                                      int channels) const {
  const Place& place = place_of_.at(name);
  const auto bytes = bag_->read(place.place);
  if (!bytes.ok()) return bytes.error();
  return ros::decode_colour(topics_[place.topic], *bytes, size, channels);
}

Result<DepthImage> BagImages::depth_m(const std::string& name, const CameraConfig& camera,
                                      const DepthConfig& config) const {
  const Place& place = place_of_.at(name);
  const auto bytes = bag_->read(place.place);
  if (!bytes.ok()) return bytes.error();
  return ros::decode_depth(topics_[place.topic], *bytes, camera, config);
}

}  // namespace ygslam
