#include "tracking/fixed_depth.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/statistics.hpp"
#include "image/depth.hpp"

namespace ygslam {
namespace {

constexpr float kPassing = 0.1F;  // of its depth: a larger step is of another surface

/// As far as a Kinect's noise tells.
bool is_same(float a_m, float b_m) {
  constexpr double kSigmas = 3, kLeast_m = 0.01;
  const double sigma_m = std::sqrt(2.0) * kinect_depth_sigma_m(std::max(a_m, b_m));
  return std::abs(a_m - b_m) <= std::max(kLeast_m, kSigmas * sigma_m);
}

/// Of a cell: of its middle or, where that has none, about it.
float cell_depth_m(const DepthImage& depth_m, int u, int v, int reach_px) {
  for (const auto& [du, dv] : {std::pair{0, 0}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}) {
    const int x = u + du * reach_px, y = v + dv * reach_px;
    if (depth_m.contains(x, y) && depth_m.at(x, y) > 0) return depth_m.at(x, y);
  }
  return 0;
}

DepthImage cell_depths_m(const DepthImage& depth_m, const FixedEdges& edges) {
  DepthImage cells_m(edges.cells().width(), edges.cells().height());
  if (depth_m.empty()) return cells_m;
  const int side_px = FixedEdges::kCell_px * edges.scale();
  for (int v = 0; v < cells_m.height(); ++v)
    for (int u = 0; u < cells_m.width(); ++u)
      cells_m.at(u, v) =
          cell_depth_m(depth_m, u * side_px + side_px / 2, v * side_px + side_px / 2, side_px / 4);
  return cells_m;
}

}  // namespace

void FixedDepth::step(const DepthImage& depth_m, const FixedEdges& edges) {
  DepthImage now_m = cell_depths_m(depth_m, edges);
  if (!reference_m_.same_size(now_m)) {
    reference_m_ = DepthImage(now_m.width(), now_m.height());
    earlier_m_.clear();
    passing_m_ = shown_m_ = reference_m_;
    score_ = stood_ = GreyImage(now_m.width(), now_m.height());
  }
  look_at_scene(now_m, edges);
  for (std::size_t i = 0; i < now_m.size(); ++i) {
    if (edges.cells().data()[i].shows_the_same()) see_again(now_m.data()[i], i);
    float& reference_m = reference_m_.data()[i];
    std::uint8_t& score = score_.data()[i];
    const float m = now_m.data()[i];
    if (score == 0) reference_m = m;
    if (reference_m <= 0) continue;
    if (m > 0 && is_same(m, reference_m)) {
      if (tells_) score = std::min<int>(score + FixedEdges::kGain, FixedEdges::kMost);
    } else {
      score = std::max<int>(score - (m > 0 ? FixedEdges::kLoss : 1), 0);
    }
  }
  earlier_m_.push_back(std::move(now_m));
  if (earlier_m_.size() > kSamples) earlier_m_.pop_front();
}

void FixedDepth::see_again(float now_m, std::size_t cell) {
  constexpr int kMost = 8, kLoss = 2;
  float& shown_m = shown_m_.data()[cell];
  std::uint8_t& stood = stood_.data()[cell];
  const bool is_alike = now_m > 0 && shown_m > 0 && is_same(now_m, shown_m);
  stood = static_cast<std::uint8_t>(std::clamp(stood + (is_alike ? 1 : -kLoss), 0, kMost));
  if (now_m > 0 && stood == 0) shown_m = now_m;
}

void FixedDepth::look_at_scene(const DepthImage& now_m, const FixedEdges& edges) {
  std::vector<float> moved_m;
  int same = 0;
  for (std::size_t i = 0; i < now_m.size(); ++i) {
    const float m = now_m.data()[i];
    const float earlier_m = earlier_m_.empty() ? 0 : earlier_m_.front().data()[i];
    const float last_m = earlier_m_.empty() ? 0 : earlier_m_.back().data()[i];
    const bool moves = m > 0 && edges.cells().data()[i].moved();
    passing_m_.data()[i] = moves && std::abs(m - last_m) < kPassing * m ? m : 0;
    if (!moves) continue;
    moved_m.push_back(m);
    if (earlier_m > 0 && is_same(m, earlier_m)) ++same;
  }
  constexpr std::size_t kLeast = 30;
  if (moved_m.size() >= kLeast) scene_m_ = median(moved_m);
  tells_ = moved_m.size() >= kLeast && earlier_m_.size() == kSamples &&
           2 * same < static_cast<int>(moved_m.size());
}

}  // namespace ygslam
