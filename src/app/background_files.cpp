#include "app/background_files.hpp"

#include <cmath>
#include <map>

#include "app/progress_bar.hpp"
#include "app/stop_signal.hpp"
#include "core/log.hpp"
#include "dense/background/background.hpp"
#include "io/atomic_file.hpp"
#include "io/calibration.hpp"
#include "io/image_file.hpp"
#include "io/inner_folder.hpp"
#include "io/text.hpp"
#include "system/run_writer.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;

/// What the second pass over a frame needs of the first.
struct FramePose {
  SE3 T_world_camera;
  ReadOut read_out;
};

/// Of the frames that have a place in the world, with the velocity between their neighbours.
std::map<FrameId, FramePose> frame_poses(const BackgroundJob& job) {
  struct Placed {
    FrameId frame;
    Timestamp stamp;
    FramePose pose;
  };
  std::vector<Placed> placed;
  if (job.map.keyframes().empty()) return {};
  const auto trajectory = final_trajectory(job.trajectory, job.revised, job.map);
  const auto roots = job.map.roots();
  const KeyframeId main_root = job.map.main_root();
  for (const PosedFrame& frame : job.trajectory) {
    const KeyframeId keyframe = job.map.nearest_kept(frame.reference);
    if (roots.at(keyframe) != main_root) continue;
    const ShutterTimes& times = job.map.keyframe(keyframe).data->read_out.times;
    const SE3& T_world_camera = trajectory.at(placed.size()).T_world_camera;  // in the same order
    placed.push_back({frame.frame, frame.stamp, {T_world_camera, {times, Vec6::Zero()}}});
  }
  std::map<FrameId, FramePose> poses;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const Placed& before = placed[i == 0 ? 0 : i - 1];
    const Placed& after = placed[std::min(i + 1, placed.size() - 1)];
    const double dt_s = seconds_between(after.stamp, before.stamp);
    FramePose pose = placed[i].pose;
    constexpr double kLongest_s = 0.5;  // beyond, the frames between were lost
    if (dt_s > 0 && dt_s < kLongest_s)
      pose.read_out.body_velocity =
          (before.pose.T_world_camera.inverse() * after.pose.T_world_camera).log() / dt_s;
    poses.emplace(placed[i].frame, pose);
  }
  return poses;
}

/// A mask of one value in little memory: lengths of its runs, the first one of zeros.
class PackedMask {
 public:
  PackedMask() = default;
  explicit PackedMask(const GreyImage& mask) : width_(mask.width()), height_(mask.height()) {
    std::uint8_t now = 0;
    std::uint32_t length = 0;
    for (const std::uint8_t value : mask) {
      if (value != now) runs_.push_back(std::exchange(length, 0));
      now = value;
      ++length;
    }
    runs_.shrink_to_fit();
  }
  [[nodiscard]] GreyImage restored() const {
    GreyImage mask(width_, height_);
    auto at = mask.begin();
    std::uint8_t now = 0;
    for (const std::uint32_t length : runs_) {
      std::fill_n(at, length, now);
      at += length;
      now ^= 255;
    }
    std::fill(at, mask.end(), now);
    return mask;
  }

 private:
  int width_ = 0, height_ = 0;
  std::vector<std::uint32_t> runs_;  // but for the last
};
using MoversByFrame = std::map<FrameId, PackedMask>;

/// Masks of all frames; those that show something new go into the map.
MoversByFrame find_movers(const BackgroundJob& job, const std::map<FrameId, FramePose>& poses,
                          DenseMap& dense) {
  MoversByFrame found;
  if (job.segmenter == nullptr) return found;  // nobody says what of a frame stands still
  FrameReader reader(job.sequence, job.reader);
  ProgressBar progress(reader.length(), job.quiet);
  bool failed = false;
  int added = 0;
  while (const auto frame = reader.next()) {
    const auto pose = poses.find((*frame)->id);
    if (pose == poses.end()) continue;
    const auto masks = job.segmenter->segment(**frame);
    if (!masks.ok()) {
      if (!std::exchange(failed, true)) {
        progress.clear();
        log::warn("background: {}", masks.error().message);
      }
      continue;
    }
    const GreyImage movers = movable_mask(*masks, job.movable);
    const FrameGeometry geometry(job.camera, pose->second.T_world_camera, pose->second.read_out);
    const GreyImage hidden = hidden_pixels(**frame, movers, geometry, dense);
    added += add_what_is_new(**frame, hidden, geometry, pose->second.read_out, dense) ? 1 : 0;
    found.emplace((*frame)->id, PackedMask(movers));
    progress.update(index((*frame)->id) + 1, "masks");
    if (StopSignal::received() != 0) break;
  }
  progress.clear();
  log::info("background: {} frames show what keyframes do not", added);
  return found;
}

