#include "bag/stream_sequence.hpp"

#include <algorithm>

#include "bag/bag_choice.hpp"
#include "bag/mcap_stream.hpp"
#include "bag/stream_pairing.hpp"
#include "core/log.hpp"
#include "io/frame_stream.hpp"
#include "io/pairing.hpp"
#include "io/sequence_parts.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr double kLongestLeadIn_ns = 2e9;  // stamps may be anything: their difference, too
constexpr std::size_t kMostLeadInImages = 256;
constexpr std::size_t kMostLeadInBytes = std::size_t{256} << 20;
/// Pairs that tell how far apart frames are and how stamps are written.
constexpr std::size_t kFirstPairs = 5;
/// Colour images in a row without depth that are worth a word.
constexpr std::size_t kManyUnpaired = 60;

bool is_image(const BagTopic& topic) {
  return topic.type == ros::kImageType || topic.type == ros::kCompressedType;
}

bool is_camera(const BagTopic& topic) { return topic.type == ros::kCameraType; }

/// What comes until it is known what the sequence is made of.
class LeadIn {
 public:
  struct Early {
    std::size_t topic;  // place in content().images
    StreamImage image;
  };
  LeadIn(const BagTopics& topics, const GivenCameras& cameras)
      : topics_(topics), cameras_(cameras) {}

  void take(const BagTopic& topic, const BagMessage& message) {
    const auto place = reader_.take(topic, message);
    if (!place) return;
    const auto& images = content().images[*place].images;
    const Timestamp stamp = images.back().stamp;
    first_ = std::min(first_.value_or(stamp), stamp);
    last_ = std::max(last_.value_or(stamp), stamp);
    bytes_ += message.bytes.size();
    images_.push_back(
        {*place, {stamp, images.size() - 1, {message.bytes.begin(), message.bytes.end()}}});
  }

  /// Of every topic that may be meant something has come, and what may still place the cameras.
  [[nodiscard]] bool is_complete(const std::vector<BagTopic>& announced) const {
    const auto now = choice();
    if (!now.ok() || !now->depth_missing.empty()) return false;
    if (!topics_.rgb.empty() && !topics_.depth.empty()) return true;
    const auto told = static_cast<std::ptrdiff_t>(content().cameras.size());
    if (std::count_if(announced.begin(), announced.end(), is_camera) > told) return false;
    const auto shown = static_cast<std::ptrdiff_t>(content().images.size());
    return std::count_if(announced.begin(), announced.end(), is_image) == shown;
  }
  [[nodiscard]] bool is_too_long() const {
    return bytes_ > kMostLeadInBytes || images_.size() >= kMostLeadInImages ||
           (first_ &&
            static_cast<double>(last_->ns) - static_cast<double>(first_->ns) > kLongestLeadIn_ns);
  }
  [[nodiscard]] Result<BagChoice> choice() const { return choose(content(), topics_, cameras_); }
  [[nodiscard]] const BagContent& content() const { return reader_.content(); }
  std::vector<Early> take_images() { return std::move(images_); }

 private:
  const BagTopics& topics_;
  const GivenCameras& cameras_;
  ContentReader reader_;
  std::vector<Early> images_;
  std::size_t bytes_ = 0;
  std::optional<Timestamp> first_, last_;
};

/// The frames of a stream.
class StreamFrames final : public FrameStream {
 public:
  explicit StreamFrames(std::unique_ptr<McapStream> stream) : stream_(std::move(stream)) {}

  /// Reads until topics and camera are known and the first pairs are there.
  Status begin(const BagTopics& topics, const GivenCameras& cameras, Sequence& sequence);

  std::optional<LoadedPair> next(FrameId id, const DepthConfig& depth,
                                 const std::stop_token& stop) override {
    const auto pair = next_pair(stop);
    if (!pair) return std::nullopt;
    return assembled_pair(
        entry_of(*pair), id,
        ros::decode_colour(colour_, pair->colour.bytes, {camera_.width, camera_.height}, channels_),
        ros::decode_depth(depth_, pair->depth.bytes,
                          registration_ ? registration_->depth_camera() : camera_, depth),
        registration_.get());
  }
  bool skip(const std::stop_token& stop) override { return next_pair(stop).has_value(); }

