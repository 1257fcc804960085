#include "tracking/ego_mask.hpp"

#include <algorithm>

namespace ygslam {
namespace {

PixelMaskPtr mask_of(const CameraConfig& camera) {
  if (camera.ignored.empty()) return nullptr;
  auto mask = std::make_shared<GreyImage>(camera.width, camera.height);
  for (const PixelRectangle& r : camera.ignored)
    for (int v = std::max(0, r.v); v < std::min(camera.height, r.v + r.height); ++v)
      for (int u = std::max(0, r.u); u < std::min(camera.width, r.u + r.width); ++u)
        mask->at(u, v) = 255;
  return mask;
}

}  // namespace

EgoMask::EgoMask(const EgoMaskConfig& config, const CameraConfig& camera)
    : finder_(config), given_(mask_of(camera)), pixels_(given_) {}

void EgoMask::step(const RgbdFrame& frame) {
  const PixelMaskPtr found = finder_.step(frame);
  if (found == found_) return;
  found_ = found;
  pixels_ = joined(given_, found_);
}

bool EgoMask::take_growth(Timestamp now) {
  constexpr double kInterval_s = 0.5;
  if (!found_ || (told_at_ && seconds_between(now, *told_at_) < kInterval_s)) return false;
  if (!covers_more(found_, told_)) return false;
  told_ = joined(told_, found_);
  told_at_ = now;
  return true;
}

}  // namespace ygslam
