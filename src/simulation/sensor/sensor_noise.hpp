// What a real camera makes of the perfect view: noise, blur, quantisation, holes and shadows.
#pragma once

#include <cstdint>

#include "geometry/camera.hpp"
#include "simulation/render/renderer.hpp"

namespace ygslam::sim {

enum class NoiseKind { kNone, kKinect };

struct DepthNoiseConfig {
  double baseline_m = 0.075;         ///< between projector and infrared camera
  double disparity_step_px = 0.125;  ///< quantisation (Khoshelham, Elberink 2012)
  double lateral_sigma_px = 0.5;     ///< of where an edge is seen (Nguyen, Izadi, Lovell 2012)
  double min_m = 0.5, max_m = 8.0;
};

struct ColourNoiseConfig {
  double sigma = 3.2;   ///< of a mid-grey pixel [code values]
  double optics = 0.7;  ///< blend with a 3x3 binomial blur, 0..1
};

/// Depth as a structured-light sensor would report it [m], 0 = none.
[[nodiscard]] DepthImage kinect_depth(const View& view, const Camera& camera,
                                      const DepthNoiseConfig& config, std::uint64_t seed,
                                      int threads);
/// Adds lens softness and sensor noise.
[[nodiscard]] ColourImage noisy_colour(const ColourImage& colour, const ColourNoiseConfig& config,
                                       std::uint64_t seed, int threads);
/// Smears every pixel along its motion. @param share exposure time / frame time.
[[nodiscard]] ColourImage motion_blurred(const ColourImage& colour,
                                         const Image<Eigen::Vector2f>& flow_px, double share,
                                         int threads);

}  // namespace ygslam::sim
