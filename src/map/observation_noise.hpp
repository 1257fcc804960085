// How far a feature's position and depth may be trusted; shared by tracking and mapping.
#pragma once

#include <algorithm>

#include "features/feature.hpp"
#include "image/depth.hpp"
#include "optim/observation.hpp"

namespace ygslam {

struct NoiseConfig {
  /// Localisation noise of a corner in pyramid level 0. Measured against exact truth
  /// (bench/corner_noise): a median of 0.2 px and a long tail, for which see `tail_dof` of
  /// PoseOnlyConfig and BundleConfig.
  double sigma_px = 0.25;
  double depth_sigma_scale = 5.0;  ///< times the Kinect's axial noise: corners sit on depth edges
  /// The same where the corner lies on a plane, whose depth is the mean of many pixels: what is
  /// left is what the sensor errs by in all of them alike.
  double plane_depth_sigma_scale = 1.0;
  /// Weight at most of a corner on a depth edge: an outline, or its crossing with the background,
  /// slides over the surfaces as the camera moves.
  double edge_weight = 0.25;
};

/// @param octave_scale of the feature's pyramid level. @param weight static weight, 0..1.
[[nodiscard]] inline Observation observation_of(const Feature& feature, double octave_scale,
                                                const NoiseConfig& noise, double weight) {
  Observation seen;
  seen.ideal_px = feature.ideal_px.cast<double>();
  seen.depth_m = feature.depth_m;
  seen.sigma_px = noise.sigma_px * octave_scale;
  if (feature.depth_m > 0) {
    const double scale = feature.on_plane ? noise.plane_depth_sigma_scale : noise.depth_sigma_scale;
    seen.sigma_depth_m = scale * kinect_depth_sigma_m(feature.depth_m);
  }
  seen.weight = feature.on_depth_edge ? std::min(weight, noise.edge_weight) : weight;
  return seen;
}

}  // namespace ygslam
