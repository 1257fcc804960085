#include "tracking/frame_features.hpp"

#include "features/attach.hpp"

namespace ygslam {

int FrameFeatures::usable_points(float min_static_weight) const {
  int usable = 0;
  for (std::size_t i = 0; i < features->size(); ++i)
    if (features->points[i].depth_m > 0 && static_weight[i] >= min_static_weight) ++usable;
  return usable;
}

FrameFeatures with_geometry(Features features, const Camera& camera, const PyramidScales& scales,
                            const FramePtr& frame) {
  attach_geometry(features, camera, frame->depth_m, scales);
  FeatureGrid grid(features, camera.ideal_bounds());
  return {frame, std::make_shared<const Features>(std::move(features)), std::move(grid), {}, {}};
}

FrameFeatures extract_features(OrbExtractor& orb, const Camera& camera, const FramePtr& frame,
                               const PixelMaskPtr& mask) {
  return with_geometry(orb.extract(frame->grey, mask.get()), camera, orb.scales(), frame);
}

FrameFeatures shutter_corrected(FrameFeatures seen, const Camera& camera, const ShutterTimes& times,
                                const Vec6& body_velocity) {
  seen.read_out = {times, body_velocity};
  if (times.is_global()) return seen;
  seen.read_out.times.depth_delay_s += seen.frame->depth_delay_s;
  auto features = std::make_shared<Features>(*seen.features);
  move_to_middle_instant(*features, camera, seen.frame->depth_m, seen.read_out);
  seen.grid = FeatureGrid(*features, camera.ideal_bounds());
  seen.features = std::move(features);
  return seen;
}

}  // namespace ygslam
