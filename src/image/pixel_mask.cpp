#include "image/pixel_mask.hpp"

#include <algorithm>
#include <array>
#include <functional>

namespace ygslam {

PixelMaskPtr joined(const PixelMaskPtr& a, const PixelMaskPtr& b) {
  if (!a || !b) return a ? a : b;
  CHECK(a->same_size(*b));
  auto both = std::make_shared<GreyImage>(*a);
  std::transform(a->begin(), a->end(), b->begin(), both->begin(), std::bit_or<>());
  return both;
}

bool covers_more(const PixelMaskPtr& now, const PixelMaskPtr& before) {
  if (!now || now == before) return false;
  if (!before || !now->same_size(*before))
    return std::any_of(now->begin(), now->end(), [](std::uint8_t m) { return m != 0; });
  return !std::equal(now->begin(), now->end(), before->begin(),
                     [](std::uint8_t n, std::uint8_t b) { return n == 0 || b != 0; });
}

double covered_share(const PixelMaskPtr& mask) {
  if (!mask || mask->empty()) return 0;
  const auto free = std::count(mask->begin(), mask->end(), std::uint8_t{0});
  return 1 - static_cast<double>(free) / static_cast<double>(mask->size());
}

std::string place_in_image(const GreyImage& mask) {
  constexpr double kMost = 0.7;
  std::array<double, 3> column{}, row{};
  double all = 0;
  for (int v = 0; v < mask.height(); ++v) {
    for (int u = 0; u < mask.width(); ++u) {
      if (mask.at(u, v) == 0) continue;
      ++column[static_cast<std::size_t>(3 * u / mask.width())];
      ++row[static_cast<std::size_t>(3 * v / mask.height())];
      ++all;
    }
  }
  const auto part = [&](const std::array<double, 3>& counts) {
    const auto most = std::max_element(counts.begin(), counts.end());
    return *most >= kMost * all ? static_cast<int>(most - counts.begin()) : -1;
  };
  const int across = part(column), down = part(row);
  if (all == 0 || (across < 0 && down < 0)) return "all over";
  constexpr std::array kAcross = {"left", "centre", "right"}, kDown = {"upper", "middle", "lower"};
  if (down < 0) return across == 1 ? "middle column" : std::string(kAcross[across]) + " edge";
  if (across < 0) return down == 1 ? "middle row" : std::string(kDown[down]) + " edge";
  return across == 1 && down == 1 ? "centre" : std::string(kDown[down]) + " " + kAcross[across];
}

FramePtr without_masked_depth(const FramePtr& frame, const PixelMaskPtr& mask) {
  if (!mask || !mask->same_size(frame->depth_m)) return frame;
  auto masked = std::make_shared<RgbdFrame>(*frame);
  std::transform(mask->begin(), mask->end(), masked->depth_m.begin(), masked->depth_m.begin(),
                 [](std::uint8_t m, float depth_m) { return m != 0 ? 0.0F : depth_m; });
  return masked;
}

}  // namespace ygslam