Image<std::uint16_t> raw_depth(const DepthImage& depth_m, double depth_scale) {
  Image<std::uint16_t> raw(depth_m.width(), depth_m.height());
  std::transform(depth_m.begin(), depth_m.end(), raw.begin(), [&](float z_m) {
    return static_cast<std::uint16_t>(std::lround(std::min(65535.0, z_m * depth_scale)));
  });
  return raw;
}

Status write_pictures(const fs::path& folder, const std::string& name,
                      const BackgroundPicture& picture, double depth_scale) {
  constexpr int kFast = 1;  // zlib level
  const std::string colour = encode_png(picture.colour, kFast, PngFilter::kUp);
  const std::string depth =
      encode_png(raw_depth(picture.depth_m, depth_scale), kFast, PngFilter::kUp);
  const std::string source = encode_png(picture.source, kFast, PngFilter::kUp);
  Status written = write_file_atomically(folder / "rgb" / name, colour);
  if (written.ok()) written = write_file_atomically(folder / "depth" / name, depth);
  if (written.ok()) written = write_file_atomically(folder / "source" / name, source);
  return written;
}

Status write_lists(const fs::path& folder, const std::vector<std::string>& stamps,
                   const CameraConfig& camera) {
  std::string colour = "# colour images\n", depth = "# depth images\n", pairs;
  for (const std::string& stamp : stamps) {
    colour += stamp + " rgb/" + stamp + ".png\n";
    depth += stamp + " depth/" + stamp + ".png\n";
    pairs += stamp + " rgb/" + stamp + ".png " + stamp + " depth/" + stamp + ".png\n";
  }
  Status written = write_file_atomically(folder / "calibration.txt", format_calibration(camera));
  if (written.ok()) written = write_file_atomically(folder / "rgb.txt", colour);
  if (written.ok()) written = write_file_atomically(folder / "depth.txt", depth);
  if (written.ok()) written = write_file_atomically(folder / "associations.txt", pairs);
  return written;
}

void count(const GreyImage& source, BackgroundSummary& summary) {
  std::array<std::size_t, 256> pixels{};
  for (const std::uint8_t value : source) ++pixels[value];
  const auto share = [&](PixelSource value) {
    return static_cast<double>(pixels[static_cast<std::size_t>(value)]) /
           static_cast<double>(source.size());
  };
  ++summary.frames;
  summary.from_views += share(PixelSource::kView);
  summary.from_map += share(PixelSource::kMap);
  summary.never_seen += share(PixelSource::kNever);
}

}  // namespace

Result<BackgroundSummary> write_background(const fs::path& folder, const BackgroundJob& job,
                                           DenseMap& dense) {
  for (const char* part : {"rgb", "depth", "source"}) {
    Status writable = check_inner_folder(folder, part);
    if (writable.ok()) writable = ensure_writable_directory(folder / part);
    if (!writable.ok()) return writable.error();
  }
  const auto poses = frame_poses(job);
  MoversByFrame movers_by_frame = find_movers(job, poses, dense);
  Background background(dense);
  FrameReader reader(job.sequence, job.reader);
  ProgressBar progress(reader.length(), job.quiet);
  BackgroundSummary summary;
  std::vector<std::string> stamps;
  while (const auto frame = reader.next()) {
    const auto pose = poses.find((*frame)->id);
    if (pose == poses.end()) continue;
    const FrameGeometry geometry(job.camera, pose->second.T_world_camera, pose->second.read_out);
    const ScopedTimer timer;
    const GreyImage mask =
        hidden_pixels(**frame, movers_by_frame[(*frame)->id].restored(), geometry, dense);
    const BackgroundPicture picture = background.step(**frame, mask, geometry);
    summary.draw_cpu_ms.add(timer.cpu_ms());
    stamps.push_back(format_stamp((*frame)->stamp, job.sequence.stamp_decimals));
    Status written =
        write_pictures(folder, stamps.back() + ".png", picture, job.sequence.camera.depth_scale);
    if (!written.ok()) return written.error();
    count(picture.source, summary);
    progress.update(index((*frame)->id) + 1, "background");
    summary.interrupted_by = StopSignal::received();
    if (summary.interrupted_by != 0) break;
  }
  for (double* share : {&summary.from_views, &summary.from_map, &summary.never_seen})
    *share /= static_cast<double>(std::max<std::size_t>(1, summary.frames));
  Status written = write_lists(folder, stamps, job.sequence.camera);
  if (!written.ok()) return written.error();
  return summary;
}

}  // namespace ygslam
