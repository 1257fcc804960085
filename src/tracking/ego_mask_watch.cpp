#include "tracking/ego_mask_watch.hpp"

namespace ygslam {

const PixelMaskPtr& EgoMaskWatch::look(const RgbdFrame& frame) {
  mask_.step(frame);
  return mask_.pixels();
}

EgoMaskWatch::Output EgoMaskWatch::step(const Input& in, Rng& rng) {
  Output out{mask_.found(), mask_.pixels(), mask_.take_growth(in.stamp), {}};
  if (!in.tracked) return out;
  retracker_.add(*in.tracked, out.grew ? out.found : nullptr);
  out.retracked = retracker_.step(in.view, in.is_sure, rng);
  return out;
}

}  // namespace ygslam
