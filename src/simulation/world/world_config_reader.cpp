#include "simulation/world/world_config_reader.hpp"

#include <algorithm>
#include <map>

#include "simulation/embedded_files.hpp"
#include "simulation/world/furniture.hpp"

namespace ygslam::sim {

namespace {

template <typename T>
void read_choice(YamlMap& map, const std::string& key, const std::map<std::string, T>& choices,
                 T& value) {
  if (!map.has(key)) return;
  std::string name;
  map.read(key, name);
  const auto found = choices.find(name);
  if (found == choices.end()) {
    std::string known;
    for (const auto& [choice, unused] : choices) known += (known.empty() ? "" : ", ") + choice;
    throw map.fault(map.node(key), "'" + name + "' is no " + key + " (known: " + known + ")");
  }
  value = found->second;
}

void read_material(YamlMap& map, const std::string& key, std::string& kind) {
  if (!map.has(key)) return;
  map.read(key, kind);
  const auto& kinds = material_kinds();
  if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end()) {
    std::string known;
    for (const std::string& name : kinds) known += (known.empty() ? "" : ", ") + name;
    throw map.fault(map.node(key), "'" + kind + "' is no material (known: " + known + ")");
  }
}

void read_furniture_keys(YamlMap& map, FurnitureItem& item) {
  map.read("kind", item.kind);
  const auto& kinds = furniture_kinds();
  if (std::find(kinds.begin(), kinds.end(), item.kind) == kinds.end()) {
    std::string known;
    for (const std::string& name : kinds) known += (known.empty() ? "" : ", ") + name;
    throw map.fault(map.node("kind"), "'" + item.kind + "' is no furniture (known: " + known + ")");
  }
  map.read("variant", item.variant, 0, kMostVariants);
  if (map.has("size")) {
    const Vec3 size = map.vector<3>(map.node("size"), "size");
    if (size.minCoeff() < 1e-3 || size.maxCoeff() > 100)
      throw map.fault(map.node("size"), "'size' is 0.001 to 100 m");
    item.size_m = size.cast<float>();
  }
}

FurnitureItem read_furniture(const YAML::Node& node, const std::string& source) {
  YamlMap map(node, source);
  FurnitureItem item;
  read_furniture_keys(map, item);
  map.read("at", item.at);
  map.read("yaw", item.yaw_deg);
  map.finish();
  return item;
}

RoomPlan read_room(const YAML::Node& node, const std::string& source) {
  YamlMap map(node, source);
  RoomPlan room;
  map.read("low", room.low);
  map.read("high", room.high);
  if ((room.high - room.low).minCoeff() <= 0.1) throw map.fault(node, "a room needs low < high");
  map.read("height", room.height_m);
  if (room.height_m < 1 || room.height_m > 20) throw map.fault(node, "'height' is 1 to 20 m");
  read_material(map, "wall", room.wall);
  read_material(map, "floor", room.floor);
  read_material(map, "ceiling", room.ceiling);
  map.read("variant", room.variant, 0, kMostVariants);
  map.read("brightness", room.brightness, decltype(room.brightness){0},
           decltype(room.brightness){100});
  if (map.has("lamps")) {
    const Vec2 lamps = map.vector<2>(map.node("lamps"), "lamps");
    if (lamps.minCoeff() < 1 || lamps.maxCoeff() > 4 || lamps.prod() > 8) {
      throw map.fault(map.node("lamps"), "'lamps' are 1 to 4 in each direction, at most 8");
    }
    room.lamps_x = static_cast<int>(lamps.x());
    room.lamps_y = static_cast<int>(lamps.y());
  }
  for (const YAML::Node& entry : map.list("openings")) {
    YamlMap gap(entry, source);
    Opening opening;
    read_choice<Side>(gap, "side",
                      {{"west", Side::kWest},
                       {"east", Side::kEast},
                       {"south", Side::kSouth},
                       {"north", Side::kNorth}},
                      opening.side);
    gap.read("from", opening.from_m);
    gap.read("to", opening.to_m);
    gap.read("height", opening.height_m);
    gap.finish();
    if (opening.from_m >= opening.to_m) throw gap.fault(entry, "an opening needs from < to");
    if (opening.height_m <= 0) throw gap.fault(entry, "the 'height' of an opening is positive");
    room.openings.push_back(opening);
  }
  map.finish();
  return room;
}

void read_camera(const YAML::Node& node, const std::string& source, CameraPathConfig& camera) {
  YamlMap map(node, source);
  read_choice<PathKind>(map, "path",
                        {{"static", PathKind::kStatic},
                         {"xyz", PathKind::kXyz},
                         {"rpy", PathKind::kRpy},
                         {"halfsphere", PathKind::kHalfsphere},
                         {"walk", PathKind::kWalk},
                         {"drive", PathKind::kDrive}},
                        camera.kind);
  const bool has_waypoints = camera.kind == PathKind::kWalk || camera.kind == PathKind::kDrive;
  if (camera.kind == PathKind::kDrive) camera.jerk = 0;  // no hand holds the camera
  map.read("at", camera.at);
  map.read("look_at", camera.look_at);
  map.read("jerk", camera.jerk, 0.0, 10.0);
  map.read("closed", camera.closed);
  PathSpeed speed;
  map.read("speed", speed.translation_mps, 0.0, 10.0);
  map.read("turning", speed.rotation_deg_per_s, 0.0, 720.0);
  if (map.has("speed")) camera.speed = speed;
  for (const YAML::Node& entry : map.list("waypoints"))
    camera.waypoints.push_back(map.vector<3>(entry, "waypoints"));
  for (const YAML::Node& entry : map.list("kidnaps")) {
    YamlMap k(entry, source);
    Kidnap kidnap;
    k.read("from", kidnap.from_s);
    k.read("until", kidnap.until_s);
    k.read("at", kidnap.at);
    k.read("look_at", kidnap.look_at);
    k.finish();
    if (kidnap.from_s < 0 || kidnap.until_s <= kidnap.from_s)
      throw k.fault(entry, "a kidnap needs 0 <= from < until");
    camera.kidnaps.push_back(kidnap);
  }
  map.finish();
  if (has_waypoints && camera.waypoints.size() < 2)
    throw map.fault(node, "a walk or drive needs at least two waypoints");
  for (std::size_t i = 1; i < camera.waypoints.size(); ++i) {
    if ((camera.waypoints[i] - camera.waypoints[i - 1]).norm() < 1e-3)
      throw map.fault(node, "two waypoints in a row lie at the same place");
  }
  if ((camera.look_at - camera.at).head<2>().norm() < 1e-3)
    throw map.fault(node, "'look_at' must not lie above or below 'at'");
}

void read_intrinsics(const YAML::Node& node, const std::string& source, CameraConfig& c) {
  YamlMap map(node, source);
  map.read("fx", c.fx);
  map.read("fy", c.fy);
  map.read("cx", c.cx);
  map.read("cy", c.cy);
  map.read("k1", c.k1);
  map.read("k2", c.k2);
  map.read("p1", c.p1);
  map.read("p2", c.p2);
  map.read("k3", c.k3);
  map.read("width", c.width);
  map.read("height", c.height);
  map.finish();
  if (c.fx <= 0 || c.fy <= 0) throw map.fault(node, "focal lengths must be positive");
  if (c.width < 16 || c.height < 16 || c.width > 4096 || c.height > 4096)
    throw map.fault(node, "image size is 16 to 4096");
}

MoverPlan read_mover(const YAML::Node& node, const std::string& source) {
  YamlMap map(node, source);
  MoverPlan plan;
  map.read("name", plan.name);
  read_furniture_keys(map, plan.thing);
  plan.class_name = plan.thing.kind;
  map.read("class", plan.class_name);
  read_choice<MotionKind>(map, "motion",
                          {{"path", MotionKind::kPath},
                           {"roll", MotionKind::kRoll},
                           {"hinge", MotionKind::kHinge},
                           {"carry", MotionKind::kCarry},
                           {"push", MotionKind::kPush}},
                          plan.motion);
  map.read("person", plan.person);
  map.read("from", plan.from_s);
  map.read("until", plan.until_s);
  for (const YAML::Node& entry : map.list("stations")) {
    YamlMap s(entry, source);
    Waypoint station;
    s.read("t", station.t_s);
    s.read("at", station.at);
    s.read("yaw", station.yaw_deg);
    s.finish();
    if (!plan.stations.empty() && station.t_s <= plan.stations.back().t_s)
      throw s.fault(entry, "stations must be in order of time");
    plan.stations.push_back(station);
  }
  map.finish();
  if (plan.from_s > plan.until_s) throw map.fault(node, "a mover needs from <= until");
  const bool needs_person = plan.motion == MotionKind::kCarry || plan.motion == MotionKind::kPush;
  if (needs_person && plan.person.empty()) throw map.fault(node, "carry and push need a 'person'");
  if (!needs_person && plan.stations.empty()) throw map.fault(node, "a mover needs 'stations'");
  return plan;
}

PersonAction read_action(const YAML::Node& node, const std::string& source) {
  YamlMap map(node, source);
  PersonAction action;
  read_choice<ActionKind>(
      map, "do",
      {{"walk", ActionKind::kWalk}, {"stand", ActionKind::kStand}, {"sit", ActionKind::kSit}},
      action.kind);
  for (const YAML::Node& entry : map.list("via")) action.via.push_back(map.vector<2>(entry, "via"));
  map.read("speed", action.speed_mps, 0.2, 2.2);
  map.read("seconds", action.seconds, 0.0, kMost);
  map.read("seat", action.seat);
  map.read("seat_height", action.seat_m, 0.1, 1.5);
  map.read("yaw", action.yaw_deg);
  read_choice<std::string>(map, "gesture",
                           {{"none", ""},
                            {"talk", "talk"},
                            {"wave", "wave"},
                            {"point", "point"},
                            {"type", "type"},
                            {"drink", "drink"},
                            {"phone", "phone"}},
                           action.gesture);
  map.finish();
  if (action.kind == ActionKind::kWalk && action.via.empty())
    throw map.fault(node, "a walk needs 'via' points");
  return action;
}

PersonPlan read_person(const YAML::Node& node, const std::string& source) {
  YamlMap map(node, source);
  PersonPlan plan;
  map.read("name", plan.name);
  map.read("body", plan.body, 0, kBodies - 1);
  read_material(map, "top", plan.top);
  read_material(map, "bottom", plan.bottom);
  map.read("top_variant", plan.top_variant, 0, kMostVariants);
  map.read("bottom_variant", plan.bottom_variant, 0, kMostVariants);
  map.read("skin", plan.skin, 0, kMostVariants);
  map.read("hair", plan.hair, 0, kMostVariants);
  map.read("short_sleeves", plan.short_sleeves);
  map.read("shorts", plan.shorts);
  map.read("start", plan.start);
  map.read("yaw", plan.yaw_deg);
  map.read("delay", plan.delay_s, 0.0, kMost);
  map.read("repeat", plan.repeat);
  for (const YAML::Node& entry : map.list("actions"))
    plan.actions.push_back(read_action(entry, source));
  map.finish();
  return plan;
}

void include_layout(YamlMap& map, WorldConfig& world, int depth);

/// What a layout may hold as well as a world.
void read_shared_keys(YamlMap& map, WorldConfig& world, int depth) {
  const std::string& source = map.source();
  if (map.has("layout")) include_layout(map, world, depth);
  map.read("ambient", world.ambient, 0.0, 10.0);
  map.read("exposure", world.exposure, 0.01, 100.0);
  for (const YAML::Node& entry : map.list("rooms")) world.rooms.push_back(read_room(entry, source));
  for (const YAML::Node& entry : map.list("furniture"))
    world.furniture.push_back(read_furniture(entry, source));
  for (const YAML::Node& entry : map.list("movers"))
    world.movers.push_back(read_mover(entry, source));
  for (const YAML::Node& entry : map.list("people"))
    world.people.push_back(read_person(entry, source));
}

void include_layout(YamlMap& map, WorldConfig& world, int depth) {
  std::string name;
  map.read("layout", name);
  const auto text = embedded_file("layouts/" + name + ".yaml");
  if (!text) {
    std::string known;
    for (const std::string& file : embedded_file_names()) {
      if (file.starts_with("layouts/"))
        known += (known.empty() ? "" : ", ") + file.substr(8, file.size() - 13);
    }
    throw map.fault(map.node("layout"), "unknown layout '" + name + "' (known: " + known + ")");
  }
  if (depth > 8) throw map.fault(map.node("layout"), "layouts include each other in a circle");
  YamlMap inner(YAML::Load(std::string(*text)), "layouts/" + name + ".yaml");
  read_shared_keys(inner, world, depth + 1);
  inner.finish();
}

}  // namespace

