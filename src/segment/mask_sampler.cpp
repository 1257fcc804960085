#include "segment/mask_sampler.hpp"

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

MaskSampler::Axis MaskSampler::make_axis(int size, double scale, double pad, double stride,
                                         int cells) {
  Axis axis{std::vector<int>(size), std::vector<float>(size), cells - 1};
  for (int i = 0; i < size; ++i) {
    const double cell = std::clamp(((i + 0.5) * scale + pad) / stride - 0.5, 0.0, cells - 1.0);
    axis.low[i] = static_cast<int>(cell);
    axis.weight[i] = static_cast<float>(cell - axis.low[i]);
  }
  return axis;
}

MaskSampler::MaskSampler(const Letterbox& box, int mask_width, int mask_height)
    : columns_(make_axis(box.image_width, box.scale_x(), box.pad_left,
                         static_cast<double>(box.net_width) / mask_width, mask_width)),
      rows_(make_axis(box.image_height, box.scale_y(), box.pad_top,
                      static_cast<double>(box.net_height) / mask_height, mask_height)),
      line_(mask_width) {}

MaskSampler::Pixels MaskSampler::pixels_of(const Instance& instance) const {
  const auto [u0, u1] =
      covered_pixels(instance.x0, instance.x1, static_cast<int>(columns_.low.size()));
  const auto [v0, v1] =
      covered_pixels(instance.y0, instance.y1, static_cast<int>(rows_.low.size()));
  return {u0, u1, v0, v1};
}

MaskCells MaskSampler::cells_of(const Instance& instance) const {
  const Pixels p = pixels_of(instance);
  if (p.empty()) return {};
  return {columns_.low[p.u0], std::min(columns_.low[p.u1 - 1] + 1, columns_.last), rows_.low[p.v0],
          std::min(rows_.low[p.v1 - 1] + 1, rows_.last)};
}

bool MaskSampler::paint(const float* mask, float threshold, const Instance& instance,
                        std::uint8_t id, GreyImage& ids) {
  const Pixels p = pixels_of(instance);
  const MaskCells cells = cells_of(instance);
  const std::size_t width = line_.size();
  int count = 0;
  for (int v = p.v0; v < p.v1 && !p.empty(); ++v) {
    const float* upper = mask + rows_.low[v] * width;
    const float* lower = mask + std::min(rows_.low[v] + 1, rows_.last) * width;
    const float w = rows_.weight[v];
    for (int x = cells.x0; x <= cells.x1; ++x) line_[x] = upper[x] + w * (lower[x] - upper[x]);
    std::uint8_t* out = ids.row(v);
    for (int u = p.u0; u < p.u1; ++u) {
      const int left = columns_.low[u];
      const int right = std::min(left + 1, columns_.last);
      const float value = line_[left] + columns_.weight[u] * (line_[right] - line_[left]);
      const bool inside = value > threshold;
      count += inside ? 1 : 0;
      out[u] = inside && out[u] == 0 ? id : out[u];
    }
  }
  return count > 0;
}

}  // namespace ygslam
