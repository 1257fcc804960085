#include "simulation/sequence/world_builder.hpp"

#include <algorithm>
#include <map>
#include <numbers>

#include "simulation/people/baked_bodies.hpp"
#include "simulation/people/person.hpp"
#include "simulation/sequence/true_objects.hpp"
#include "simulation/world/furniture.hpp"
#include "simulation/world/mover_motions.hpp"

namespace ygslam::sim {

namespace {

Mesh furniture_mesh(const FurnitureItem& item, MaterialLibrary& materials) {
  std::optional<Mesh> mesh = make_furniture(item.kind, item.variant, item.size_m, materials);
  CHECK(mesh.has_value(), item.kind.c_str());
  return std::move(*mesh);
}

RigidMotion motion_of(const MoverPlan& plan) {
  switch (plan.motion) {
    case MotionKind::kRoll: {
      const double radius_m = plan.thing.size_m ? plan.thing.size_m->x() / 2.0 : 0.11;
      return rolling_motion(plan.stations, radius_m);
    }
    case MotionKind::kHinge:
      return hinge_motion(plan.stations);
    default:
      return path_motion(plan.stations);
  }
}

/// A door turns about its left edge, not its middle.
Mesh mover_mesh(const MoverPlan& plan, MaterialLibrary& materials) {
  Mesh mesh = furniture_mesh(plan.thing, materials);
  if (plan.motion != MotionKind::kHinge) return mesh;
  float low_x = 0;
  for (const Vec3f& p : mesh.points) low_x = std::min(low_x, p.x());
  for (Vec3f& p : mesh.points) p.x() -= low_x;
  return mesh;
}

/// Where a thing is that a person holds: before the chest, or on the floor in front.
SE3 held_pose(const Person& person, const MoverPlan& plan, double t_s) {
  const double clamped_s = std::clamp(t_s, plan.from_s, plan.until_s);
  const bool pushed = plan.motion == MotionKind::kPush;
  const Vec3 in_front = pushed ? Vec3(0.62, 0, 0) : Vec3(0.40, 0, 1.02);
  // Furniture faces -y; held, its back is towards the person.
  return person.T_world_body(clamped_s) * SE3(so3_exp(Vec3(0, 0, std::numbers::pi / 2)), in_front);
}

struct Cast {
  std::map<std::string, std::shared_ptr<const Person>> by_name;
};

/// People get ids after all things, so that leaving people out changes no id.
Status add_people(Scene& scene, const WorldConfig& world, const BuildOptions& options, Cast& cast) {
  if (world.people.empty() || options.without_people) return Ok{};
  Result<BodyModel> baked = baked_bodies();
  if (!baked) return baked.error();
  const auto model = std::make_shared<const BodyModel>(std::move(*baked));
  std::size_t id = world.movers.size();
  for (const PersonPlan& plan : world.people) {
    ++id;
    std::vector<HoldingTime> holding;
    for (const MoverPlan& mover : world.movers) {
      if (mover.person == plan.name)
        holding.push_back({mover.from_s, mover.until_s, mover.motion == MotionKind::kPush});
    }
    auto person = std::make_shared<const Person>(model, plan, options.seed * 131U + id,
                                                 std::move(holding), scene.materials);
    Mover mover;
    mover.name = plan.name.empty() ? "person" + std::to_string(id) : plan.name;
    mover.class_name = "person";
    mover.instance_id = static_cast<std::uint8_t>(id);
    mover.body = person;
    cast.by_name[plan.name] = person;
    scene.movers.push_back(std::move(mover));
  }
  return Ok{};
}

}  // namespace

Result<std::shared_ptr<const Scene>> build_world(const WorldConfig& world,
                                                 const BuildOptions& options) {
  auto scene = std::make_shared<Scene>();
  scene->materials = MaterialLibrary(options.texture_size);
  scene->ambient = static_cast<float>(world.ambient);
  for (const RoomPlan& room : world.rooms) add_room(*scene, room);
  for (const FurnitureItem& item : world.furniture) {
    append(scene->fixed, furniture_mesh(item, scene->materials), placed(item.at, item.yaw_deg));
  }
  if (world.movers.size() + world.people.size() > 255) {
    return Error{ErrorKind::kInput, world.name + ": more than 255 movers"};
  }
  Cast cast;
  if (Status status = add_people(*scene, world, options, cast); !status) return status.error();
  std::size_t id = 0;
  for (const MoverPlan& plan : world.movers) {
    ++id;  // ids do not depend on what is left out
    const bool held = !plan.person.empty();
    if (options.without_movers || (held && options.without_people)) continue;
    Mover mover;
    mover.name = plan.name.empty() ? plan.class_name + std::to_string(id) : plan.name;
    mover.class_name = plan.class_name;
    mover.instance_id = static_cast<std::uint8_t>(id);
    mover.mesh = mover_mesh(plan, scene->materials);
    if (held) {
      mover.T_world_object = [person = cast.by_name.at(plan.person), plan](double t_s) {
        return held_pose(*person, plan, t_s);
      };
    } else {
      mover.T_world_object = motion_of(plan);
    }
    scene->movers.push_back(std::move(mover));
  }
  number_things(*scene);
  scene->materials.paint(options.threads);
  return std::shared_ptr<const Scene>(std::move(scene));
}

}  // namespace ygslam::sim
