#include "system/segment_safely.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <exception>

namespace ygslam {
namespace {

bool finite(const Instance& i) {
  return std::isfinite(i.score) && std::isfinite(i.x0) && std::isfinite(i.y0) &&
         std::isfinite(i.x1) && std::isfinite(i.y1);
}

Error fault(const std::string& reason) { return {ErrorKind::kModel, "segmenter: " + reason}; }

Result<Segmentation> checked(Segmentation masks, const RgbdFrame& frame) {
  if (masks.frame != frame.id) return fault("mask of another frame");
  if (!masks.ids.same_size(frame.grey)) return fault("mask not of the image's size");
  std::uint8_t highest = 0;  // not std::max_element, which looks at one pixel at a time
  for (const std::uint8_t id : masks.ids) highest = std::max(highest, id);
  if (highest > masks.instances.size()) return fault("mask with an id that no instance has");
  if (!std::all_of(masks.instances.begin(), masks.instances.end(), finite))
    return fault("box or score that is not a finite number");
  return masks;
}

}  // namespace

Result<Segmentation> segment_safely(Segmenter& segmenter, const RgbdFrame& frame) {
  try {
    Result<Segmentation> masks = segmenter.segment(frame);
    if (!masks.ok()) return masks.error();
    return checked(std::move(masks).value(), frame);
  } catch (const std::exception& e) {  // somebody's own Segmenter may throw
    return fault(e.what());
  } catch (...) {
    return fault("unknown exception");
  }
}

}  // namespace ygslam
