// What carries a table and what hangs from it, below a top that was found.
#pragma once

#include "scene/scene.hpp"

namespace ygslam {

struct TableLegsConfig {
  double panel_beside_m = 0.25;  ///< around what was seen of the top, of which a part is hidden
  double leg_beside_m = 0.1;     ///< the same of legs
  double above_m = 0.15;         ///< the top: what goes on there is none of the table's
  double plate_m = 0.03;         ///< above the top's box: still the top's own noise
  double column_m = 0.05;        ///< what lies under the top is looked at by columns of this side
  double min_height_m = 0.03;    ///< lower it is the floor's
  double stands_m = 0.2;         ///< what reaches lower stands on the floor, or may
  double thickest_leg_m = 0.16;  ///< either way
  double reach_m = 0.15;         ///< a leg is seen up to so near the top
  double upright_cos = 0.5;      ///< most of it between the normals of legs and panels and up
  double seen_below_m = 0.15;    ///< below what hangs so much was looked through
  double free_share = 0.5;       ///< more of what lies below must be air, less of what lies above
};

/// Names upright surfaces under a top and around it that are most likely the table's: those with
/// air below and none up to the top's height, which hang from it (panels), and thin ones that stand
/// on the floor and reach up to it (legs). A cabinet under it is neither.
/// @param top level box of the table's plate, z up. @param label of the table.
/// @param space where air was seen; empty: nothing hangs.
/// @param mesh vertices without an object are given the label.
void name_under_top(const OrientedBox& top, const SurfaceLabel& label, const Gravity& gravity,
                    const SpaceCells& space, const TableLegsConfig& config, TriangleMesh& mesh);

}  // namespace ygslam
