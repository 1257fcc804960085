// A room nobody drew: walls, furniture, clutter.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/rng.hpp"
#include "image/image.hpp"
#include "simulation/people/body_model.hpp"
#include "simulation/render/scene.hpp"
#include "simulation/world/rooms.hpp"

namespace ygslam::sim {

/// Draws everything that stands still, and remembers where the floor is taken.
class RandomRoom {
 public:
  /// All of it must outlive this.
  /// @param album pictures with people in them, for posters and screens; may be empty.
  RandomRoom(Scene& scene, const BodyModel& baked, const std::vector<ColourImage>& album, Rng& rng)
      : scene_(scene), baked_(baked), album_(album), rng_(rng) {}

  void add_walls();
  void furnish();
  /// A place on the floor that is free within a radius.
  [[nodiscard]] bool is_free(const Vec2& at, double radius_m) const;
  [[nodiscard]] Vec2 somewhere();
  [[nodiscard]] const RoomPlan& room() const { return room_; }
  /// Middles of what is cluttered; at least one.
  [[nodiscard]] const std::vector<Vec3>& cluttered_world() const { return cluttered_world_; }

 private:
  void put(const std::string& kind, const Vec3& at, double yaw_deg,
           const std::optional<Vec3f>& size_m = {});
  [[nodiscard]] double uniform(double low, double high) { return rng_.uniform(low, high); }
  [[nodiscard]] int variant() { return static_cast<int>(rng_.below(40)); }
  [[nodiscard]] Vec3f size(double x0, double x1, double y0, double y1, double z0, double z1);
  /// A place at a wall for something this deep. @return yaw [deg].
  double wall_place(double off_m, Vec2& at);
  void add_at_wall();
  void stand(const std::string& kind, const Vec3f& s);
  void add_inside();
  /// A counter, a table or a piece of floor with small things all over it.
  void add_cluttered();
  /// Rods, balls and boxes; some as tall and as thick as people.
  void add_shape();
  void add_coat();
  void add_picture_of_people(const ColourImage& picture);
  void take(const Vec2& at, double radius_m) { taken_.emplace_back(at, radius_m); }

  Scene& scene_;
  const BodyModel& baked_;
  const std::vector<ColourImage>& album_;
  Rng& rng_;
  RoomPlan room_;
  std::vector<std::pair<Vec2, double>> taken_;
  std::vector<Vec3> cluttered_world_;
};

}  // namespace ygslam::sim
