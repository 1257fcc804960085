#include "motion/checks/neighbour_vote.hpp"

#include <array>

namespace ygslam {
namespace {

// Closer points are the same corner on another pyramid level and err together.
constexpr float kSameCornerPx2 = 36;

std::int32_t elect(const Feature& feature, std::span<const std::uint8_t> moves,
                   const FlowField& field, double majority) {
  std::array<float, 2> votes{};  // standing, moving
  std::array<float, 2> best{};
  std::array<std::int32_t, 2> choice{-1, -1};
  field.neighbours(feature, [&](std::uint32_t k, float distance2_px2) {
    const std::size_t side = moves[k] ? 1 : 0;
    const float weight = vote_weight(distance2_px2);
    votes[side] += weight;
    if (weight <= best[side]) return;
    best[side] = weight;
    choice[side] = static_cast<std::int32_t>(k);
  });
  const std::size_t side = votes[1] > votes[0] ? 1 : 0;
  return votes[side] >= majority * (votes[0] + votes[1]) ? choice[side] : -1;
}

}  // namespace

std::vector<std::int32_t> vote_of_neighbours(const Features& features,
                                             std::span<const std::int32_t> nearest,
                                             std::span<const std::uint8_t> moves,
                                             const FlowField& field, double majority) {
  CHECK(nearest.size() == features.size());
  std::vector<std::int32_t> result(nearest.begin(), nearest.end());
  for (std::size_t i = 0; i < result.size(); ++i)
    if (result[i] < 0) result[i] = elect(features.points[i], moves, field, majority);
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
      if (distance2_px2 < kSameCornerPx2) return;
      const float weight = vote_weight(distance2_px2);
      ++neighbours;
      total += weight;
      moving += moves[k] ? weight : 0.0F;
    });
    if (neighbours >= 2) share[i] = moving / total;
  }
  return share;
}

}  // namespace ygslam
