#include "segment/planar.hpp"

namespace ygslam {

void to_planar(const ColourImage& image, const Normalisation& form, float* planes) {
  const std::size_t n = image.size();
  const bool is_rgb = form.order == ChannelOrder::kRgb;
  const Rgb8* __restrict in = image.data();
  float* __restrict red = planes + (is_rgb ? 0 : 2 * n);
  float* __restrict green = planes + n;
  float* __restrict blue = planes + (is_rgb ? 2 * n : 0);
  const std::array<float, 3> mean = form.mean;
  const std::array<float, 3> scale{1.0F / form.std[0], 1.0F / form.std[1], 1.0F / form.std[2]};
  for (std::size_t i = 0; i < n; ++i) {
    red[i] = (static_cast<float>(in[i].r) - mean[0]) * scale[0];
    green[i] = (static_cast<float>(in[i].g) - mean[1]) * scale[1];
    blue[i] = (static_cast<float>(in[i].b) - mean[2]) * scale[2];
  }
}

}  // namespace ygslam
