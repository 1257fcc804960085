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
#include "io/folder_calibration.hpp"
#include "io/pairing.hpp"
#include "io/sequence_warnings.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr double kLeastPairedShare = 0.1;

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
  camera = given;
  suspect(*recognised.device, camera);
  sequence.likely_device = recognised.device->name;
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

}  // namespace ygslam
