#include "volume_bench_frames.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>

#include "io/frame_loader.hpp"
#include "io/trajectory_formats.hpp"
#include "io/tum_sequence.hpp"

namespace ygslam::bench {
namespace {

constexpr double kWithin_s = 0.02;

template <typename T>
const T& wanted(const Result<T>& result) {
  if (result.ok()) return result.value();
  std::fprintf(stderr, "volume_bench: %s\n", result.error().message.c_str());
  std::exit(2);
}

/// Pose and velocity at a time, from the true poses around it.
bool pose_at(const std::vector<StampedPose>& poses, Timestamp stamp, PosedFrame& frame) {
  const auto after = std::lower_bound(
      poses.begin(), poses.end(), stamp,
      [](const StampedPose& p, Timestamp wanted_stamp) { return p.stamp < wanted_stamp; });
  if (after == poses.end() || after == poses.begin()) {
    if (after == poses.end() || seconds_between(after->stamp, stamp) > kWithin_s) return false;
    frame.T_world_camera = after->T_world_camera;
    return true;
  }
  const StampedPose& before = *(after - 1);
  const double gap_s = seconds_between(after->stamp, before.stamp);
  const Vec6 velocity = (before.T_world_camera.inverse() * after->T_world_camera).log() / gap_s;
  frame.T_world_camera =
      before.T_world_camera * SE3::exp(seconds_between(stamp, before.stamp) * velocity);
  frame.read_out.body_velocity = velocity;
  return gap_s < 0.2;
}

}  // namespace

PosedRecording load_posed(const std::string& sequence, std::size_t stride, std::size_t most) {
  const auto opened = open_tum_sequence(sequence);
  const Sequence& recording = wanted(opened);
  if (!recording.groundtruth) {
    std::fprintf(stderr, "volume_bench: %s has no ground truth\n", sequence.c_str());
    std::exit(2);
  }
  const auto read = read_tum_trajectory(*recording.groundtruth);
  const std::vector<StampedPose>& poses = wanted(read);
  PosedRecording result;
  result.camera = recording.camera;
  for (std::size_t i = 0; i < recording.pairs.size() && result.frames.size() < most; i += stride) {
    PosedFrame frame;
    if (!pose_at(poses, recording.pairs[i].stamp, frame)) continue;
    const auto loaded = load_frame(recording, i);
    const RgbdFrame& images = wanted(loaded);
    frame.depth_m = images.depth_m;
    frame.colour = images.colour;
    frame.read_out.times = shutter_times(recording.camera);
    const std::filesystem::path name = recording.pairs[i].colour_file;
    const cv::Mat mask =
        cv::imread((recording.root / "mask" / (name.stem().string() + ".png")).string(),
                   cv::IMREAD_ANYDEPTH | cv::IMREAD_GRAYSCALE);
    if (mask.type() == CV_8UC1 && mask.cols == images.colour.width() &&
        mask.rows == images.colour.height()) {
      frame.movers = GreyImage(mask.cols, mask.rows);
      for (int v = 0; v < mask.rows; ++v)
        std::copy_n(mask.ptr<std::uint8_t>(v), mask.cols, frame.movers.row(v));
    }
    result.frames.push_back(std::move(frame));
  }
  if (result.frames.empty()) {
    std::fprintf(stderr, "volume_bench: no frame of %s has a true pose\n", sequence.c_str());
    std::exit(2);
  }
  return result;
}

}  // namespace ygslam::bench
