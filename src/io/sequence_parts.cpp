#include "io/sequence_parts.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "core/log.hpp"  // brings {fmt}
#include "core/statistics.hpp"
#include "geometry/rolling_shutter.hpp"
#include "io/calibration.hpp"
#include "io/camera_devices.hpp"
#include "io/camera_formats.hpp"
#include "io/depth_calibration.hpp"
#include "io/pairing.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr const char* kCalibration = "calibration.txt";
constexpr double kLeastPairedShare = 0.1;
// Pairs this well together need no look at the clocks.
constexpr std::int64_t kSynchronous_ns = 5'000'000;

class FolderImages final : public ImageSource {
 public:
  explicit FolderImages(fs::path root) : root_(std::move(root)) {}

  Result<ImageHeader> header(const std::string& name) const override {
    const auto bytes = read(name);
    return bytes.ok() ? decode_header(*bytes) : Result<ImageHeader>(bytes.error());
  }
  Result<ColourImage> colour(const std::string& name, const ImageSize& size,
                             int channels) const override {
    const auto bytes = read(name);
    if (!bytes.ok()) return bytes.error();
    return decode_colour(*bytes, size, channels);
  }
  Result<DepthImage> depth_m(const std::string& name, const CameraConfig& camera,
                             const DepthConfig& config) const override {
    const auto bytes = read(name);
    if (!bytes.ok()) return bytes.error();
    return decode_depth_m(*bytes, ImageSize{camera.width, camera.height}, camera.depth_scale,
                          config);
  }

 private:
  Result<std::string> read(const std::string& name) const {
    const fs::path path = root_ / name;
    auto bytes = read_file(path);
    if (bytes.ok()) return bytes;
    // "PATH: reason" without the path
    return Error{ErrorKind::kInput, bytes.error().message.substr(path.string().size() + 2)};
  }

  fs::path root_;
};

Error sequence_fault(const Sequence& sequence, const std::string& what) {
  return {ErrorKind::kInput, sequence.root.string() + ": " + what};
}

std::string milliseconds(std::int64_t ns) { return std::to_string(ns / 1'000'000) + " ms"; }

std::vector<Timestamp> stamps_of(const std::vector<ListedImage>& images) {
  std::vector<Timestamp> stamps(images.size());
  std::transform(images.begin(), images.end(), stamps.begin(),
                 [](const ListedImage& image) { return image.stamp; });
  return stamps;
}

// Warns where colour and depth belong together at another offset than the pairs have.
void warn_of_offset(const std::optional<std::int64_t>& offset_ns, Sequence& sequence) {
  if (!offset_ns || sequence.pairs.empty()) return;
  if (median_difference_ns(sequence.pairs) <= kSynchronous_ns) return;
  if (std::llabs(*offset_ns) <= kMaxPairDifference_ns) return;
  sequence.warnings.push_back(sequence.root.string() + ": depth stamps seem offset by " +
                              milliseconds(*offset_ns) +
                              " against colour; wrong images may have been paired");
}

std::string folder_name(const fs::path& root) {
  std::error_code code;
  const fs::path full = fs::weakly_canonical(root, code);
  return (code ? root : full).filename().string();
}

// The first image whose header can be read says what the others must look like.
Result<ImageHeader> first_header(const Sequence& sequence, std::string SequencePair::*file,
                                 const std::string& what) {
  std::string first_reason;
  for (const SequencePair& pair : sequence.pairs) {
    auto header = sequence.images->header(pair.*file);
    if (header.ok()) return header;
    if (first_reason.empty())
      first_reason = sequence.place_of(pair.*file) + ": " + header.error().message;
  }
  return sequence_fault(sequence, "none of " + std::to_string(sequence.pairs.size()) + " " + what +
                                      " images can be read (" + first_reason + ")");
}

