#include "segment/output_decode.hpp"

#include <algorithm>
#include <numeric>

#include "segment/rfdetr_decoder.hpp"
#include "segment/rtmdet_decoder.hpp"
#include "segment/yolo_decoder.hpp"
#include "segment/yolo_end_decoder.hpp"

namespace ygslam {
namespace {

using RunLengths = std::vector<std::size_t>;

constexpr std::size_t kMostRows = 100000;
constexpr std::size_t kAnyLength = ~std::size_t{0};  // in a pattern

/// The tensors in the layout's order.
struct Ordered {
  const OutputTensor& first;
  const OutputTensor& second;
  const OutputTensor& third;  // of two outputs: the first again
};

Ordered ordered(const OutputLayout& layout, const std::vector<OutputTensor>& outputs) {
  return {outputs[layout.order[0]], outputs[layout.order[1]], outputs[layout.order[2]]};
}

/// The values must be as many as the lengths say.
bool has_lengths(const OutputTensor& tensor, const RunLengths& pattern) {
  const bool fits = std::equal(tensor.lengths.begin(), tensor.lengths.end(), pattern.begin(),
                               pattern.end(), [](std::size_t is, std::size_t wanted) {
                                 return is <= kMostRows && (wanted == kAnyLength || is == wanted);
                               });
  return fits && std::accumulate(tensor.lengths.begin(), tensor.lengths.end(), std::size_t{1},
                                 std::multiplies<>()) == tensor.values.size();
}

Prototypes prototypes_of(const OutputTensor& tensor) {
  return {tensor.values, static_cast<int>(tensor.lengths[3]), static_cast<int>(tensor.lengths[2])};
}

bool fits_layout(const OutputLayout& layout, const Ordered& o, const Letterbox& box) {
  const auto width = static_cast<std::size_t>(box.net_width);
  const auto height = static_cast<std::size_t>(box.net_height);
  const RunLengths prototypes{1, kPrototypes, height / 4, width / 4};
  const std::size_t classes = layout.classes.size();
  switch (layout.kind) {
    case OutputKind::kYolo:
      return has_lengths(o.first,
                         {1, kYoloOtherChannels + classes,
                          static_cast<std::size_t>(yolo_cells(box.net_width, box.net_height))}) &&
             has_lengths(o.second, prototypes);
    case OutputKind::kYoloEnd:
      return has_lengths(o.first, {1, kAnyLength, kYoloEndValues}) &&
             has_lengths(o.second, prototypes);
    case OutputKind::kRtmdet:
      return has_lengths(o.first, {1, kAnyLength, kRtmdetBoxValues}) &&
             has_lengths(o.second, {1, o.first.lengths[1]}) &&
             has_lengths(o.third, {1, kAnyLength, height, width}) &&
             o.third.lengths[1] <= o.first.lengths[1];
    case OutputKind::kRfdetr:
      break;
  }
  return has_lengths(o.first, {1, kAnyLength, kRfdetrBoxValues}) && o.first.lengths[1] > 0 &&
         has_lengths(o.second, {1, o.first.lengths[1], classes}) &&
         has_lengths(o.third, {1, o.first.lengths[1], kAnyLength, kAnyLength}) &&
         !o.third.values.empty();
}

}  // namespace

Result<Decoded> decode_outputs(const OutputLayout& layout, const std::vector<OutputTensor>& outputs,
                               const Letterbox& box, const DecodeConfig& config) {
  const std::size_t wanted =
      layout.kind == OutputKind::kYolo || layout.kind == OutputKind::kYoloEnd ? 2 : 3;
  if (outputs.size() != wanted || !fits_layout(layout, ordered(layout, outputs), box)) {
    return Error{
        ErrorKind::kModel,
        std::string("the network's outputs are not of the lengths of ") + name_of(layout.kind)};
  }
  const Ordered o = ordered(layout, outputs);
  switch (layout.kind) {
    case OutputKind::kYolo: {
      YoloDecoder decoder(o.first.values, layout.classes, prototypes_of(o.second), box);
      return decode_detections(decoder, box, config);
    }
    case OutputKind::kYoloEnd: {
      YoloEndDecoder decoder(o.first.values, layout.classes, prototypes_of(o.second), box);
      return decode_detections(decoder, box, config);
    }
    case OutputKind::kRtmdet: {
      RtmdetDecoder decoder({o.first.values, o.second.values, o.third.values}, layout.classes, box);
      return decode_detections(decoder, box, config);
    }
    case OutputKind::kRfdetr:
      break;
  }
  RfdetrDecoder decoder(
      {o.first.values, o.second.values, o.third.values, static_cast<int>(o.third.lengths[3]),
       static_cast<int>(o.third.lengths[2])},
      layout.classes, box);
  return decode_detections(decoder, box, config);
}

double mask_cell_px(const OutputLayout& layout, const std::vector<OutputTensor>& outputs,
                    const Letterbox& box) {
  if (layout.kind == OutputKind::kRtmdet) return kRtmdetMaskStride_px;
  const bool has_prototypes = outputs.size() == 2;
  const OutputTensor& masks = outputs[layout.order[has_prototypes ? 1 : 2]];
  return static_cast<double>(box.net_width) / static_cast<double>(masks.lengths[3]);
}

}  // namespace ygslam
