// Looks at space from one view: which cells its surface lies in, and which it saw through.
#pragma once

#include <vector>

#include "geometry/se3.hpp"
#include "volume/prepared_view.hpp"
#include "volume/seen_space.hpp"

namespace ygslam {

struct SpaceConfig {
  double cell_m = 0.05;
  double margin_sigmas = 3;   ///< a cell is seen through if the depth lies farther behind it than
  double margin_cells = 0.5;  ///< this, and than this
};

/// Reusable: it keeps the memory of the view before.
class SpaceScan {
 public:
  SpaceScan(const SpaceConfig& config, const DepthNoise& noise);

  /// All depth carves, only pixels with a weight hit.
  /// @return until the next call.
  [[nodiscard]] const SeenSpace& step(const PreparedView& view, const SE3& T_world_camera,
                                      int threads);

 private:
  void find_hits(const PreparedView& view, const SE3& T_world_camera);
  void find_visible(const PreparedView& view, const SE3& T_world_camera);

  SpaceConfig config_;
  DepthNoise noise_;
  BlockSet touched_;
  BlockStore<CellMask> hit_cells_;
  std::vector<CellMask> through_;
  SeenSpace seen_;
};

}  // namespace ygslam
