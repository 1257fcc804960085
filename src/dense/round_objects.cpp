#include "dense/round_objects.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace ygslam {
namespace {

constexpr SemanticClass kPottedPlant = coco_class(58);  // one sees in between its leaves
constexpr double kVisible = 0.5;                        // of its depth
constexpr double kSigmas = 1;                           // at either end

/// The pixels of a mask that have depth.
struct Mask {
  std::vector<int> pixels;  // offsets, by rows
  int rows = 0, last_row = -1;
};

/// By object; empty for what is not round all through.
std::vector<Mask> masks_of_round(const DepthView& view, std::span<const Detection> detections) {
  std::vector<Mask> masks(view.objects.size());
  std::array<bool, 256> is_solid{};
  for (std::size_t i = 0; i < view.objects.size(); ++i) {
    const SemanticClass its_class =
        detections[static_cast<std::size_t>(view.objects[i]) - 1].semantic_class;
    is_solid[i + 1] = is_round(its_class) && its_class != kPottedPlant;
  }
  if (std::find(is_solid.begin(), is_solid.end(), true) == is_solid.end()) return masks;
  for (int v = 0; v < view.depth.height(); ++v) {
    for (int u = 0; u < view.depth.width(); ++u) {
      const std::uint8_t object = view.object.at(u, v);
      if (!is_solid[object] || view.depth.at(u, v) == 0) continue;
      Mask& mask = masks[object - 1U];
      mask.pixels.push_back(v * view.depth.width() + u);
      mask.rows += mask.last_row == v ? 0 : 1;
      mask.last_row = v;
    }
  }
  return masks;
}

struct DepthRange {
  double near_m = 0, far_m = 0;
};

/// The range of a length that holds most of the depths, the nearest of those.
DepthRange fullest_range(const std::vector<double>& sorted_m, double length_m) {
  std::ptrdiff_t most = 0;
  DepthRange range;
  for (auto near = sorted_m.begin(), far = near; near != sorted_m.end(); ++near) {
    while (far != sorted_m.end() && *far - *near <= length_m) ++far;
    if (far - near <= most) continue;
    most = far - near;
    range = {*near, *(far - 1)};
  }
  return range;
}

}  // namespace

bool is_round(SemanticClass semantic_class) {
  // Bottle, wine glass, cup, bowl, vase, ball.
  constexpr std::array kRound = {39, 40, 41, 45, 75, 32};
  return semantic_class == kPottedPlant || std::any_of(kRound.begin(), kRound.end(), [&](int coco) {
           return coco_class(coco) == semantic_class;
         });
}

void drop_beyond_round_objects(DepthView& view, std::span<const Detection> detections,
                               const DepthNoise& noise) {
  const NoiseModel noise_model(noise);
  for (const Mask& mask : masks_of_round(view, detections)) {
    if (mask.pixels.empty()) continue;
    std::vector<double> depths_m;
    depths_m.reserve(mask.pixels.size());
    for (const int pixel : mask.pixels)
      depths_m.push_back(view.depth.data()[pixel] * DepthView::kUnit_m);
    std::vector<double> sorted_m = depths_m;
    std::sort(sorted_m.begin(), sorted_m.end());
    const double median_m = sorted_m[sorted_m.size() / 2];
    const double width_m =
        static_cast<double>(mask.pixels.size()) / mask.rows / view.camera.fx * median_m;
    const auto sigma_m = static_cast<double>(noise_model.sigma_m(static_cast<float>(median_m)));
    const DepthRange range = fullest_range(sorted_m, kVisible * width_m + 2 * kSigmas * sigma_m);
    for (std::size_t i = 0; i < mask.pixels.size(); ++i)
      if (depths_m[i] < range.near_m || depths_m[i] > range.far_m)
        view.object.data()[mask.pixels[i]] = DepthView::kUnsure;
  }
}

}  // namespace ygslam
