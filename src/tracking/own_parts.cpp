#include "tracking/own_parts.hpp"

#include <array>

namespace ygslam {
namespace {

/// Per id of the masks: how many pixels it has, and how many of them are not of the world.
struct PixelCounts {
  std::array<int, 256> all{}, own{};
};

PixelCounts count(const GreyImage& ids, const GreyImage& pixels) {
  PixelCounts counts;
  for (int v = 0; v < ids.height(); ++v) {
    const std::uint8_t* row = pixels.row(v * pixels.height() / ids.height());
    for (int u = 0; u < ids.width(); ++u) {
      const std::uint8_t id = ids.at(u, v);
      ++counts.all[id];
      if (row[u * pixels.width() / ids.width()] != 0) ++counts.own[id];
    }
  }
  return counts;
}

}  // namespace

SegmentationPtr without_own_parts(const SegmentationPtr& masks, const PixelMaskPtr& pixels) {
  if (!masks || !pixels || masks->instances.empty() || masks->ids.empty()) return masks;
  const PixelCounts counts = count(masks->ids, *pixels);
  auto kept = std::make_shared<Segmentation>(*masks);
  kept->instances.clear();
  std::array<std::uint8_t, 256> new_id{};
  for (std::size_t i = 0; i < masks->instances.size(); ++i) {
    if (2 * counts.own[i + 1] > counts.all[i + 1]) continue;
    kept->instances.push_back(masks->instances[i]);
    new_id[i + 1] = static_cast<std::uint8_t>(kept->instances.size());
  }
  if (kept->instances.size() == masks->instances.size()) return masks;
  for (std::uint8_t& id : kept->ids) id = new_id[id];
  return kept;
}

}  // namespace ygslam