// File and line of a camera value, as far as it has one.
std::string camera_place(const Sequence& sequence, const std::string& key) {
  std::error_code code;
  fs::path path = sequence.root / sequence.camera_source;
  if (!fs::exists(path, code)) path = sequence.camera_source;  // given by whoever runs this
  if (!fs::exists(path, code)) return sequence.root.string() + ": " + sequence.camera_source;
  const auto text = read_file(path);
  const int line = text.ok() ? calibration_line(*text, key) : 0;
  return path.string() + (line > 0 ? ":" + std::to_string(line) : std::string());
}

constexpr double kRounding = 1.001;  // stamps are written with six digits
constexpr double kEnlarged = 1.25;   // a depth image by its registration to colour

std::string shown_ms(double time_ms) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.4g ms", time_ms);
  return text.data();
}

/// A read-out that is not over when the next image begins cannot be.
Status check_against_frame_time(const Sequence& sequence) {
  std::vector<double> steps_ms;
  for (std::size_t i = 1; i < sequence.pairs.size(); ++i)
    steps_ms.push_back(1e3 * seconds_between(sequence.pairs[i].stamp, sequence.pairs[i - 1].stamp));
  if (steps_ms.empty()) return Ok{};
  const double step_ms = median(steps_ms);
  for (const CameraKey& key : camera_keys()) {
    const double time_ms = std::abs(sequence.camera.*key.value);
    const double limit_ms = (key.name == "colour_readout_ms" ? kRounding : kEnlarged) * step_ms;
    if (is_shutter_key(key.name) && time_ms > limit_ms)
      return Error{ErrorKind::kConfig, camera_place(sequence, std::string(key.name)) + ": " +
                                           std::string(key.name) + ": " + shown_ms(time_ms) +
                                           " are longer than the " + shown_ms(step_ms) +
                                           " from frame to frame"};
  }
  return Ok{};
}

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

/// Warns of a principal point in a border of the image: numbers in another order?
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

/// Warns where stamps seem to be of another unit than seconds, and once of long gaps.
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

void find_shutter(Sequence& sequence) {
  CameraConfig& camera = sequence.camera;
  if (camera.shutter_known || !shutter_times(camera).is_global()) {
    sequence.shutter_source = sequence.camera_source;
    return;
  }
  const RecognisedDevice recognised = recognised_device(folder_name(sequence.root), camera);
  if (recognised.device == nullptr) return;
  const CameraConfig given = camera;
  set_shutter(*recognised.device, camera);
  camera.depth_delay_ms = recognised.depth_delay_ms;
  if (!check_against_frame_time(sequence)) {  // recorded otherwise than these usually are
    camera = given;
    return;
  }
  sequence.shutter_source =
      std::string(recognised.device->title) + ", " + std::string(recognised.by);
  if (recognised.is_certain) return;
  // Anybody's camera may have these numbers, a rendered one too: the pictures decide.
  CameraConfig suspected = given;
  suspected.suspected_colour_readout_ms = camera.colour_readout_ms;
  suspected.suspected_depth_readout_ms = camera.depth_readout_ms;
  camera = suspected;
}

/// Says what images are, where that is not 8-bit colour and 16-bit depth as most have it.
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

}  // namespace

std::int64_t median_difference_ns(const std::vector<SequencePair>& pairs) {
  std::vector<std::int64_t> differences;
  differences.reserve(pairs.size());
  for (const SequencePair& pair : pairs) {
    differences.push_back(std::llabs(pair.depth_stamp.ns - pair.stamp.ns));
  }
  return median(differences);
}

