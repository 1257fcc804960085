#include "segment/prototype_masks.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"

namespace ygslam {

PrototypeMasks::PrototypeMasks(const Prototypes& prototypes, const Letterbox& box)
    : prototypes_(prototypes),
      sampler_(box, prototypes.width, prototypes.height),
      linear_(static_cast<std::size_t>(prototypes.width) * prototypes.height) {
  CHECK(prototypes.values.size() == kPrototypes * linear_.size());
}

bool PrototypeMasks::paint(const float* coefficients, std::size_t stride, const Instance& instance,
                           std::uint8_t id, GreyImage& ids) {
  for (int k = 0; k < kPrototypes; ++k) {
    if (!std::isfinite(coefficients[k * stride])) return false;
  }
  const MaskCells cells = sampler_.cells_of(instance);
  for (int y = cells.y0; y <= cells.y1; ++y) {
    const std::size_t row = static_cast<std::size_t>(y) * prototypes_.width;
    float* out = linear_.data() + row;
    std::fill(out + cells.x0, out + cells.x1 + 1, 0.0F);
    for (std::size_t k = 0; k < kPrototypes; ++k) {
      const float* in = prototypes_.values.data() + k * linear_.size() + row;
      const float c = coefficients[k * stride];
      for (int x = cells.x0; x <= cells.x1; ++x) out[x] += c * in[x];
    }
  }
  return sampler_.paint(linear_.data(), 0.0F, instance, id, ids);
}

}  // namespace ygslam