 private:
  std::optional<StreamPair> next_pair(const std::stop_token& stop);
  std::optional<StreamPair> pull(const std::stop_token& stop);
  void take(const BagMessage& message);
  void add(StreamPairing::Side side, StreamImage image);
  void warn_of_other(const BagTopic& topic, const BagMessage& message);
  void say_end();
  [[nodiscard]] SequencePair entry_of(const StreamPair& pair) const;
  [[nodiscard]] Result<ImageHeader> first_header() const;
  [[nodiscard]] const std::string& name() const { return stream_->bytes().name(); }

  std::unique_ptr<McapStream> stream_;
  BagTopic colour_, depth_;
  CameraConfig camera_;
  std::shared_ptr<const DepthRegistration> registration_;
  int channels_ = 3;
  std::size_t known_topics_ = 0;  // when it was decided
  StreamPairing pairing_;
  std::deque<StreamPair> first_;
  std::array<std::size_t, 2> numbers_{};  // images so far
  std::size_t left_out_ = 0;
  bool told_unpaired_ = false, told_other_ = false, told_end_ = false;
  bool has_ended_ = false;  // the stream; pairs may wait
};

Status StreamFrames::begin(const BagTopics& topics, const GivenCameras& cameras,
                           Sequence& sequence) {
  const auto refuse = [&](const Error& error) {
    if (stream_->bytes().was_stopped())
      return Error{ErrorKind::kInput, name() + ": interrupted before the first frame"};
    return Error{error.kind, name() + ": " + error.message};
  };
  LeadIn lead_in(topics, cameras);
  while (!lead_in.is_complete(stream_->topics()) && !lead_in.is_too_long() && !has_ended_)
    has_ended_ = !stream_->next(
        [&](const BagMessage& message) { lead_in.take(stream_->topics()[message.topic], message); },
        {});
  const auto choice = lead_in.choice();
  if (!choice.ok()) return refuse(choice.error());
  colour_ = choice->colour->topic;
  depth_ = choice->depth->topic;
  known_topics_ = stream_->topics().size();
  warn_of_choice(*choice, sequence);
  for (LeadIn::Early& early : lead_in.take_images()) {
    const ImageTopic* topic = &lead_in.content().images[early.topic];
    if (topic == choice->colour) add(StreamPairing::kColour, std::move(early.image));
    if (topic == choice->depth) add(StreamPairing::kDepth, std::move(early.image));
  }
  if (has_ended_) pairing_.finish();
  while (first_.size() < kFirstPairs && pairing_.unpaired_in_a_row() < kManyUnpaired) {
    auto pair = pull({});
    if (!pair) break;
    first_.push_back(std::move(*pair));
  }
  if (first_.empty())
    return refuse({ErrorKind::kInput,
                   "none of the first " + std::to_string(numbers_[StreamPairing::kColour]) +
                       " colour images has a depth image within " +
                       std::to_string(kMaxPairDifference_ns / 1'000'000) + " ms"});
  for (const StreamPair& pair : first_) sequence.pairs.push_back(entry_of(pair));
  const auto header = first_header();
  if (!header.ok()) return refuse(header.error());
  sequence.camera_source = choice->camera_source;
  Status completed = complete_sequence(choice->camera, *header, sequence);
  sequence.pairs.clear();
  if (!completed.ok()) return completed;
  if (choice->depth_camera) {
    const auto depth = ros::decode_header(depth_, first_.front().depth.bytes);
    const ImageSize said = {choice->depth_camera->camera.width,
                            choice->depth_camera->camera.height};
    if (depth.ok() && said.width > 0 && depth->size != said)
      return refuse({ErrorKind::kConfig, choice->depth_camera_source + ": is for depth images of " +
                                             shown_size(said) + ", the first has " +
                                             shown_size(depth->size)});
    const Status placed =
        set_depth_camera(*choice->depth_camera, choice->depth_camera_source, sequence);
    if (!placed.ok()) return refuse(placed.error());
  }
  camera_ = sequence.camera;
  registration_ = sequence.registration;
  channels_ = sequence.colour_channels;
  return Ok{};
}

