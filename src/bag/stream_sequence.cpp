#include "bag/stream_sequence.hpp"

#include <algorithm>
#include <atomic>

#include "bag/lead_in.hpp"
#include "bag/lone_images.hpp"
#include "bag/mcap_stream.hpp"
#include "bag/motion_beside.hpp"
#include "bag/stream_pairing.hpp"
#include "core/counted.hpp"
#include "core/log.hpp"
#include "io/frame_stream.hpp"
#include "io/pairing.hpp"
#include "io/sequence_parts.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

/// Pairs that tell how far apart frames are and how stamps are written.
constexpr std::size_t kFirstPairs = 5;
constexpr std::size_t kMostFirst = 64;  // frames without a pair among them
/// Colour images without any that could be paired, for their stamps.
constexpr std::size_t kMostWithoutStamp = 256;
/// Colour images in a row without depth, at the start, after which nothing is expected any more.
constexpr std::size_t kManyUnpaired = 60;

bool is_image(const BagTopic& topic) {
  return topic.type == ros::kImageType || topic.type == ros::kCompressedType;
}

/// What is wrong with a stamp beside the others.
std::string fault_of(Timestamp stamp, std::optional<Timestamp> last) {
  if (stamp.ns < 0) return "is negative";
  if (!last) return "does not fit to the others'";
  if (stamp == *last) return "is that of another image";
  return fmt::format("is {:.3f} s {} the others'", apart_s(stamp, *last),
                     stamp > *last ? "ahead of" : "behind");
}

/// The frames of a stream.
class StreamFrames final : public FrameStream {
 public:
  explicit StreamFrames(std::unique_ptr<McapStream> stream) : stream_(std::move(stream)) {}

  /// Reads until topics and camera are known and the first pairs are there.
  Status begin(const BagTopics& topics, const GivenCameras& cameras, const WantedMotion& wanted,
               Sequence& sequence);

  std::optional<LoadedPair> next(FrameId id, const DepthConfig& depth,
                                 const std::stop_token& stop) override {
    const auto next = next_frame(stop);
    motion_.hand_out(id);
    if (!next) return std::nullopt;
    if (!next->pair.is_whole()) return missed(*next);
    const auto& [colour, depth_image] = next->pair;
    return assembled_pair(
        entry_of(next->pair), id,
        ros::decode_colour(colour_, colour->bytes, {camera_.width, camera_.height}, channels_),
        ros::decode_depth(depth_, depth_image->bytes,
                          registration_ ? registration_->depth_camera() : camera_, depth),
        registration_.get());
  }
  bool skip(const std::stop_token& stop) override { return next_frame(stop).has_value(); }
  [[nodiscard]] StreamCounts counts() const override { return {without_depth_, left_out_}; }
  Result<std::string> use_imu(const std::string& choice) override {
    return motion_.use_imu(choice);
  }
  Result<std::string> use_odometry(const std::string& choice) override {
    return motion_.use_odometry(choice);
  }
  [[nodiscard]] StreamMotion take_motion(FrameId id) override { return motion_.take(id); }

 private:
  using Frame = LoneImages::Frame;
  std::optional<Frame> next_frame(const std::stop_token& stop);
  std::optional<Frame> pull(const std::stop_token& stop);
  void take(const BagMessage& message);
  void take_motion_of(const BagTopic& topic, const BagMessage& message);
  void add(StreamPairing::Side side, StreamImage image);
  void tell_of_stamps(StreamPairing::Side side, const StampOrder::Judged& judged);
  void tell_of_shift(const StreamPair& pair);
  void warn_of_other(const BagTopic& topic, const BagMessage& message);
  void say_end();
  [[nodiscard]] LoadedPair missed(const Frame& frame) const;
  [[nodiscard]] std::string name_of(StreamPairing::Side side, const StreamImage& image) const {
    const BagTopic& topic = side == StreamPairing::kColour ? colour_ : depth_;
    return listed_image(topic, image.stamp, image.number).file;
  }
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
  LoneImages lone_;
  std::deque<Frame> first_;
  std::array<std::size_t, 2> numbers_{};  // images so far
  std::uint64_t jumps_ = 0, shifts_ = 0;
  std::int64_t told_shift_ns_ = 0;
  Timestamp last_stamp_;                                       // of a pair
  std::atomic<std::size_t> without_depth_ = 0, left_out_ = 0;  // others ask
  MotionBeside motion_;
  bool told_other_ = false, told_end_ = false;
  bool has_ended_ = false;  // the stream; pairs may wait
};

