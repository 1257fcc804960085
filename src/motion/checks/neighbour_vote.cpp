#include "motion/checks/neighbour_vote.hpp"

namespace ygslam {
namespace {

// Closer points are the same corner on another pyramid level and err together.
constexpr float kSameCorner_px2 = 36;

}  // namespace

std::vector<std::int32_t> vote_of_neighbours(const Features& features,
                                             std::span<const std::int32_t> nearest,
                                             std::span<const std::uint8_t> moves,
                                             const FlowField& field, double majority) {
  CHECK(nearest.size() == features.size());
  std::vector<std::int32_t> result(nearest.begin(), nearest.end());
  for (std::size_t i = 0; i < result.size(); ++i)
    if (result[i] < 0)
      result[i] = field.majority_of_neighbours(features.points[i], majority,
                                               [&](std::uint32_t k) { return moves[k] ? 1 : 0; });
  return result;
}

std::vector<float> moving_share(std::span<const std::uint8_t> moves, const FlowField& field) {
  std::vector<float> share(moves.size(), -1.0F);
  for (std::size_t i = 0; i < share.size(); ++i) {
    if (!moves[i] || !field.reliable(i)) continue;
    int neighbours = 0;
    float total = 0;
    float moving = 0;
    field.neighbours_of(i, [&](std::uint32_t k, float distance2_px2) {
      if (distance2_px2 < kSameCorner_px2) return;
      const float weight = FlowField::vote_weight(distance2_px2);
      ++neighbours;
      total += weight;
      moving += moves[k] ? weight : 0.0F;
    });
    if (neighbours >= 2) share[i] = moving / total;
  }
  return share;
}

}  // namespace ygslam
