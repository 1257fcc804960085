// The static room as the library hands it out: made once, read by many.
#pragma once

#include <map>
#include <mutex>
#include <optional>

#include "dense/dense_map.hpp"
#include "scene/scene.hpp"
#include "ygslam/slam.hpp"

namespace ygslam::api {

struct Room::Impl {
  using Band = std::pair<double, double>;  ///< heights above the floor [m]

  std::int64_t t_ns = 0;
  Mesh mesh;
  std::vector<StaticObject> objects;
  SpaceCells space;
  Gravity gravity;
  mutable std::mutex mutex;
  mutable std::map<Band, OccupancyGrid> grids;  ///< made so far; under the mutex
};

/// Of the map as it is; with the plan of the usual heights.
[[nodiscard]] std::shared_ptr<const Room::Impl> make_room(DenseMap& map);
/// The ground plan as it is now. @param floor given, in place of one that is found.
[[nodiscard]] std::shared_ptr<const OccupancyGrid> make_plan(DenseMap& map,
                                                             const std::optional<Gravity>& floor);
/// What a room is made of besides.
[[nodiscard]] std::shared_ptr<const Room::Impl> make_room(StaticScene scene, std::int64_t t_ns);

}  // namespace ygslam::api