Status StreamFrames::begin(const BagTopics& topics, const GivenCameras& cameras,
                           const WantedMotion& wanted, Sequence& sequence) {
  const auto refuse = [&](const Error& error) {
    if (stream_->bytes().was_stopped())
      return Error{ErrorKind::kInput, name() + ": interrupted before the first frame"};
    return Error{error.kind, name() + ": " + error.message};
  };
  LeadIn lead_in(topics, cameras);
  const auto is_complete = [&] {
    return lead_in.is_complete(stream_->topics()) &&
           motion_.is_there(wanted, stream_->topics(), lead_in.choice()->colour->frame_id);
  };
  while (!is_complete() && !lead_in.is_too_long() && !has_ended_)
    has_ended_ = !stream_->next(
        [&](const BagMessage& message) {
          const BagTopic& topic = stream_->topics()[message.topic];
          take_motion_of(topic, message);
          lead_in.take(topic, message);
        },
        {});
  const auto choice = lead_in.choice();
  if (!choice.ok()) return refuse(choice.error());
  colour_ = choice->colour->topic;
  depth_ = choice->depth->topic;
  const std::string camera_frame = choice->colour->frame_id;
  known_topics_ = stream_->topics().size();
  warn_of_choice(*choice, sequence);
  for (LeadIn::Early& early : lead_in.take_images()) {
    const ImageTopic* topic = &lead_in.content().images[early.topic];
    if (topic == choice->colour) add(StreamPairing::kColour, std::move(early.image));
    if (topic == choice->depth) add(StreamPairing::kDepth, std::move(early.image));
  }
  if (has_ended_) pairing_.finish();
  std::vector<SequencePair>& pairs = sequence.pairs;
  while (pairs.size() < kFirstPairs && pairing_.unpaired_in_a_row() < kManyUnpaired &&
         first_.size() < kMostFirst) {
    auto frame = pull({});
    if (!frame) break;
    if (frame->pair.is_whole()) pairs.push_back(entry_of(frame->pair));
    first_.push_back(std::move(*frame));
  }
  if (pairs.empty())
    return refuse({ErrorKind::kInput,
                   "none of the first " + std::to_string(numbers_[StreamPairing::kColour]) +
                       " colour images has a depth image within " +
                       std::to_string(kMaxPairDifference_ns / 1'000'000) + " ms"});
  const auto header = first_header();
  if (!header.ok()) return refuse(header.error());
  sequence.camera_source = choice->camera_source;
  Status completed = complete_sequence(choice->camera, *header, sequence);
  sequence.pairs.clear();
  if (!completed.ok()) return completed;
  if (choice->depth_camera) {
    // What comes first is a pair: before it there are no frames.
    const auto depth = ros::decode_header(depth_, first_.front().pair.depth->bytes);
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
  motion_.list(stream_->topics(), camera_frame, sequence);
  camera_ = sequence.camera;
  registration_ = sequence.registration;
  channels_ = sequence.colour_channels;
  return Ok{};
}

Result<ImageHeader> StreamFrames::first_header() const {
  Result<ImageHeader> header = Error{ErrorKind::kInput, ""};
  for (const Frame& frame : first_) {
    if (!frame.pair.is_whole()) continue;
    header = ros::decode_header(colour_, frame.pair.colour->bytes);
    if (header.ok()) return header;
  }
  return Error{ErrorKind::kInput, "none of the first " + std::to_string(first_.size()) +
                                      " colour images can be read (" + header.error().message +
                                      ")"};
}

SequencePair StreamFrames::entry_of(const StreamPair& pair) const {
  const ListedImage colour = listed_image(colour_, pair.colour->stamp, pair.colour->number);
  const ListedImage depth = listed_image(depth_, pair.depth->stamp, pair.depth->number);
  return {colour.stamp, colour.decimals, depth.stamp, colour.file, depth.file};
}

LoadedPair StreamFrames::missed(const Frame& frame) const {
  const auto side = frame.pair.colour ? StreamPairing::kColour : StreamPairing::kDepth;
  const StreamImage& image = frame.pair.colour ? *frame.pair.colour : *frame.pair.depth;
  LoadedPair missed;
  missed.stamp = frame.fault == LoneImages::Fault::kStamp ? last_stamp_ : image.stamp;
  const std::string partner = frame.pair.colour ? "depth" : "colour";
  missed.bad.push_back(
      {name_of(side, image), frame.fault == LoneImages::Fault::kStamp
                                 ? "its stamp is wrong"
                                 : "no " + partner + " image within " +
                                       std::to_string(kMaxPairDifference_ns / 1'000'000) + " ms"});
  return missed;
}

std::optional<StreamFrames::Frame> StreamFrames::next_frame(const std::stop_token& stop) {
  std::optional<Frame> frame;
  if (first_.empty()) {
    frame = pull(stop);
  } else {
    frame = std::move(first_.front());
    first_.pop_front();
  }
  if (frame && frame->pair.is_whole()) last_stamp_ = frame->pair.colour->stamp;
  return frame;
}

std::optional<StreamFrames::Frame> StreamFrames::pull(const std::stop_token& stop) {
  for (;;) {
    if (auto frame = lone_.take()) return frame;
    if (auto pair = pairing_.take()) {
      if (pair->is_whole()) tell_of_shift(*pair);
      if (auto frame = lone_.judge(std::move(*pair), LoneImages::Fault::kPartner)) return frame;
      continue;
    }
    if (has_ended_) {
      say_end();
      return std::nullopt;
    }
    has_ended_ = !stream_->next([this](const BagMessage& message) { take(message); }, stop);
    if (has_ended_) pairing_.finish();
    if (!lone_.has_begun() && left_out_ >= kMostWithoutStamp) return std::nullopt;
    without_depth_ = pairing_.unpaired();
  }
}

void StreamFrames::take(const BagMessage& message) {
  const BagTopic& topic = stream_->topics()[message.topic];
  take_motion_of(topic, message);
  const bool is_colour = topic == colour_;
  if (!is_colour && topic != depth_) return warn_of_other(topic, message);
  const auto stamp = image_stamp(topic, message);
  const auto side = is_colour ? StreamPairing::kColour : StreamPairing::kDepth;
  if (stamp)
    return add(side, {*stamp, numbers_[side], {message.bytes.begin(), message.bytes.end()}});
  StreamImage image{{}, numbers_[side]++, {}};
  if (is_worth_a_line(++left_out_))
    log::warn("{}: {}: cannot be read as {}; left out", name(), name_of(side, image), topic.type);
  if (is_colour) lone_.add({{std::move(image), {}}, LoneImages::Fault::kStamp});
}

void StreamFrames::take_motion_of(const BagTopic& topic, const BagMessage& message) {
  motion_.add(topic, message, pairing_.shift_ns());
  for (const std::string& doubt : motion_.take_doubts()) log::warn("{}: {}", name(), doubt);
}

void StreamFrames::add(StreamPairing::Side side, StreamImage image) {
  ++numbers_[side];
  const StampOrder::Judged judged = pairing_.add(side, std::move(image));
  tell_of_stamps(side, judged);
  if (side == StreamPairing::kDepth) return;  // whose colour image will want a partner
  for (const StreamImage& bad : judged.bad) lone_.add({{bad, {}}, LoneImages::Fault::kStamp});
}

void StreamFrames::tell_of_stamps(StreamPairing::Side side, const StampOrder::Judged& judged) {
  const auto last = pairing_.last(side);
  for (const StreamImage& image : judged.bad) {
    if (!is_worth_a_line(++left_out_)) continue;
    log::warn("{}: {}: its stamp {}; left out", name(), name_of(side, image),
              fault_of(image.stamp, last));
  }
  if (!judged.jump || !is_worth_a_line(++jumps_)) return;
  const std::int64_t ns = judged.jump->ns;
  log::warn("{}: {}: stamps go {} by {:.3f} s here and stay there", name(),
            name_of(side, {{}, judged.jump->number, {}}), ns > 0 ? "ahead" : "back",
            std::abs(1e-9 * static_cast<double>(ns)));
}

void StreamFrames::tell_of_shift(const StreamPair& pair) {
  const std::int64_t ns = pairing_.shift_ns();
  if (std::exchange(told_shift_ns_, ns) == ns || !is_worth_a_line(++shifts_)) return;
  log::warn("{}: {:.3f} s are added to stamps from {} on, so that they go on from those before",
            name(), 1e-9 * static_cast<double>(ns), name_of(StreamPairing::kColour, *pair.colour));
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
    log::warn("{}: {} images are left out for their stamps", name(), left_out_.load());
  if (2 * pairing_.unpaired() > colours)
    log::warn("{}: {} of {} colour images have a depth image", name(),
              colours - pairing_.unpaired(), colours);
}

}  // namespace

Result<Sequence> open_stream_sequence(ByteStream bytes, const BagTopics& topics,
                                      const GivenCameras& cameras, const WantedMotion& wanted) {
  Sequence sequence;
  sequence.root = bytes.name();
  auto stream = McapStream::open(std::move(bytes), {});
  if (!stream.ok()) return stream.error();
  auto frames = std::make_shared<StreamFrames>(std::move(*stream));
  Status begun = frames->begin(topics, cameras, wanted, sequence);
  if (!begun.ok()) return begun.error();
  sequence.stream = std::move(frames);
  return sequence;
}

}  // namespace ygslam
