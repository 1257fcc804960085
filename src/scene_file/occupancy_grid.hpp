// The ground plan for a robot that drives: which places are free, which are not, which nobody saw.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "scene/scene.hpp"

namespace ygslam {

/// Heights are above the floor.
struct GridOptions {
  double obstacle_min_m = 0.10;  ///< what is lower can be driven over
  double obstacle_max_m = 1.50;  ///< what is higher can be driven under
  double floor_seen_m = 0.30;    ///< air seen free below this vouches for the floor under it
};

/// map_server's shades.
inline constexpr std::uint8_t kGridOccupied = 0, kGridUnknown = 205, kGridFree = 254;

/// In the floor's frame (scene/floor_frame.hpp), which is the grid's map frame.
struct OccupancyGrid {
  GreyImage shades;  ///< row 0 has the largest y; a single unknown pixel where nothing is known
  double resolution_m = 0.05;
  Vec2 origin_floor = Vec2::Zero();  ///< lower left corner of the lower left pixel
  SE3 T_world_floor;
};

/// A place is occupied where an occupied cell lies between the two heights; else free where the
/// floor was seen, or free space just above it; else unknown. The ceiling is no obstacle, nor is
/// the floor, however bumpy it came out below floor_seen_m.
/// @return kOutput where the plan would have more than 2^26 pixels.
[[nodiscard]] Result<OccupancyGrid> make_occupancy_grid(const SpaceCells& space,
                                                        const Gravity& gravity,
                                                        const GridOptions& options = {});

/// Writes FILE.pgm and FILE.yaml as ROS' map_server reads them. @param yaml names FILE.yaml.
/// @return kOutput naming the file.
Status write_occupancy_grid(const std::filesystem::path& yaml, const OccupancyGrid& grid);

}  // namespace ygslam
