#include "io/tum_sequence.hpp"

#include <algorithm>
#include <cstdlib>

#include "core/statistics.hpp"
#include "geometry/rolling_shutter.hpp"
#include "io/calibration.hpp"
#include "io/camera_devices.hpp"
#include "io/image_file.hpp"
#include "io/pairing.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr double kLeastPairedShare = 0.1;
// Pairs this well together need no look at the clocks.
constexpr std::int64_t kSynchronous_ns = 5'000'000;

Error input_error(const fs::path& path, const std::string& what) {
  return {ErrorKind::kInput, path.string() + ": " + what};
}

std::string milliseconds(std::int64_t ns) { return std::to_string(ns / 1'000'000) + " ms"; }

SequencePair make_pair_entry(const ListedImage& colour, const ListedImage& depth) {
  return {colour.stamp, colour.decimals, depth.stamp, colour.file, depth.file};
}

// A list's entries, or why there are none. Adds its counts and a warning to the sequence.
template <typename Entry>
Result<std::vector<Entry>> read_list(const fs::path& path, TumSequence& sequence,
                                     ParsedList<Entry> (*parse)(std::string_view)) {
  const auto text = read_file(path);
  if (!text.ok()) return text.error();
  ParsedList<Entry> list = parse(*text);
  if (list.counts.lines == 0) return input_error(path, "lists no image");
  if (list.entries.empty()) {
    return Error{ErrorKind::kInput, path.string() + (list.first_fault.empty() ? "" : ":") +
                                        list.first_fault + ": no usable line (" +
                                        list.counts.summary() + ")"};
  }
  sequence.counts += list.counts;
  if (list.counts.left_out() > 0) {
    sequence.warnings.push_back(path.string() + ": " + list.counts.summary() +
                                (list.first_fault.empty() ? "" : ", first in line ") +
                                list.first_fault);
  }
  return std::move(list.entries);
}

std::vector<Timestamp> stamps_of(const std::vector<ListedImage>& images) {
  std::vector<Timestamp> stamps(images.size());
  std::transform(images.begin(), images.end(), stamps.begin(),
                 [](const ListedImage& image) { return image.stamp; });
  return stamps;
}

std::int64_t median_difference_ns(const std::vector<SequencePair>& pairs) {
  std::vector<std::int64_t> differences;
  differences.reserve(pairs.size());
  for (const SequencePair& pair : pairs) {
    differences.push_back(std::llabs(pair.depth_stamp.ns - pair.stamp.ns));
  }
  return median(differences);
}

// Warns where colour and depth belong together at another offset than the pairs have.
void warn_of_offset(const std::optional<std::int64_t>& offset_ns, TumSequence& sequence) {
  if (!offset_ns || sequence.pairs.empty()) return;
  if (median_difference_ns(sequence.pairs) <= kSynchronous_ns) return;
  if (std::llabs(*offset_ns) <= kMaxPairDifference_ns) return;
  sequence.warnings.push_back(sequence.root.string() + ": depth stamps seem offset by " +
                              milliseconds(*offset_ns) +
                              " against colour; wrong images may have been paired");
}

Status pair_lists(TumSequence& sequence) {
  const fs::path colour_path = sequence.root / "rgb.txt";
  const auto colour = read_list<ListedImage>(colour_path, sequence, parse_image_list);
  if (!colour.ok()) return colour.error();
  const auto depth =
      read_list<ListedImage>(sequence.root / "depth.txt", sequence, parse_image_list);
  if (!depth.ok()) return depth.error();
  const auto colour_stamps = stamps_of(*colour);
  const auto depth_stamps = stamps_of(*depth);
  for (const StampPair& pair :
       pair_one_to_one(colour_stamps, depth_stamps, kMaxPairDifference_ns)) {
    sequence.pairs.push_back(make_pair_entry((*colour)[pair.first], (*depth)[pair.second]));
  }
  const auto offset_ns = estimate_offset_ns(colour_stamps, depth_stamps);
  const std::string counted = std::to_string(sequence.pairs.size()) + " of " +
                              std::to_string(colour->size()) + " colour images have a depth image";
  if (static_cast<double>(sequence.pairs.size()) <
      kLeastPairedShare * static_cast<double>(colour->size())) {
    return input_error(sequence.root,
                       "only " + counted + " within " + milliseconds(kMaxPairDifference_ns) +
                           (offset_ns ? "; depth seems offset by " + milliseconds(*offset_ns)
                                      : std::string("; the clocks have nothing in common")));
  }
  if (2 * sequence.pairs.size() < colour->size()) {
    sequence.warnings.push_back(sequence.root.string() + ": " + counted);
  }
  warn_of_offset(offset_ns, sequence);
  return Ok{};
}

Status read_associations(const fs::path& path, TumSequence& sequence) {
  const auto pairs = read_list<ListedPair>(path, sequence, parse_associations);
  if (!pairs.ok()) return pairs.error();
  for (const ListedPair& pair : *pairs) {
    sequence.pairs.push_back(make_pair_entry(pair.colour, pair.depth));
  }
  const std::int64_t median_ns = median_difference_ns(sequence.pairs);
  if (median_ns > kMaxPairDifference_ns) {
    sequence.warnings.push_back(path.string() + ": colour and depth stamps lie " +
                                milliseconds(median_ns) + " apart");
  }
  return Ok{};
}

std::string folder_name(const fs::path& root) {
  std::error_code code;
  const fs::path full = fs::weakly_canonical(root, code);
  return (code ? root : full).filename().string();
}

