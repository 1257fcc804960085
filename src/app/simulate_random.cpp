#include "app/simulate_random.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <string>
#include <system_error>

#include "app/program_log.hpp"
#include "app/progress_bar.hpp"
#include "app/stop_signal.hpp"
#include "core/log.hpp"
#include "io/image_file.hpp"
#include "io/inner_folder.hpp"
#include "simulation/sequence/sequence_writer.hpp"

namespace ygslam {

namespace fs = std::filesystem;

namespace {

constexpr double kDepthScale = 5000;  // units per metre

Error cannot_write(const fs::path& path) {
  return {ErrorKind::kOutput, path.string() + ": cannot be written"};
}

Image<std::uint16_t> raw_depth(const DepthImage& depth_m) {
  Image<std::uint16_t> raw(depth_m.width(), depth_m.height());
  for (std::size_t i = 0; i < raw.size(); ++i) {
    const double value = std::floor(static_cast<double>(depth_m.data()[i]) * kDepthScale + 0.5);
    raw.data()[i] = value <= 65535 ? static_cast<std::uint16_t>(value) : 0;
  }
  return raw;
}

Status write_images(const fs::path& folder, const std::string& name,
                    const sim::RandomFrame& frame) {
  for (const auto& [ending, bytes] :
       {std::pair<const char*, std::string>{".jpg", encode_jpeg(frame.colour, 92)},
        {"_depth.png", encode_png(raw_depth(frame.depth_m), 3, PngFilter::kUp)},
        {"_people.png", encode_png(frame.people, 3, PngFilter::kUp)}}) {
    if (Status status = sim::write_new_file(folder / (name + ending), bytes); !status)
      return status;
  }
  return Ok{};
}

}  // namespace

Status write_random_frames(const fs::path& folder, int count,
                           const sim::RandomFramesOptions& options) {
  Result<sim::RandomFrames> frames = sim::RandomFrames::open(options);
  if (!frames) return frames.error();
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return Error{ErrorKind::kOutput, folder.string() + ": " + error.message()};
  const fs::path list_file = folder / "frames.csv";
  fs::remove(list_file, error);  // a link in its place would be written through
  std::ofstream list(list_file);
  list << "name,width,height,fx,fy,cx,cy,depth_scale\n" << std::flush;
  const auto start = std::chrono::steady_clock::now();
  ProgressBar bar(static_cast<std::size_t>(count), is_quiet());
  int done = 0;
  while (done < count && StopSignal::received() == 0) {
    const sim::RandomFrame frame = frames->next();
    const std::string world = fmt::format("{:05}", frame.world);
    if (Status made = make_inner_folder(folder, world); !made.ok()) return made;
    const std::string name = fmt::format("{}/{:02}", world, frame.shot);
    if (Status status = write_images(folder, name, frame); !status) return status;
    const CameraConfig& c = frame.camera;
    list << fmt::format("{},{},{},{:.3f},{:.3f},{:.3f},{:.3f},{}\n", name, c.width, c.height, c.fx,
                        c.fy, c.cx, c.cy, kDepthScale)
         << std::flush;
    if (!list) return cannot_write(list_file);
    ++done;
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    bar.update(static_cast<std::size_t>(done),
               fmt::format("{:.1f} frames/s", done / std::max(1e-3, elapsed.count())));
  }
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  log::info("{} random frames in {:.1f} s", done, elapsed.count());
  return Ok{};
}

}  // namespace ygslam
