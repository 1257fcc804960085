// What carries a table and what hangs from it, below a top that was found.
#pragma once

#include "scene/scene.hpp"

namespace ygslam {

struct TableLegsConfig {
  double beside_m = 0.1;          ///< around the top: so far legs may stand out
  double column_m = 0.05;         ///< what lies under the top is looked at by columns of this side
  double floor_m = 0.03;          ///< so low it is the floor's
  double stands_m = 0.2;          ///< what reaches lower stands on the floor, or may
  double thickest_leg_m = 0.16;   ///< either way
  double reach_m = 0.15;          ///< a leg is seen up to so near the top
  double upright_cos = 0.5;       ///< normals of legs and panels and up enclose more than this
  double seen_below_m = 0.15;     ///< so much air must have been seen below what hangs
  double seen_below_share = 0.5;  ///< of it
};

/// Names upright surfaces under a top that can be of nothing else: those with air below them, which
/// hang from it (panels), and thin ones that stand on the floor and reach up to it (legs). A
/// cabinet under it is neither.
/// @param top level box of the table's plate, z up. @param label of the table.
/// @param space where air was seen. @param mesh vertices without an object are given the label.
void name_under_top(const OrientedBox& top, const SurfaceLabel& label, const Gravity& gravity,
                    const SpaceCells& space, TriangleMesh& mesh,
                    const TableLegsConfig& config = {});

}  // namespace ygslam
