#include "segment/output_kind.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>

#include "core/printable.hpp"
#include "segment/yolo_decoder.hpp"
#include "segment/yolo_end_decoder.hpp"

namespace ygslam {
namespace {

using Lengths = std::vector<std::int64_t>;

constexpr std::int64_t kAny = -2;  // in a pattern: any length, also one that is open
constexpr std::size_t kMostShown = 4;
constexpr std::size_t kLongestName = 30;

/// @param pattern kAny, or the length wanted, which an open one may turn out to be.
bool matches(const Lengths& lengths, const Lengths& pattern) {
  return std::equal(lengths.begin(), lengths.end(), pattern.begin(), pattern.end(),
                    [](std::int64_t is, std::int64_t wanted) {
                      return wanted == kAny || is == wanted || is == kOpen;
                    });
}

bool is_known(std::int64_t length) { return length > 0; }

std::string text(const OutputShape& output) {
  std::string shape;
  for (const std::int64_t length : output.lengths)
    shape += (shape.empty() ? "" : ",") + (length == kOpen ? "?" : std::to_string(length));
  const std::string name = one_line(output.name.substr(0, kLongestName));
  return (name.empty() ? "" : name + " ") + "[" + shape + "]";
}

Error unknown(const std::vector<OutputShape>& outputs, int width, int height) {
  std::string found;
  for (std::size_t i = 0; i < std::min(outputs.size(), kMostShown); ++i)
    found += (i == 0 ? "" : ", ") + text(outputs[i]);
  if (outputs.size() > kMostShown) found += ", ...";
  if (outputs.empty()) found = "none";
  const std::string cells = std::to_string(yolo_cells(width, height));
  const std::string prototypes =
      "[1,32," + std::to_string(height / 4) + "," + std::to_string(width / 4) + "]";
  return {ErrorKind::kModel,
          "outputs " + found +
              ", not those of a network that is read at this input size: YOLO-seg [1,36+classes," +
              cells + "] and " + prototypes + "; end-to-end YOLO-seg [1,rows,38] and " +
              prototypes + "; RTMDet-Ins dets [1,rows,5], labels [1,rows], masks [1,rows," +
              std::to_string(height) + "," + std::to_string(width) +
              "]; RF-DETR-Seg dets [1,rows,4], labels [1,rows,classes], masks [1,rows,h,w]"};
}

/// Boxes, labels and masks by their names, or where those are others, in the exporters' order.
std::array<int, 3> order_by_name(const std::vector<OutputShape>& outputs) {
  constexpr std::array kNames{"dets", "labels", "masks"};
  std::array<int, 3> order{0, 1, 2};
  for (std::size_t k = 0; k < kNames.size(); ++k) {
    const auto found = std::find_if(outputs.begin(), outputs.end(),
                                    [&](const OutputShape& o) { return o.name == kNames[k]; });
    if (found == outputs.end()) return {0, 1, 2};
    order[k] = static_cast<int>(found - outputs.begin());
  }
  return order;
}

struct Match {
  OutputLayout layout;
  int classes = 0;  // 0: the outputs do not tell
};

std::optional<Match> match_yolo(const std::vector<OutputShape>& outputs, int width, int height) {
  const Lengths prototypes{1, kPrototypes, height / 4, width / 4};
  for (const int first : {0, 1}) {
    const Lengths& rows = outputs[first].lengths;
    if (!matches(outputs[1 - first].lengths, prototypes)) continue;
    Match match{{OutputKind::kYolo, {first, 1 - first, 0}, {}}};
    if (matches(rows, {1, kAny, yolo_cells(width, height)}) && rows[1] > kYoloOtherChannels) {
      match.classes = static_cast<int>(rows[1]) - kYoloOtherChannels;
      return match;
    }
    match.layout.kind = OutputKind::kYoloEnd;
    if (matches(rows, {1, kAny, kYoloEndValues})) return match;
  }
  return std::nullopt;
}

std::optional<Match> match_named(const std::vector<OutputShape>& outputs, int width, int height) {
  Match match{{OutputKind::kRtmdet, order_by_name(outputs), {}}};
  const Lengths& boxes = outputs[match.layout.order[0]].lengths;
  const Lengths& labels = outputs[match.layout.order[1]].lengths;
  const Lengths& masks = outputs[match.layout.order[2]].lengths;
  if (matches(boxes, {1, kAny, 5}) && matches(labels, {1, kAny}) &&
      matches(masks, {1, kAny, height, width}))
    return match;
  match.layout.kind = OutputKind::kRfdetr;
  const bool is_shaped = matches(boxes, {1, kAny, 4}) && matches(labels, {1, kAny, kAny}) &&
                         matches(masks, {1, kAny, kAny, kAny}) &&
                         std::all_of(boxes.begin(), boxes.end(), is_known) &&
                         std::all_of(labels.begin(), labels.end(), is_known) &&
                         std::all_of(masks.begin(), masks.end(), is_known);
  if (!is_shaped || boxes[1] != labels[1] || boxes[1] != masks[1]) return std::nullopt;
  match.classes = static_cast<int>(labels[2]);
  return match;
}

}  // namespace

const char* name_of(OutputKind kind) {
  switch (kind) {
    case OutputKind::kYolo:
      return "YOLO-seg";
    case OutputKind::kYoloEnd:
      return "end-to-end YOLO-seg";
    case OutputKind::kRtmdet:
      return "RTMDet-Ins";
    case OutputKind::kRfdetr:
      break;
  }
  return "RF-DETR-Seg";
}

int yolo_cells(int width, int height) {
  int cells = 0;
  for (const int stride : {8, 16, 32}) cells += (width / stride) * (height / stride);
  return cells;
}

Result<OutputLayout> recognise_outputs(const std::vector<OutputShape>& outputs, int width,
                                       int height, const ClassNames& names) {
  std::optional<Match> match;
  if (outputs.size() == 2) match = match_yolo(outputs, width, height);
  if (outputs.size() == 3) match = match_named(outputs, width, height);
  if (!match) return unknown(outputs, width, height);
  auto classes = make_class_table(match->classes, names);
  if (!classes.ok())
    return Error{ErrorKind::kModel,
                 std::string(name_of(match->layout.kind)) + " with " + classes.error().message};
  match->layout.classes = std::move(classes).value();
  return match->layout;
}

}  // namespace ygslam
