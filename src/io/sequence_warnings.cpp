#include "io/sequence_warnings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "core/log.hpp"  // brings {fmt}
#include "core/statistics.hpp"
#include "io/calibration.hpp"
#include "io/pairing.hpp"
#include "io/sequence_parts.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

// Pairs this well together need no look at the clocks.
constexpr std::int64_t kSynchronous_ns = 5'000'000;

/// Warns of a principal point that would lie well in images turned by 90 degrees, or of another
/// size: of both sides it is the same share then.
void warn_of_other_centre(Sequence& sequence) {
  constexpr double kNear = 0.05, kFar = 0.1;
  const CameraConfig& camera = sequence.camera;
  const auto off = [](double c, int side_px) { return c / side_px - 0.5; };
  const double off_x = off(camera.cx, camera.width), off_y = off(camera.cy, camera.height);
  const double turned =
      std::max(std::abs(off(camera.cx, camera.height)), std::abs(off(camera.cy, camera.width)));
  const bool is_turned = turned < kNear && std::max(std::abs(off_x), std::abs(off_y)) > kFar;
  const bool is_scaled =
      std::abs(off_x - off_y) < kNear && std::min(std::abs(off_x), std::abs(off_y)) > kFar;
  if (!is_turned && !is_scaled) return;
  sequence.warnings.push_back(fmt::format(
      "{}: the principal point cx {:g}, cy {:g} is not near the middle of images of {}: {}",
      camera_place(sequence, "cx"), camera.cx, camera.cy, shown_size({camera.width, camera.height}),
      is_turned ? "are cx and cy swapped?" : "is this the camera of images of another size?"));
}

}  // namespace

void warn_of_centre(Sequence& sequence) {
  constexpr double kBorder = 0.2;
  const CameraConfig& camera = sequence.camera;
  const auto is_off = [](double c, int side_px) {
    return c < kBorder * side_px || c > (1 - kBorder) * side_px;
  };
  if (!is_off(camera.cx, camera.width) && !is_off(camera.cy, camera.height)) {
    warn_of_other_centre(sequence);
    return;
  }
  sequence.warnings.push_back(fmt::format(
      "{}: the principal point cx {:g}, cy {:g} lies far from the middle of images of {}: are fx "
      "{:g}, fy {:g}, cx and cy in this order?",
      camera_place(sequence, "cx"), camera.cx, camera.cy, shown_size({camera.width, camera.height}),
      camera.fx, camera.fy));
}

void warn_of_steps(Sequence& sequence) {
  constexpr std::size_t kFewest = 3;
  constexpr double kSlowest_s = 1.5;
  constexpr double kLongGap_s = 60;
  if (sequence.pairs.size() < kFewest) return;
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < sequence.pairs.size(); ++i)
    steps_s.push_back(seconds_between(sequence.pairs[i].stamp, sequence.pairs[i - 1].stamp));
  const double usual_s = median(steps_s);
  if (constexpr double kFastest_s = 1e-3; usual_s < kFastest_s) {
    sequence.warnings.push_back(fmt::format(
        "{}: frames are {:g} s apart, faster than cameras are: are these stamps of another unit?",
        sequence.root.string(), usual_s));
    return;
  }
  if (usual_s > kSlowest_s) {
    sequence.warnings.push_back(fmt::format(
        "{}: frames are {:g} s apart; are these stamps milliseconds? They are taken as seconds",
        sequence.root.string(), usual_s));
    return;
  }
  const auto longest = std::ranges::max_element(steps_s);
  if (*longest < kLongGap_s) return;
  const auto gaps =
      std::ranges::count_if(steps_s, [](double step_s) { return step_s >= kLongGap_s; });
  sequence.warnings.push_back(fmt::format(
      "{}: {} of over a minute between frames, the longest {:.0f} s after stamp {}",
      sequence.root.string(), gaps == 1 ? "a gap" : std::to_string(gaps) + " gaps", *longest,
      format_stamp(sequence.pairs[static_cast<std::size_t>(longest - steps_s.begin())].stamp,
                   sequence.stamp_decimals)));
}

std::string camera_place(const Sequence& sequence, const std::string& key) {
  std::error_code code;
  fs::path path = sequence.root / sequence.camera_source;
  if (!fs::exists(path, code)) path = sequence.camera_source;  // given by whoever runs this
  if (!fs::exists(path, code)) return sequence.root.string() + ": " + sequence.camera_source;
  const auto text = read_file(path);
  const int line = text.ok() ? calibration_line(*text, key) : 0;
  return path.string() + (line > 0 ? ":" + std::to_string(line) : std::string());
}

void warn_of_offset(const std::optional<std::int64_t>& offset_ns, Sequence& sequence) {
  if (!offset_ns || sequence.pairs.empty()) return;
  if (median_difference_ns(sequence.pairs) <= kSynchronous_ns) return;
  if (std::llabs(*offset_ns) <= kMaxPairDifference_ns) return;
  sequence.warnings.push_back(fmt::format(
      "{}: depth stamps seem offset by {} ms against colour; wrong images may have been paired",
      sequence.root.string(), *offset_ns / 1'000'000));
}

void note_kinds(const ImageHeader& colour, Sequence& sequence) {
  const bool is_usual = colour.channels != 4 && !colour.palette &&
                        (colour.format == "JPEG" || colour.format == "PNG");
  if (!is_usual) sequence.notes.push_back("colour images are " + shown_kind(colour));
  const auto depth = sequence.images->header(sequence.pairs.front().depth_file);
  if (!depth.ok() || (depth->format == "PNG" && !depth->is_float)) return;
  std::array<char, 32> scale{};
  std::snprintf(scale.data(), scale.size(), "%g", sequence.camera.depth_scale);
  sequence.notes.push_back(
      "depth images are " + shown_kind(*depth) + ", " +
      (depth->is_float ? std::string("metres") : scale.data() + std::string(" units per metre")));
}

}  // namespace ygslam
