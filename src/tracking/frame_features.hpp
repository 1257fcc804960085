// What tracking sees in one frame: features with depth and weight, at the frame's middle instant.
#pragma once

#include <cstdint>
#include <vector>

#include "features/feature_grid.hpp"
#include "features/orb.hpp"
#include "geometry/rolling_shutter.hpp"
#include "image/pixel_mask.hpp"

namespace ygslam {

struct FrameFeatures {
  FramePtr frame;
  FeaturesPtr features;
  FeatureGrid grid;
  ReadOut read_out;                  ///< that the features were brought to the middle instant with
  std::vector<float> static_weight;  ///< per feature, 0 = dynamic .. 1 = static; empty: not known
  /// Per feature the one of the frame before that it was followed from; empty: found anew.
  std::vector<std::int32_t> followed_from{};

  [[nodiscard]] bool is_followed() const { return !followed_from.empty(); }

  /// How many features with depth are static with at least this weight.
  [[nodiscard]] int usable_points(float min_static_weight) const;
};

/// As the rows were read, without weights.
/// @param mask where there are to be none.
[[nodiscard]] FrameFeatures extract_features(OrbExtractor& orb, const Camera& camera,
                                             const FramePtr& frame,
                                             const PixelMaskPtr& mask = nullptr);

/// Features of which no more is known than the pixel, with their place in space.
/// @param scales of the levels they were found in.
[[nodiscard]] FrameFeatures with_geometry(Features features, const Camera& camera,
                                          const PyramidScales& scales, const FramePtr& frame);

/// The same features where a camera of this velocity would have seen them at the middle instant,
/// however they were corrected before. A global shutter's stay where they are.
[[nodiscard]] FrameFeatures shutter_corrected(FrameFeatures seen, const Camera& camera,
                                              const ShutterTimes& times, const Vec6& body_velocity);

}  // namespace ygslam
