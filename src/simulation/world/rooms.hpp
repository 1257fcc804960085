// Floors, walls with openings, ceilings and their lamps.
#pragma once

#include <string>
#include <vector>

#include "simulation/render/scene.hpp"

namespace ygslam::sim {

enum class Side { kWest, kEast, kSouth, kNorth };  ///< low x, high x, low y, high y

/// A doorway or passage in a wall.
struct Opening {
  Side side = Side::kSouth;
  double from_m = 0;  ///< along the wall, world coordinate
  double to_m = 1;
  double height_m = 2.1;
};

struct RoomPlan {
  Vec2 low = Vec2(-4, -4);  ///< [m] inner corners
  Vec2 high = Vec2(4, 4);
  double height_m = 2.8;
  std::string wall = "plaster";
  std::string floor = "carpet";
  std::string ceiling = "ceiling";
  int variant = 0;
  double wall_thickness_m = 0.1;  ///< of the jambs seen in openings, half per room
  int lamps_x = 2;
  int lamps_y = 2;
  double brightness = 1;
  std::vector<Opening> openings;
};

/// Adds the room's surfaces, lamps and light zone to the scene.
void add_room(Scene& scene, const RoomPlan& plan);

}  // namespace ygslam::sim
