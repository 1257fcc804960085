// What the library's callers read of the map while its threads make it.
#pragma once

#include <memory>

#include "core/published.hpp"
#include "facade/room.hpp"
#include "map/map.hpp"

namespace ygslam::api {

/// Written by the mapping and the dense thread, read by anyone at once.
class PublishedMap {
 public:
  /// Keyframes and landmarks.
  void show(const Map& map);
  void show(std::shared_ptr<const Room::Impl> room) { room_.store(std::move(room)); }
  void show(std::shared_ptr<const OccupancyGrid> plan) { plan_.store(std::move(plan)); }
  void forget_room() {
    room_.store(std::make_shared<const Room::Impl>());
    plan_.store(std::make_shared<const OccupancyGrid>());
  }

  [[nodiscard]] Room room() const { return Room(room_.load()); }
  [[nodiscard]] std::shared_ptr<const OccupancyGrid> plan() const { return plan_.load(); }
  [[nodiscard]] MapSnapshot map() const;

 private:
  struct Sparse {
    SharedList<StampedPose> keyframes;
    SharedList<std::array<float, 3>> landmarks_world_m;
  };
  Published<Sparse> sparse_{std::make_shared<const Sparse>()};
  Published<Room::Impl> room_{std::make_shared<const Room::Impl>()};
  Published<OccupancyGrid> plan_{std::make_shared<const OccupancyGrid>()};
};

}  // namespace ygslam::api
