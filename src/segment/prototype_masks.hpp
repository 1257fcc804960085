// Masks as linear combinations of prototypes (Bolya et al., "YOLACT", ICCV 2019, eq. (1)), as the
// heads of YOLO-seg networks give them.
#pragma once

#include <span>
#include <vector>

#include "segment/mask_sampler.hpp"

namespace ygslam {

inline constexpr int kPrototypes = 32;

struct Prototypes {
  std::span<const float> values;  ///< kPrototypes x height x width
  int width = 0, height = 0;
};

class PrototypeMasks {
 public:
  PrototypeMasks(const Prototypes& prototypes, const Letterbox& box);

  /// Paints the mask of `coefficients`, `stride` numbers apart in memory, see MaskSampler::paint.
  /// sigmoid(x) > 0.5 is x > 0, so no sigmoid is computed.
  /// @return false if the mask has no pixel or a coefficient is not finite.
  [[nodiscard]] bool paint(const float* coefficients, std::size_t stride, const Instance& instance,
                           std::uint8_t id, GreyImage& ids);

 private:
  Prototypes prototypes_;
  MaskSampler sampler_;
  std::vector<float> linear_;  ///< coefficient-weighted sum of the prototypes, height x width
};

}  // namespace ygslam