Status pair_images(const std::vector<ListedImage>& colour, const std::vector<ListedImage>& depth,
                   Sequence& sequence) {
  const auto colour_stamps = stamps_of(colour);
  const auto depth_stamps = stamps_of(depth);
  for (const StampPair& pair :
       pair_one_to_one(colour_stamps, depth_stamps, kMaxPairDifference_ns)) {
    const ListedImage& image = colour[pair.first];
    const ListedImage& paired = depth[pair.second];
    sequence.pairs.push_back({image.stamp, image.decimals, paired.stamp, image.file, paired.file});
  }
  sequence.without_depth = colour.size() - sequence.pairs.size();
  const auto offset_ns = estimate_offset_ns(colour_stamps, depth_stamps);
  const std::string counted = std::to_string(sequence.pairs.size()) + " of " +
                              std::to_string(colour.size()) + " colour images have a depth image";
  if (static_cast<double>(sequence.pairs.size()) <
      kLeastPairedShare * static_cast<double>(colour.size())) {
    return sequence_fault(sequence,
                          "only " + counted + " within " + milliseconds(kMaxPairDifference_ns) +
                              (offset_ns ? "; depth seems offset by " + milliseconds(*offset_ns)
                                         : std::string("; the clocks have nothing in common")));
  }
  if (2 * sequence.pairs.size() < colour.size()) {
    sequence.warnings.push_back(sequence.root.string() + ": " + counted);
  }
  warn_of_offset(offset_ns, sequence);
  return Ok{};
}

Status complete_sequence(const CameraConfig& camera, Sequence& sequence) {
  const auto header = first_header(sequence, &SequencePair::colour_file, "colour");
  if (!header.ok()) return header.error();
  Status completed = complete_sequence(camera, *header, sequence);
  if (completed.ok()) note_kinds(*header, sequence);
  return completed;
}

Status complete_sequence(const CameraConfig& camera, const ImageHeader& header,
                         Sequence& sequence) {
  sequence.stamp_decimals = 0;
  for (const SequencePair& pair : sequence.pairs) {
    sequence.stamp_decimals = std::max(sequence.stamp_decimals, pair.decimals);
  }
  sequence.camera = camera;
  if (sequence.camera_source != kCalibration) {  // a file that was given
    const auto note = foreign_camera_note(sequence.camera_source, camera.depth_scale);
    if (!note.empty()) sequence.notes.push_back(note);
  }
  find_shutter(sequence);
  if (Status status = check_against_frame_time(sequence); !status) return status;
  sequence.colour_channels = header.channels <= 2 && !header.palette ? 1 : 3;
  if (sequence.camera.width <= 0) sequence.camera.width = header.size.width;
  if (sequence.camera.height <= 0) sequence.camera.height = header.size.height;
  const ImageSize expected = {sequence.camera.width, sequence.camera.height};
  warn_of_steps(sequence);
  if (header.size != expected) {
    sequence.warnings.push_back(sequence.root.string() + ": the camera is for " +
                                shown_size(expected) + ", the first image has " +
                                shown_size(header.size));
  }
  const auto faults = camera_faults(sequence.camera);
  if (faults.empty()) {
    warn_of_centre(sequence);
    return Ok{};
  }
  return Error{ErrorKind::kConfig, camera_place(sequence, faults.front().key) + ": " +
                                       faults.front().key + ": " + faults.front().reason};
}

Status set_depth_camera(DepthCamera depth, const std::string& source, Sequence& sequence) {
  CameraConfig& camera = depth.camera;
  const auto refuse = [&](const std::string& what) {
    return Error{ErrorKind::kConfig, source + ": " + what};
  };
  const bool says_size = camera.width > 0 && camera.height > 0;
  if (!says_size && !sequence.images) return refuse("says no width and height");
  if (sequence.images) {
    // Where the size is told one look is enough: some depth has no header that can be read.
    const auto header = says_size ? sequence.images->header(sequence.pairs.front().depth_file)
                                  : first_header(sequence, &SequencePair::depth_file, "depth");
    if (!header.ok() && !says_size) return header.error();
    const ImageSize size = header.ok() ? header->size : ImageSize{camera.width, camera.height};
    if (camera.width <= 0) camera.width = size.width;
    if (camera.height <= 0) camera.height = size.height;
    if (size != ImageSize{camera.width, camera.height})
      return refuse("is for depth images of " + shown_size({camera.width, camera.height}) +
                    ", the first has " + shown_size(size));
  }
  if (camera.depth_scale == 0) camera.depth_scale = sequence.camera.depth_scale;
  if (const auto faults = camera_faults(camera); !faults.empty())
    return refuse(faults.front().key + ": " + faults.front().reason);
  sequence.registration = depth_registration(depth, sequence.camera);
  if (!sequence.registration) sequence.camera.depth_scale = camera.depth_scale;
  sequence.depth_camera_source = source;
  if (const auto note = foreign_camera_note(source, camera.depth_scale); !note.empty())
    sequence.notes.push_back(note);
  return Ok{};
}

