#include "segment/planar.hpp"

namespace ygslam {

void to_planar(const ColourImage& image, float* planes) {
  constexpr float kScale = 1.0F / 255.0F;
  const std::size_t n = image.size();
  const Rgb8* __restrict in = image.data();
  float* __restrict red = planes;
  float* __restrict green = planes + n;
  float* __restrict blue = planes + 2 * n;
  for (std::size_t i = 0; i < n; ++i) {
    red[i] = static_cast<float>(in[i].r) * kScale;
    green[i] = static_cast<float>(in[i].g) * kScale;
    blue[i] = static_cast<float>(in[i].b) * kScale;
  }
}

}  // namespace ygslam
