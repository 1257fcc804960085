#include "segment/mask_painter.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

/// Pixels whose centres lie in [low, high): [first, second).
std::pair<int, int> covered_pixels(float low, float high, int size) {
  const int first = std::clamp(static_cast<int>(std::ceil(low - 0.5F)), 0, size);
  const int end = std::clamp(static_cast<int>(std::ceil(high - 0.5F)), 0, size);
  return {first, end};
}

}  // namespace

MaskPainter::Axis MaskPainter::make_axis(int size, double scale, double pad, double stride,
                                         int cells) {
  Axis axis{std::vector<int>(size), std::vector<float>(size), cells - 1};
  for (int i = 0; i < size; ++i) {
    const double cell = std::clamp(((i + 0.5) * scale + pad) / stride - 0.5, 0.0, cells - 1.0);
    axis.low[i] = static_cast<int>(cell);
    axis.weight[i] = static_cast<float>(cell - axis.low[i]);
  }
  return axis;
}

MaskPainter::MaskPainter(const YoloOutputs& outputs, const Letterbox& box)
    : outputs_(outputs),
      columns_(make_axis(box.image_width, box.scale_x(), box.pad_left,
                         static_cast<double>(box.net_width) / outputs.proto_width,
                         outputs.proto_width)),
      rows_(make_axis(box.image_height, box.scale_y(), box.pad_top,
                      static_cast<double>(box.net_height) / outputs.proto_height,
                      outputs.proto_height)),
      linear_(static_cast<std::size_t>(outputs.proto_width) * outputs.proto_height),
      line_(outputs.proto_width) {}

void MaskPainter::combine(const MaskCoefficients& coefficients, int x0, int x1, int y0, int y1) {
  const int width = outputs_.proto_width;
  const std::size_t plane = linear_.size();
  for (int y = y0; y <= y1; ++y) {
    float* out = linear_.data() + static_cast<std::size_t>(y) * width;
    std::fill(out + x0, out + x1 + 1, 0.0F);
    for (std::size_t k = 0; k < coefficients.size(); ++k) {
      const float* in =
          outputs_.prototypes.data() + k * plane + static_cast<std::size_t>(y) * width;
      const float c = coefficients[k];
      for (int x = x0; x <= x1; ++x) out[x] += c * in[x];
    }
  }
}

bool MaskPainter::paint(const MaskCoefficients& coefficients, const Instance& instance,
                        std::uint8_t id, GreyImage& ids) {
  const auto [u0, u1] = covered_pixels(instance.x0, instance.x1, ids.width());
  const auto [v0, v1] = covered_pixels(instance.y0, instance.y1, ids.height());
  if (u0 >= u1 || v0 >= v1) return false;
  const int x0 = columns_.low[u0];
  const int x1 = std::min(columns_.low[u1 - 1] + 1, columns_.last);
  const int y0 = rows_.low[v0];
  const int y1 = std::min(rows_.low[v1 - 1] + 1, rows_.last);
  combine(coefficients, x0, x1, y0, y1);

  const auto width = static_cast<std::size_t>(outputs_.proto_width);
  int count = 0;
  for (int v = v0; v < v1; ++v) {
    const float* upper = linear_.data() + rows_.low[v] * width;
    const float* lower = linear_.data() + std::min(rows_.low[v] + 1, rows_.last) * width;
    const float w = rows_.weight[v];
    for (int x = x0; x <= x1; ++x) line_[x] = upper[x] + w * (lower[x] - upper[x]);
    std::uint8_t* out = ids.row(v);
    for (int u = u0; u < u1; ++u) {
      const int left = columns_.low[u];
      const int right = std::min(left + 1, columns_.last);
      const float value = line_[left] + columns_.weight[u] * (line_[right] - line_[left]);
      const bool inside = value > 0.0F;
      count += inside ? 1 : 0;
      out[u] = inside && out[u] == 0 ? id : out[u];
    }
  }
  return count > 0;
}

}  // namespace ygslam
