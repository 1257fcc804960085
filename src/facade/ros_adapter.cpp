// The facade of include/ygslam/ros_adapter.hpp over a session: what a bag and a live page use, too.
#include "ygslam/ros_adapter.hpp"

#include <optional>
#include <utility>

#include "bag/bag_images.hpp"
#include "bag/stream_pairing.hpp"
#include "core/counted.hpp"
#include "core/log.hpp"
#include "facade/settings.hpp"
#include "io/frame_loader.hpp"
#include "live/run_topics.hpp"
#include "map_file/map_file.hpp"

namespace ygslam::api {
namespace {

constexpr std::size_t kMostPoints = 100'000;

/// "sensor_msgs/msg/Image" as bags call it.
BagTopic topic_of(const char* name, std::string type) {
  if (const std::size_t at = type.find("/msg/"); at != std::string::npos) type.erase(at, 4);
  return {name, std::move(type), Layout::kCdr};
}

}  // namespace

struct RosAdapter::Impl final : MessageSink {
  HomeProcess home;
  SessionOptions options;
  CameraModel ignored;  // what it says of them counts, whatever the rest
  log::SinkPtr sink;
  Topics topics;
  std::optional<Session> session;
  StreamPairing pairing{StampOrder::First::kIsBelieved};
  std::array<BagTopic, 2> images;  // the latest types
  std::array<std::size_t, 2> counts{};
  std::size_t left_out = 0;  // for their stamps
  int channels = 0;          // of the first colour image
  std::uint32_t next_frame = 0;
  std::optional<Timestamp> map_shown;
  MeshTopics mesh;
  bool finished = false;

  ~Impl() override {  // what ends may have something to say
    const log::ScopedSink scope(sink);
    if (session) session->runner.reset();
  }
  [[nodiscard]] bool wants(std::string_view topic) const override {
    return !topics.wanted || topics.wanted(std::string(topic));
  }
  void put(std::string_view topic, const char* type, Timestamp stamp, Bytes cdr,
           std::uint32_t /*part*/) override {
    topics.publish({std::string(topic), type, stamp.ns, std::move(cdr)});
  }

