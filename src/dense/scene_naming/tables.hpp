// Tables, which stand in every room and which networks seldom name: found by their tops.
#pragma once

#include <span>
#include <vector>

#include "dense/scene_naming/table_legs.hpp"
#include "scene/scene.hpp"

namespace ygslam {

struct TableConfig {
  double low_m = 0.62, high_m = 0.85;  ///< of its top, above the floor
  double min_m2 = 0.2;                 ///< of level surface
  double least_part_m2 = 0.004;        ///< of it that hangs together
  double min_width_m = 0.4;
  double min_seen_share = 0.25;  ///< of the rectangle around it
  double thickness_m = 0.06;     ///< below its top: what bounds it is of the table
  double margin_m = 0.02;        ///< around and above its top: the same
  float probability = 0.75F;     ///< that something level, so high and so large is one
  double max_hidden_m = 0.4;     ///< between its parts: strips that what stands on it hides
  TableLegsConfig legs = {};
  double min_share_in = 0.3;  ///< of a top in the box of a table that a network named
  double whole_share = 0.7;   ///< of such a top that masks call a table: they show all of it
};

/// Numbers of these tables go down from here: those of what a network named go up.
inline constexpr SceneObjectId kFirstTable{0xfffd};

/// Level surfaces of the height and size of a table, where nothing was named but tables: one that
/// lies in the box of a named table is of that table, any other is a table that stands there. Where
/// masks show whole_share of its top or more, the rest of the top is left as it is.
/// @param mesh its vertices without an object are given to the tables they belong to.
/// @param space where air was seen, which tells what hangs under a table; empty: nothing does.
/// @return the tables that nobody named, with boxes down to the floor; their views and times are
/// the caller's to fill in.
[[nodiscard]] std::vector<SceneObject> find_tables(TriangleMesh& mesh, const Gravity& gravity,
                                                   std::span<const SceneObject> objects,
                                                   const SpaceCells& space,
                                                   const TableConfig& config = {});

}  // namespace ygslam