Result<ImageHeader> StreamFrames::first_header() const {
  Result<ImageHeader> header = Error{ErrorKind::kInput, ""};
  for (const StreamPair& pair : first_) {
    header = ros::decode_header(colour_, pair.colour.bytes);
    if (header.ok()) return header;
  }
  return Error{ErrorKind::kInput, "none of the first " + std::to_string(first_.size()) +
                                      " colour images can be read (" + header.error().message +
                                      ")"};
}

SequencePair StreamFrames::entry_of(const StreamPair& pair) const {
  const ListedImage colour = listed_image(colour_, pair.colour.stamp, pair.colour.number);
  const ListedImage depth = listed_image(depth_, pair.depth.stamp, pair.depth.number);
  return {colour.stamp, colour.decimals, depth.stamp, colour.file, depth.file};
}

std::optional<StreamPair> StreamFrames::next_pair(const std::stop_token& stop) {
  if (first_.empty()) return pull(stop);
  std::optional<StreamPair> pair(std::move(first_.front()));
  first_.pop_front();
  return pair;
}

std::optional<StreamPair> StreamFrames::pull(const std::stop_token& stop) {
  for (;;) {
    if (auto pair = pairing_.take()) return pair;
    if (has_ended_) {
      say_end();
      return std::nullopt;
    }
    has_ended_ = !stream_->next([this](const BagMessage& message) { take(message); }, stop);
    if (has_ended_) pairing_.finish();
  }
}

void StreamFrames::take(const BagMessage& message) {
  const BagTopic& topic = stream_->topics()[message.topic];
  const bool is_colour = topic == colour_;
  if (!is_colour && topic != depth_) return warn_of_other(topic, message);
  const auto stamp = image_stamp(topic, message);
  if (!stamp) return;
  const auto side = is_colour ? StreamPairing::kColour : StreamPairing::kDepth;
  add(side, {*stamp, numbers_[side], {message.bytes.begin(), message.bytes.end()}});
}

void StreamFrames::add(StreamPairing::Side side, StreamImage image) {
  ++numbers_[side];
  left_out_ += pairing_.add(side, std::move(image)) ? 0 : 1;
  if (pairing_.unpaired_in_a_row() < kManyUnpaired || std::exchange(told_unpaired_, true)) return;
  log::warn("{}: {} colour images in a row have no depth image within {} ms", name(), kManyUnpaired,
            kMaxPairDifference_ns / 1'000'000);
}

/// One that came too late to be asked for.
void StreamFrames::warn_of_other(const BagTopic& topic, const BagMessage& message) {
  if (message.topic < known_topics_ || told_other_ || !is_image(topic)) return;
  const auto kind = ros::image_kind(topic, message.bytes);
  if (!kind || *kind == ros::ImageKind::kOther) return;
  told_other_ = true;
  log::warn("{}: images of {} came later and are not used; --rgb-topic and --depth-topic choose",
            name(), printable(topic.name));
}

void StreamFrames::say_end() {
  if (std::exchange(told_end_, true)) return;
  for (const std::string& warning : stream_->warnings()) log::warn("{}", warning);
  const std::size_t colours = numbers_[StreamPairing::kColour];
  if (left_out_ > 0)
    log::warn("{}: {} images are left out: not after the one before them, or a negative stamp",
              name(), left_out_);
  if (2 * pairing_.unpaired() > colours)
    log::warn("{}: {} of {} colour images have a depth image", name(),
              colours - pairing_.unpaired(), colours);
}

}  // namespace

Result<Sequence> open_stream_sequence(ByteStream bytes, const BagTopics& topics,
                                      const GivenCameras& cameras) {
  Sequence sequence;
  sequence.root = bytes.name();
  auto stream = McapStream::open(std::move(bytes), {});
  if (!stream.ok()) return stream.error();
  auto frames = std::make_shared<StreamFrames>(std::move(*stream));
  Status begun = frames->begin(topics, cameras, sequence);
  if (!begun.ok()) return begun.error();
  sequence.stream = std::move(frames);
  return sequence;
}

}  // namespace ygslam
