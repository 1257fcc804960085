#include "simulation/world/rooms.hpp"

#include <algorithm>

namespace ygslam::sim {

namespace {

/// A wall seen from inside: start and direction run so that the inside is to the left of nothing:
/// normal = along x up points into the room.
struct Wall {
  Vec3f start;   // at the floor
  Vec3f along;   // unit
  Vec3f normal;  // unit, into the room
  float length_m;
  float coordinate_of_start;  // world coordinate along the wall at start
  float direction;            // +1 if the coordinate grows with `along`
};

Wall wall_of(const RoomPlan& plan, Side side) {
  const Eigen::Vector2f low = plan.low.cast<float>();
  const Eigen::Vector2f high = plan.high.cast<float>();
  const Eigen::Vector2f size = high - low;
  switch (side) {
    case Side::kSouth:
      return {{high.x(), low.y(), 0}, -Vec3f::UnitX(), Vec3f::UnitY(), size.x(), high.x(), -1};
    case Side::kNorth:
      return {{low.x(), high.y(), 0}, Vec3f::UnitX(), -Vec3f::UnitY(), size.x(), low.x(), 1};
    case Side::kWest:
      return {{low.x(), low.y(), 0}, Vec3f::UnitY(), Vec3f::UnitX(), size.y(), low.y(), 1};
    case Side::kEast:
      return {{high.x(), high.y(), 0}, -Vec3f::UnitY(), -Vec3f::UnitX(), size.y(), high.y(), -1};
  }
  return {};
}

struct Gap {
  float from, to, height;
};

void add_panel(Mesh& mesh, const Wall& wall, float from, float to, float low, float high,
               MaterialId material) {
  if (to - from < 1e-4F || high - low < 1e-4F) return;
  const auto first = mesh.uv.size();
  add_quad(mesh, wall.start + from * wall.along + Vec3f(0, 0, low), (to - from) * wall.along,
           Vec3f(0, 0, high - low), material);
  for (auto i = first; i < mesh.uv.size(); ++i) mesh.uv[i] += Vec2f(from, low);
}

void add_jambs(Mesh& mesh, const Wall& wall, const Gap& gap, float depth, MaterialId material) {
  const Vec3f out = -depth * wall.normal;
  const Vec3f up(0, 0, gap.height);
  const Vec3f left = wall.start + gap.from * wall.along;
  const Vec3f right = wall.start + gap.to * wall.along;
  add_quad(mesh, left + out, -out, up, material);
  add_quad(mesh, left, out, up, material);
  add_quad(mesh, right, out, up, material);
  add_quad(mesh, right + out, -out, up, material);
  add_quad(mesh, left + up, (gap.to - gap.from) * wall.along, out, material);
  add_quad(mesh, left + up + out, (gap.to - gap.from) * wall.along, -out, material);
  add_quad(mesh, left + out, (gap.to - gap.from) * wall.along, -out, material);  // threshold
}

void add_wall(Scene& scene, const RoomPlan& plan, Side side, MaterialId material) {
  const Wall wall = wall_of(plan, side);
  std::vector<Gap> gaps;
  for (const Opening& opening : plan.openings) {
    if (opening.side != side) continue;
    const auto local = [&](double coordinate) {
      return wall.direction * (static_cast<float>(coordinate) - wall.coordinate_of_start);
    };
    const float a = local(opening.from_m);
    const float b = local(opening.to_m);
    gaps.push_back({std::max(0.0F, std::min(a, b)), std::min(wall.length_m, std::max(a, b)),
                    static_cast<float>(std::min(opening.height_m, plan.height_m))});
  }
  std::sort(gaps.begin(), gaps.end(), [](const Gap& a, const Gap& b) { return a.from < b.from; });
  const auto height = static_cast<float>(plan.height_m);
  const MaterialId skirting = scene.materials.plain({130, 124, 116});
  const MaterialId frame = scene.materials.plain({190, 186, 176});
  float from = 0;
  const auto solid = [&](float to) {
    add_panel(scene.fixed, wall, from, to, 0.08F, height, material);
    add_panel(scene.fixed, wall, from, to, 0, 0.08F, skirting);
  };
  for (const Gap& gap : gaps) {
    solid(gap.from);
    add_panel(scene.fixed, wall, gap.from, gap.to, gap.height, height, material);
    add_jambs(scene.fixed, wall, gap, static_cast<float>(plan.wall_thickness_m) / 2, frame);
    from = gap.to;
  }
  solid(wall.length_m);
}

void add_lamps(Scene& scene, const RoomPlan& plan) {
  const Vec2 size = plan.high - plan.low;
  LightZone zone;
  const float margin = static_cast<float>(plan.wall_thickness_m) / 2;
  zone.low = plan.low.cast<float>().array() - margin;
  zone.high = plan.high.cast<float>().array() + margin;
  const MaterialId panel = scene.materials.get("light_panel");
  const double area_per_lamp = size.x() * size.y() / (plan.lamps_x * plan.lamps_y);
  for (int j = 0; j < plan.lamps_y; ++j) {
    for (int i = 0; i < plan.lamps_x; ++i) {
      const double x = plan.low.x() + size.x() * (i + 0.5) / plan.lamps_x;
      const double y = plan.low.y() + size.y() * (j + 0.5) / plan.lamps_y;
      AreaLight light;
      light.centre = Vec3(x, y, plan.height_m - 0.02).cast<float>();
      light.half_x_m = 0.6F;
      light.half_y_m = 0.15F;
      light.power =
          static_cast<float>(plan.brightness * std::clamp(0.16 * area_per_lamp, 0.5, 3.0));
      zone.lights.push_back(static_cast<std::uint16_t>(scene.lights.size()));
      scene.lights.push_back(light);
      add_picture(scene.fixed, light.centre + Vec3f(-light.half_x_m, light.half_y_m, 0),
                  {2 * light.half_x_m, 0, 0}, {0, -2 * light.half_y_m, 0}, panel);
    }
  }
  scene.zones.push_back(std::move(zone));
}

}  // namespace

void add_room(Scene& scene, const RoomPlan& plan) {
  const Vec3f low(static_cast<float>(plan.low.x()), static_cast<float>(plan.low.y()), 0);
  const Vec3f high(static_cast<float>(plan.high.x()), static_cast<float>(plan.high.y()),
                   static_cast<float>(plan.height_m));
  const Vec3f size = high - low;
  std::size_t first = scene.fixed.triangles.size();
  const auto name = [&](const char* class_name) {
    name_part(scene.fixed, first, class_name);
    first = scene.fixed.triangles.size();
  };
  add_quad(scene.fixed, low, {size.x(), 0, 0}, {0, size.y(), 0},
           scene.materials.get(plan.floor, plan.variant));
  name("floor");
  add_quad(scene.fixed, {low.x(), low.y(), high.z()}, {0, size.y(), 0}, {size.x(), 0, 0},
           scene.materials.get(plan.ceiling, plan.variant));
  name("ceiling");
  const MaterialId wall = scene.materials.get(plan.wall, plan.variant);
  for (const Side side : {Side::kWest, Side::kEast, Side::kSouth, Side::kNorth}) {
    add_wall(scene, plan, side, wall);
  }
  name("wall");
  add_lamps(scene, plan);
}

}  // namespace ygslam::sim
