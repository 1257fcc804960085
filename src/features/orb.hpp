// Oriented FAST and rotated BRIEF on an image pyramid (Rublee et al. 2011), spread over the image.
#pragma once

#include <vector>

#include "features/brief.hpp"
#include "features/fast.hpp"
#include "features/feature.hpp"
#include "features/pyramid_scales.hpp"
#include "features/scale_space.hpp"
#include "image/image.hpp"

namespace ygslam {

struct OrbConfig {
  int features = 1000;        ///< per image, at most
  int levels = 8;             ///< of the pyramid
  double scale_factor = 1.2;  ///< between levels, in [1.05, 2]
  int fast_threshold = 20;    ///< grey values
  int cell_px = 35;           ///< of the level
  double evenness = 0.5;      ///< 0: the strongest corners; more: more even, see spread_corners()
};

/// Same image, same features in the same order: by octave, then in raster order.
/// Not to be shared between threads: buffers are kept from image to image.
class OrbExtractor {
 public:
  explicit OrbExtractor(const OrbConfig& config);

  [[nodiscard]] const PyramidScales& scales() const { return scales_; }

  /// Depth is 0 and ideal_px equals uv_px; see attach_geometry(). Images too small for a patch and
  /// images without texture give no features.
  /// @param masked of the image's size: none is made where it is not 0, nor so near that the corner
  /// could be what lies there; those elsewhere take their place. nullptr = everywhere.
  [[nodiscard]] Features extract(const GreyImage& image, const GreyImage* masked = nullptr);

 private:
  void build_pyramid(const GreyImage& image);
  [[nodiscard]] std::vector<int> quotas() const;
  /// @return number of features added, at most quota.
  int extract_level(int level, int quota, const GreyImage* masked, Features& features);

  OrbConfig config_;
  PyramidScales scales_;
  Brief brief_;
  FastDetector detector_;
  std::vector<PaddedImage> pyramid_;
  int levels_ = 0;  // of the current image: those that can hold a patch
  PaddedImage smooth_;
  std::vector<Corner> corners_;
};

}  // namespace ygslam
