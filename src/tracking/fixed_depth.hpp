// Depth that stays at its pixels while the scene goes on.
#pragma once

#include <deque>

#include "image/image.hpp"
#include "tracking/fixed_edges.hpp"

namespace ygslam {

/// By the cells of FixedEdges.
class FixedDepth {
 public:
  /// Of each sample in turn.
  void step(const DepthImage& depth_m, const FixedEdges& edges);

  /// It stayed while that of the scene changed.
  [[nodiscard]] bool is_fixed(int u, int v) const { return score_.at(u, v) >= FixedEdges::kFixed; }
  /// It was the same in the last samples that showed the same edges, whatever came before them in
  /// between and whatever the scene does.
  [[nodiscard]] bool stands(int u, int v) const { return stood_.at(u, v) >= kStands; }
  /// What it is then; 0 = none.
  [[nodiscard]] float shown_m(int u, int v) const { return shown_m_.at(u, v); }
  /// What is seen there moves on at about its depth [m]; 0 = it does not, or something passed.
  [[nodiscard]] float passing_m(int u, int v) const { return passing_m_.at(u, v); }
  /// As it was first seen; 0 = none.
  [[nodiscard]] float depth_m(int u, int v) const { return reference_m_.at(u, v); }
  /// Median [m] of where the image moved; 0 = not known.
  [[nodiscard]] float scene_m() const { return scene_m_; }

 private:
  void see_again(float now_m, std::size_t cell);
  void look_at_scene(const DepthImage& now_m, const FixedEdges& edges);

  static constexpr int kStands = 2;           // samples
  static constexpr std::size_t kSamples = 6;  // over which a depth should change

  DepthImage reference_m_;            // of each cell
  std::deque<DepthImage> earlier_m_;  // of the last samples, oldest first
  GreyImage score_, stood_;           // stood_: samples
  DepthImage shown_m_, passing_m_;
  /// Whether depth tells the camera from the scene: where the image moved, it mostly changed over
  /// the last samples. Along a wall it does not.
  bool tells_ = false;
  float scene_m_ = 0;
};

}  // namespace ygslam
