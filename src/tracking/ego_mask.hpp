// Which pixels tracking does not look at: those that the camera file names, and what is found to be
// fixed to the camera.
#pragma once

#include "geometry/camera.hpp"
#include "tracking/ego_mask_finder.hpp"

namespace ygslam {

class EgoMask {
 public:
  EgoMask(const EgoMaskConfig& config, const CameraConfig& camera);

  /// Of each frame in turn.
  void step(const RgbdFrame& frame);

  /// Null: none. What was found changes rarely, and so do the pointers.
  [[nodiscard]] const PixelMaskPtr& found() const { return found_; }
  [[nodiscard]] const PixelMaskPtr& pixels() const { return pixels_; }
  /// Whether the map is to be told of more than it knows. @return true at most twice a second.
  [[nodiscard]] bool take_growth(Timestamp now);

 private:
  EgoMaskFinder finder_;
  PixelMaskPtr given_, found_, pixels_;
  PixelMaskPtr told_;  // all that the map was told of
  std::optional<Timestamp> told_at_;
};

}  // namespace ygslam
