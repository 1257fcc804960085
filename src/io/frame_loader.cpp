#include "io/frame_loader.hpp"

#include <utility>

#include "core/trace.hpp"

namespace ygslam {

LoadedPair assembled_pair(const SequencePair& entry, FrameId id, Result<ColourImage> colour,
                          Result<DepthImage> depth_m, const DepthRegistration* registration) {
  LoadedPair pair;
  pair.stamp = entry.stamp;
  if (!colour.ok()) pair.bad.push_back({entry.colour_file, colour.error().message});
  if (!depth_m.ok()) pair.bad.push_back({entry.depth_file, depth_m.error().message});
  if (!colour.ok() || !depth_m.ok()) return pair;
  RgbdFrame& frame = pair.frame.emplace();
  frame.id = id;
  frame.stamp = entry.stamp;
  frame.colour = std::move(*colour);
  const trace::Span span(registration ? "register depth" : "assemble");
  frame.grey = grey_from_colour(frame.colour);
  frame.depth_delay_s = seconds_between(entry.depth_stamp, entry.stamp);
  frame.depth_m = registration ? registration->registered(*depth_m) : std::move(*depth_m);
  return pair;
}

LoadedPair load_pair(const Sequence& sequence, std::size_t position, FrameId id,
                     const DepthConfig& depth) {
  CHECK(position < sequence.pairs.size());
  const SequencePair& entry = sequence.pairs[position];
  const ImageSize size = {sequence.camera.width, sequence.camera.height};
  auto colour = [&] {
    const trace::Span span("decode colour");
    return sequence.images->colour(entry.colour_file, size, sequence.colour_channels);
  }();
  auto depth_m = [&] {
    const trace::Span span("decode depth");
    return sequence.images->depth_m(entry.depth_file, sequence.depth_camera(), depth);
  }();
  return assembled_pair(entry, id, std::move(colour), std::move(depth_m),
                        sequence.registration.get());
}

Result<RgbdFrame> load_frame(const Sequence& sequence, std::size_t position,
                             const DepthConfig& depth) {
  LoadedPair pair =
      load_pair(sequence, position, FrameId{static_cast<std::uint32_t>(position)}, depth);
  if (pair.frame) return std::move(*pair.frame);
  const SkippedImage& bad = pair.bad.front();
  return Error{ErrorKind::kInput, sequence.place_of(bad.file) + ": " + bad.reason};
}

}  // namespace ygslam
