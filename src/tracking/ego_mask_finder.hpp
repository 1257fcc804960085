// Finds what is fixed to the camera and not part of the world (an ego mask): text laid over the
// image, dirt on the lens, a robot's bonnet. It stays at its pixels while everything else moves on,
// and a tracker that takes it for world believes that the camera stands. By the images alone, so
// that a pose which is wrong for just that reason cannot hide it.
#pragma once

#include <optional>

#include "core/time.hpp"
#include "image/pixel_mask.hpp"
#include "tracking/fixed_depth.hpp"
#include "tracking/fixed_edges.hpp"

namespace ygslam {

struct EgoMaskConfig {
  bool enabled = true;
  FixedEdgesConfig edges{};
  /// Images are looked at no more often, and later, when what there is has mostly been found.
  double interval_s = 0.05, later_interval_s = 0.12;
  int first_samples = 40;      ///< that count as the beginning
  double corner = 0.1;         ///< share of the weaker direction, for edges in two directions
  int least_edges = 5;         ///< fixed pixels about a cell, of the reduced image
  double nearer = 0.8;         ///< of the scene's median depth: so near is what the camera carries
  double most_of_image = 0.5;  ///< more is no camera's own: the camera stands
  int margin_px = 2;           ///< about fixed edges, of the reduced image
};

class EgoMaskFinder {
 public:
  explicit EgoMaskFinder(const EgoMaskConfig& config) : config_(config), edges_(config.edges) {}

  /// Of each frame in turn. @return what is known now; null = nothing is fixed to the camera. The
  /// same pointer until something changes.
  PixelMaskPtr step(const RgbdFrame& frame);

  [[nodiscard]] const FixedEdges& edges() const { return edges_; }

 private:
  using Cells = GreyImage;  // 0 = none

  [[nodiscard]] bool has_corner(int u, int v) const;
  [[nodiscard]] bool is_background(int u, int v) const;
  [[nodiscard]] bool is_near(int u, int v) const;
  [[nodiscard]] Cells corners();
  [[nodiscard]] Cells surfaces(const Cells& corners) const;
  [[nodiscard]] GreyImage painted(const Cells& corners, const Cells& surfaces) const;
  void publish(GreyImage reduced, const GreyImage& image);

  EgoMaskConfig config_;
  FixedEdges edges_;
  FixedDepth depth_;
  std::optional<Timestamp> last_;
  Cells passed_;  // samples in which a cell was the camera's own, less those in which it was not
  GreyImage reduced_;  // that mask_ was made of
  PixelMaskPtr mask_;
};

}  // namespace ygslam