// The camera as given, calibrated or preset; width and height may still be 0.
Result<CameraConfig> find_camera(const std::optional<CameraConfig>& given, TumSequence& sequence) {
  if (given) {
    sequence.camera_source = "given camera";
    return *given;
  }
  const fs::path path = sequence.root / "calibration.txt";
  std::error_code code;
  if (fs::exists(path, code)) {
    sequence.camera_source = "calibration.txt";
    return read_calibration(path);
  }
  if (const auto preset = camera_preset(folder_name(sequence.root))) {
    sequence.camera_source = "preset " + preset->name;
    return preset->camera;
  }
  return Error{ErrorKind::kConfig, sequence.root.string() +
                                       ": no calibration.txt and no preset camera for this folder "
                                       "name; write calibration.txt or give --camera FILE.yaml"};
}

// The first colour image whose header can be read says what the others must look like.
Result<ImageHeader> first_header(const TumSequence& sequence) {
  std::string first_reason;
  for (const SequencePair& pair : sequence.pairs) {
    auto header = read_image_header(sequence.root / pair.colour_file);
    if (header.ok()) return header;
    if (first_reason.empty()) first_reason = header.error().message;
  }
  return input_error(sequence.root, "none of " + std::to_string(sequence.pairs.size()) +
                                        " colour images can be read (" + first_reason + ")");
}

// File and line of a camera value, as far as it has one.
std::string camera_place(const TumSequence& sequence, const std::string& key) {
  const fs::path path = sequence.root / sequence.camera_source;
  std::error_code code;
  if (!fs::exists(path, code)) return sequence.root.string() + ": " + sequence.camera_source;
  const auto text = read_file(path);
  const int line = text.ok() ? calibration_line(*text, key) : 0;
  return path.string() + (line > 0 ? ":" + std::to_string(line) : std::string());
}

constexpr double kEnlarged = 1.25;  // a depth image by its registration to colour

std::string shown_ms(double time_ms) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.4g ms", time_ms);
  return text.data();
}

/// A read-out that is not over when the next image begins cannot be.
Status check_against_frame_time(const TumSequence& sequence) {
  std::vector<double> steps_ms;
  for (std::size_t i = 1; i < sequence.pairs.size(); ++i)
    steps_ms.push_back(1e3 * seconds_between(sequence.pairs[i].stamp, sequence.pairs[i - 1].stamp));
  if (steps_ms.empty()) return Ok{};
  const double step_ms = median(steps_ms);
  for (const CameraKey& key : camera_keys()) {
    const double time_ms = std::abs(sequence.camera.*key.value);
    const double limit_ms = key.name == "colour_readout_ms" ? step_ms : kEnlarged * step_ms;
    if (is_shutter_key(key.name) && time_ms > limit_ms)
      return Error{ErrorKind::kConfig, camera_place(sequence, std::string(key.name)) + ": " +
                                           std::string(key.name) + ": " + shown_ms(time_ms) +
                                           " are longer than the " + shown_ms(step_ms) +
                                           " from frame to frame"};
  }
  return Ok{};
}

void find_shutter(TumSequence& sequence) {
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
  camera.shutter_known = recognised.is_certain;
  sequence.shutter_source = std::string(recognised.device->title) +
                            (recognised.is_certain ? ", recognised" : ", guessed by the 525 px");
}

Status complete_camera(const CameraConfig& camera, TumSequence& sequence) {
  sequence.camera = camera;
  find_shutter(sequence);
  if (Status status = check_against_frame_time(sequence); !status) return status;
  const auto header = first_header(sequence);
  if (!header.ok()) return header.error();
  sequence.colour_channels = header->channels == 1 ? 1 : 3;
  if (sequence.camera.width <= 0) sequence.camera.width = header->size.width;
  if (sequence.camera.height <= 0) sequence.camera.height = header->size.height;
  const ImageSize expected = {sequence.camera.width, sequence.camera.height};
  if (header->size != expected) {
    sequence.warnings.push_back(
        sequence.root.string() + ": the camera is for " + std::to_string(expected.width) + "x" +
        std::to_string(expected.height) + ", the first image has " +
        std::to_string(header->size.width) + "x" + std::to_string(header->size.height));
  }
  const auto faults = camera_faults(sequence.camera);
  if (faults.empty()) return Ok{};
  return Error{ErrorKind::kConfig, camera_place(sequence, faults.front().key) + ": " +
                                       faults.front().key + ": " + faults.front().reason};
}

}  // namespace

Result<TumSequence> open_tum_sequence(const fs::path& root,
                                      const std::optional<CameraConfig>& camera) {
  std::error_code code;
  if (!fs::is_directory(root, code)) return input_error(root, "no such folder");
  TumSequence sequence;
  sequence.root = root;
  const fs::path associations = root / "associations.txt";
  const Status listed = fs::exists(associations, code) ? read_associations(associations, sequence)
                                                       : pair_lists(sequence);
  if (!listed.ok()) return listed.error();
  sequence.stamp_decimals = 0;
  for (const SequencePair& pair : sequence.pairs) {
    sequence.stamp_decimals = std::max(sequence.stamp_decimals, pair.decimals);
  }
  if (fs::exists(root / "groundtruth.txt", code)) sequence.groundtruth = root / "groundtruth.txt";
  const auto found = find_camera(camera, sequence);
  if (!found.ok()) return found.error();
  const Status completed = complete_camera(*found, sequence);
  if (!completed.ok()) return completed.error();
  return sequence;
}

}  // namespace ygslam