  void take_camera(std::span<const std::uint8_t> bytes);
  int take_image(StreamPairing::Side side, const BagTopic& topic,
                 std::span<const std::uint8_t> bytes);
  int process_pairs();
  void process(const StreamImage& colour_image, const StreamImage& depth_image);
  void show_map(Timestamp stamp);
};

RosAdapter::RosAdapter(const Settings& settings, Topics topics) : impl_(std::make_unique<Impl>()) {
  impl_->sink = sink_of(settings);
  guarded(impl_->sink, [&] {
    impl_->options = session_options(settings);
    if (impl_->options.segmenter == SegmenterKind::kGiven || settings.depth_camera)
      fail({ErrorKind::kConfig, "messages bring no instances, and depth that is registered"});
    impl_->topics = std::move(topics);
    impl_->ignored = settings.camera;
    if (settings.camera.fx == 0) return;
    impl_->options.camera = to_config(settings.camera);
    impl_->options.config.run.shutter_source = shutter_source_of(settings.camera);
    auto session = open_session(impl_->options);
    if (!session.ok()) fail(session.error());
    impl_->session = std::move(session).value();
  });
}
RosAdapter::RosAdapter(RosAdapter&&) noexcept = default;
RosAdapter& RosAdapter::operator=(RosAdapter&& other) noexcept {
  if (this == &other) return *this;
  end_at_home(impl_);
  impl_ = std::move(other.impl_);
  return *this;
}
RosAdapter::~RosAdapter() { end_at_home(impl_); }

int RosAdapter::take(Input input, const std::string& type, const std::uint8_t* cdr,
                     std::size_t bytes) {
  Impl& impl = alive(impl_, "take()");
  return guarded(impl.sink, [&] {
    if (impl.finished) fail({ErrorKind::kUsage, "take() after finish()"});
    const std::span message(cdr, bytes);
    if (input == Input::kCameraInfo) {
      impl.take_camera(message);
      return 0;
    }
    const bool is_colour = input == Input::kColour;
    const BagTopic topic = topic_of(is_colour ? "colour" : "depth", type);
    if (topic.type != ros::kImageType && topic.type != ros::kCompressedType)
      fail({ErrorKind::kInput, topic.name + ": " + type + " is no type of images"});
    return impl.take_image(is_colour ? StreamPairing::kColour : StreamPairing::kDepth, topic,
                           message);
  });
}

void RosAdapter::Impl::take_camera(std::span<const std::uint8_t> bytes) {
  if (session) return;
  ros::CameraInfo info;
  if (!from_cdr(bytes, info)) fail({ErrorKind::kInput, "camera info: the message ends early"});
  const auto camera = ros::camera_of(info, false);
  if (!camera.ok())
    fail({camera.error().kind, "camera info: the camera " + camera.error().message});
  options.camera = *camera;
  ignore_pixels(ignored, options.camera);  // CameraInfo knows of none
  auto opened = open_session(options);
  if (!opened.ok()) fail(opened.error());
  session = std::move(opened).value();
}

int RosAdapter::Impl::take_image(StreamPairing::Side side, const BagTopic& topic,
                                 std::span<const std::uint8_t> bytes) {
  if (!session) return 0;
  const auto stamp = image_stamp(topic, {0, {}, bytes, {}});
  if (!stamp) fail({ErrorKind::kInput, topic.name + ": the message ends early"});
  images[side] = topic;
  const auto judged = pairing.add(side, {*stamp, counts[side]++, {bytes.begin(), bytes.end()}});
  left_out += judged.bad.size();
  if (!judged.bad.empty() && is_worth_a_line(left_out))
    log::warn("{}: stamps far from the others': {} so far, left out", topic.name,
              counted(left_out, "image"));
  if (judged.jump) log::warn("{}: stamps jump and stay there", topic.name);
  return process_pairs();
}

int RosAdapter::Impl::process_pairs() {
  int frames = 0;
  while (const auto pair = pairing.take()) {
    if (!pair->is_whole()) continue;
    process(*pair->colour, *pair->depth);
    ++frames;
  }
  return frames;
}

void RosAdapter::Impl::process(const StreamImage& colour_image, const StreamImage& depth_image) {
  const CameraConfig& camera = session->camera->config();
  const BagTopic& colour = images[StreamPairing::kColour];
  if (channels == 0) {
    const auto header = ros::decode_header(colour, colour_image.bytes);
    if (!header.ok()) fail({ErrorKind::kInput, "colour: " + header.error().message});
    channels = header->channels == 1 ? 1 : 3;
  }
  LoadedPair loaded = assembled_pair(
      {colour_image.stamp, 9, depth_image.stamp, "colour", "depth"}, FrameId{next_frame++},
      ros::decode_colour(colour, colour_image.bytes, {camera.width, camera.height}, channels),
      ros::decode_depth(images[StreamPairing::kDepth], depth_image.bytes, camera,
                        options.config.depth),
      nullptr);
  if (!loaded.frame)
    fail({ErrorKind::kInput, loaded.bad.front().file + ": " + loaded.bad.front().reason});
  const auto frame = std::make_shared<const RgbdFrame>(std::move(*loaded.frame));
  const TrackResult result = session->runner->process(frame);
  publish_frame(*frame, result, camera, *this);
  const bool is_due =
      !map_shown || seconds_between(frame->stamp, *map_shown) >= topics.map_period_s;
  if (!is_due || !wants_map(*this)) return;
  show_map(frame->stamp);
}

/// The whole mesh at once: whoever comes later is given the last message alone.
void RosAdapter::Impl::show_map(Timestamp stamp) {
  map_shown = stamp;
  publish_map(*session->runner, stamp, kMostPoints, *this);
  if (MeshTopics::wanted(*this))
    mesh.publish(MeshTopics::take(*session->runner), stamp, MeshTopics::Extent::kWhole, *this);
}

void RosAdapter::save_map(const std::string& path) {
  Impl& impl = alive(impl_, "save_map()");
  guarded(impl.sink, [&] {
    if (!impl.session) return;
    const Status written =
        ygslam::save_map(path, impl.session->runner->map(), *impl.session->camera);
    if (!written.ok()) fail(written.error());
  });
}

void RosAdapter::reset() {
  Impl& impl = alive(impl_, "reset()");
  guarded(impl.sink, [&] {
    if (impl.finished) fail({ErrorKind::kUsage, "reset() after finish()"});
    if (impl.session) impl.session->runner->reset();
    impl.map_shown.reset();
  });
}

void RosAdapter::finish() {
  Impl& impl = alive(impl_, "finish()");
  guarded(impl.sink, [&] {
    if (std::exchange(impl.finished, true) || !impl.session) return;
    impl.pairing.finish();
    impl.process_pairs();
    impl.session->runner->finish();
    if (impl.map_shown && wants_map(impl)) impl.show_map(*impl.map_shown);
  });
}

}  // namespace ygslam::api
