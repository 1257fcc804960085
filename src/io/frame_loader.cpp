#include "io/frame_loader.hpp"

#include <utility>

#include "io/image_file.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

// Decodes a file of the sequence, or notes why it cannot be used.
template <typename Decode>
auto load_image(const TumSequence& sequence, const std::string& file, LoadedPair& pair,
                Decode decode) -> decltype(decode(std::string_view{})) {
  const std::filesystem::path path = sequence.root / file;
  const auto bytes = read_file(path);
  if (!bytes.ok()) {
    // "PATH: reason" without the path: it is in the entry already.
    pair.bad.push_back({file, bytes.error().message.substr(path.string().size() + 2)});
    return bytes.error();
  }
  auto image = decode(std::string_view(*bytes));
  if (!image.ok()) pair.bad.push_back({file, image.error().message});
  return image;
}

}  // namespace

LoadedPair load_pair(const TumSequence& sequence, std::size_t position, FrameId id,
                     const DepthConfig& depth) {
  CHECK(position < sequence.pairs.size());
  const SequencePair& entry = sequence.pairs[position];
  const ImageSize size = {sequence.camera.width, sequence.camera.height};
  LoadedPair pair;
  auto colour = load_image(sequence, entry.colour_file, pair, [&](std::string_view bytes) {
    return decode_colour(bytes, size, sequence.colour_channels);
  });
  const auto raw = load_image(sequence, entry.depth_file, pair,
                              [&](std::string_view bytes) { return decode_depth(bytes, size); });
  if (!colour.ok() || !raw.ok()) return pair;
  RgbdFrame& frame = pair.frame.emplace();
  frame.id = id;
  frame.stamp = entry.stamp;
  frame.colour = std::move(*colour);
  frame.grey = grey_from_colour(frame.colour);
  frame.depth_delay_s = seconds_between(entry.depth_stamp, entry.stamp);
  frame.depth_m = depth_from_raw(*raw, sequence.camera.depth_scale, depth);
  return pair;
}

Result<RgbdFrame> load_frame(const TumSequence& sequence, std::size_t position,
                             const DepthConfig& depth) {
  LoadedPair pair =
      load_pair(sequence, position, FrameId{static_cast<std::uint32_t>(position)}, depth);
  if (pair.frame) return std::move(*pair.frame);
  const SkippedImage& bad = pair.bad.front();
  return Error{ErrorKind::kInput, (sequence.root / bad.file).string() + ": " + bad.reason};
}

}  // namespace ygslam
