#include "bag/bag_sequence.hpp"

#include <fcntl.h>

#include <algorithm>

#include "bag/stream_sequence.hpp"
#include "core/check.hpp"
#include "core/log.hpp"
#include "fuzz/targets.hpp"
#include "io/frame_loader.hpp"
#include "io/frame_stream.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam::fuzz {
namespace {

/// @param motion what is told beside the images is wanted, too.
void as_stream(const std::filesystem::path& path, const GivenCameras& cameras, bool motion) {
  const auto sequence =
      open_stream_sequence(ByteStream(::open(path.c_str(), O_RDONLY | O_CLOEXEC), "stream", {}), {},
                           cameras, {{motion, motion}, {motion, motion}});
  if (!sequence.ok()) {
    CHECK(sequence.error().message.find('\n') == std::string::npos, "a fault is one line");
    return;
  }
  if (motion) {
    static_cast<void>(sequence->stream->use_imu(""));
    static_cast<void>(sequence->stream->use_odometry(""));
  }
  std::optional<Timestamp> before;
  while (const auto pair = sequence->stream->next(kNoFrame, {}, {})) {
    const StreamMotion said = sequence->stream->take_motion(kNoFrame);
    for (const ImuSample& sample : said.imu)
      CHECK(sample.angular_velocity_radps.allFinite() && sample.specific_force_mps2.allFinite());
    for (const OdometrySample& sample : said.wheels) CHECK(sample.T_odom_base.is_finite());
    if (!pair->frame) continue;
    CHECK(!before || *before < pair->frame->stamp, "frames come in order");
    before = pair->frame->stamp;
    CHECK(pair->frame->colour.width() == sequence->camera.width &&
          pair->frame->depth_m.height() == sequence->camera.height);
  }
}

}  // namespace

void bags(std::string_view bytes) {
  static const testing::TempFolder kFolder("ygslam-fuzz-bag");
  const auto path = kFolder.path() / "bag";
  testing::write(path, bytes);
  CameraConfig camera;
  camera.fx = camera.fy = 10;
  camera.width = camera.height = 0;
  const log::ScopedSink quiet(std::make_shared<const log::Sink>([](auto, const auto&) {}));
  for (const GivenCameras& given : {GivenCameras(), GivenCameras{.colour = camera}}) {
    as_stream(path, given, !given.colour);
    const auto sequence = open_bag_sequence(path, {}, given);
    if (!sequence.ok()) {
      CHECK(sequence.error().message.find('\n') == std::string::npos, "a fault is one line");
      continue;
    }
    CHECK(!sequence->pairs.empty());
    for (std::size_t i = 0; i < std::min<std::size_t>(sequence->pairs.size(), 4); ++i) {
      CHECK(i == 0 || sequence->pairs[i - 1].stamp < sequence->pairs[i].stamp);
      const auto frame = load_frame(*sequence, i);
      if (!frame.ok()) continue;
      CHECK(frame.value().colour.width() == sequence->camera.width &&
            frame.value().depth_m.height() == sequence->camera.height);
    }
  }
}

}  // namespace ygslam::fuzz