Status find_depth_camera(const GivenCameras& given, Sequence& sequence) {
  if (given.depth) return set_depth_camera(*given.depth, given.depth_source, sequence);
  const fs::path path = sequence.root / kDepthCalibration;
  std::error_code code;
  if (!fs::exists(path, code)) return Ok{};
  const auto read = read_depth_calibration(path);
  if (!read.ok()) return read.error();
  return set_depth_camera(*read, path.string(), sequence);
}

Result<std::optional<CameraConfig>> calibration_of_folder(Sequence& sequence) {
  const fs::path path = sequence.root / kCalibration;
  std::error_code code;
  if (!fs::exists(path, code)) return std::optional<CameraConfig>();
  sequence.camera_source = kCalibration;
  auto read = read_calibration(path);
  if (!read.ok()) return read.error();
  if (const auto note = foreign_camera_note(path.string(), read->depth_scale); !note.empty())
    sequence.notes.push_back(note);
  return std::optional(*read);
}

Result<std::optional<CameraConfig>> json_camera_of_folder(Sequence& sequence) {
  std::optional<CameraConfig> camera;
  for (const char* name : {"camera_intrinsic.json", "intrinsic.json", "transforms.json"}) {
    const fs::path path = sequence.root / name;
    if (!has_json_camera(path)) continue;
    const auto read = read_calibration(path);
    if (!read.ok()) return read.error();
    if (camera && !are_alike(*camera, *read))
      return Error{ErrorKind::kConfig, sequence.camera_source + " and " + path.string() +
                                           " tell of two cameras: choose one with --camera"};
    if (camera) continue;
    camera = *read;
    sequence.camera_source = path.string();
    if (const auto note = foreign_camera_note(path.string(), read->depth_scale); !note.empty())
      sequence.notes.push_back(note);
  }
  return camera;
}

bool are_alike(const CameraConfig& a, const CameraConfig& b) {
  const auto is_near = [](double x, double y, double tolerance) {
    return std::abs(x - y) <= tolerance;
  };
  constexpr double kPrinted_px = 0.5;  // with how few digits a camera may be written
  constexpr double kDistortion = 1e-3;
  const auto same_side = [](int x_px, int y_px) { return x_px <= 0 || y_px <= 0 || x_px == y_px; };
  return is_near(a.fx, b.fx, kPrinted_px) && is_near(a.fy, b.fy, kPrinted_px) &&
         is_near(a.cx, b.cx, kPrinted_px) && is_near(a.cy, b.cy, kPrinted_px) &&
         is_near(a.k1, b.k1, kDistortion) && is_near(a.k2, b.k2, kDistortion) &&
         is_near(a.p1, b.p1, kDistortion) && is_near(a.p2, b.p2, kDistortion) &&
         is_near(a.k3, b.k3, kDistortion) && same_side(a.width, b.width) &&
         same_side(a.height, b.height);
}

std::optional<CameraConfig> preset_of_folder(Sequence& sequence) {
  const auto preset = camera_preset(folder_name(sequence.root));
  if (!preset) return std::nullopt;
  sequence.camera_source = "preset " + preset->name;
  return preset->camera;
}

std::shared_ptr<const ImageSource> images_of_folder(const fs::path& root) {
  return std::make_shared<FolderImages>(root);
}

}  // namespace ygslam