WorldConfig read_world(const YAML::Node& node, const std::string& source) {
  YamlMap map(node, source);
  WorldConfig world;
  map.read("description", world.description);
  map.read("seconds", world.seconds);
  map.read("fps", world.fps);
  if (world.seconds <= 0 || world.seconds > 1e6)
    throw map.fault(map.node("seconds"), "'seconds' is 0 to a million");
  if (world.fps < 1 || world.fps > 240) throw map.fault(map.node("fps"), "'fps' is 1 to 240");
  read_shared_keys(map, world, 0);
  if (map.has("intrinsics")) read_intrinsics(map.node("intrinsics"), source, world.intrinsics);
  if (map.has("camera")) read_camera(map.node("camera"), source, world.camera);
  map.finish();
  if (world.rooms.empty()) throw map.fault(node, "a world needs at least one room (or a 'layout')");
  world.camera.seconds = world.seconds;
  for (const MoverPlan& mover : world.movers) {
    if (mover.person.empty()) continue;
    const bool found = std::any_of(world.people.begin(), world.people.end(),
                                   [&](const PersonPlan& p) { return p.name == mover.person; });
    if (!found)
      throw map.fault(map.node("movers"), "mover '" + mover.name + "' needs person '" +
                                              mover.person + "', who does not exist");
  }
  return world;
}

}  // namespace ygslam::sim
