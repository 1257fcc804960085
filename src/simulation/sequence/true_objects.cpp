#include "simulation/sequence/true_objects.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

namespace ygslam::sim {

namespace {

constexpr double kStill_m = 0.01, kStill_rad = 0.02;  // since it came to rest
constexpr double kRest_s = 1;                         // a shorter stop is none
constexpr double kShownShare = 0.001;                 // of the image's pixels
constexpr float kFar_m = 4;                           // as far as maps are made
constexpr int kMostThings = 255;
constexpr double kVisibleShare = 1.0 / 3;  // of a surface: a thing hides some of its own
constexpr double kHidden_m = 0.05;         // nearer or farther than a point: another surface

bool is_room(const std::string& class_name) {
  return class_name == "floor" || class_name == "wall" || class_name == "ceiling";
}

bool is_rest(const ThingPlace& place) {
  return static_cast<double>(place.until.ns - place.from.ns) >= kRest_s * 1e9;
}

double rounded(double value) { return std::round(value * 1e6) / 1e6 + 0.0; }

/// The last place's end moves on, or another place begins. @return the place.
ThingPlace& watch(const SE3& T_world_object, Timestamp stamp, std::vector<ThingPlace>& places) {
  const SE3 T = places.empty() ? SE3() : places.back().T_world_object.inverse() * T_world_object;
  if (places.empty() || T.t().norm() > kStill_m || T.angle() > kStill_rad) {
    if (!places.empty() && !is_rest(places.back())) places.pop_back();
    places.push_back({stamp, stamp, T_world_object, 0, {}, {}});
  }
  places.back().until = stamp;
  return places.back();
}

/// Whether the view sees enough of what faces it of a part's surface.
/// @param is_empty it went: whether the view looks through so much of where it was.
bool sees(const TrueView& view, const Mesh& mesh, const NamedPart& part, const SE3& T_world_object,
          bool is_empty) {
  const SE3 T_camera_object = view.T_world_camera.inverse() * T_world_object;
  const double beyond_m = is_empty ? kHidden_m : -kHidden_m;
  double facing_m2 = 0, visible_m2 = 0;
  for (std::uint32_t i = part.first; i < part.end; ++i) {
    std::array<Vec3, 3> p;
    for (std::size_t k = 0; k < 3; ++k)
      p[k] = T_camera_object * mesh.points[mesh.triangles[i].corner[k]].cast<double>();
    const Vec3 middle = (p[0] + p[1] + p[2]) / 3, normal = (p[1] - p[0]).cross(p[2] - p[0]);
    if (normal.dot(middle) >= 0) continue;
    facing_m2 += normal.norm() / 2;
    if (middle.z() <= 0 || middle.z() > kFar_m) continue;
    const Vec2 at = view.camera.project(middle);
    const int u = static_cast<int>(std::lround(at.x())), v = static_cast<int>(std::lround(at.y()));
    if (view.depth_m.contains(u, v) && view.depth_m.at(u, v) > middle.z() + beyond_m)
      visible_m2 += normal.norm() / 2;
  }
  return facing_m2 > 0 && visible_m2 >= kVisibleShare * facing_m2;
}

void note(bool is_shown, Timestamp stamp, std::vector<ShownSpan>& spans) {
  if (!spans.empty() && spans.back().is_open) {
    spans.back().until = stamp;
    spans.back().is_open = is_shown;
  } else if (is_shown) {
    spans.push_back({stamp, stamp});
  }
}

/// Of a thing that moves: the last place is where it is.
void note_shown(const TrueView& view, const Mesh& mesh, const NamedPart& part, Timestamp stamp,
                std::vector<ThingPlace>& places) {
  for (ThingPlace& place : places) {
    const bool is_empty = &place != &places.back();
    note(sees(view, mesh, part, place.T_world_object, is_empty), stamp,
         is_empty ? place.shown_empty : place.shown);
  }
}

bool is_nameless(const Scene& scene, std::size_t mover) {
  return !scene.movers[mover].is_body() &&
         std::none_of(scene.things.begin(), scene.things.end(),
                      [&](const NamedThing& thing) { return thing.object == mover + 1; });
}

NamedPart whole(const Mesh& mesh) {
  return {{}, false, 0, static_cast<std::uint32_t>(mesh.triangles.size()), 0};
}

nlohmann::ordered_json json_of(const std::vector<ThingPlace>& places, const Mesh& mesh,
                               const NamedPart& part, bool moves) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const ThingPlace& place : places) {
    if (moves && !is_rest(place)) continue;
    const ThingBox box = box_of(mesh, part, place.T_world_object);
    const auto vector = [](const Vec3& v) {
      return nlohmann::ordered_json{rounded(v.x()), rounded(v.y()), rounded(v.z())};
    };
    const auto list_of = [](const std::vector<ShownSpan>& spans) {
      nlohmann::ordered_json times = nlohmann::ordered_json::array();
      for (const ShownSpan& span : spans) times.push_back({span.from.ns, span.until.ns});
      return times;
    };
    nlohmann::ordered_json json = {
        {"from_ns", place.from.ns},        {"until_ns", place.until.ns},
        {"centre_m", vector(box.centre)},  {"size_m", vector(box.size_m)},
        {"yaw_rad", rounded(box.yaw_rad)}, {"frames", place.frames}};
    json["shown_ns"] = list_of(place.shown);
    json["shown_empty_ns"] = list_of(place.shown_empty);
    list.push_back(std::move(json));
  }
  return list;
}

}  // namespace

void number_things(Scene& scene) {
  std::map<std::string, std::uint8_t> room_ids;
  int count = 0;
  const auto add = [&](std::size_t object, const std::string& class_name, const NamedPart& part) {
    std::uint8_t& room_id = room_ids[class_name];
    const bool is_known = is_room(class_name) && room_id != 0;
    if (!is_known && count == kMostThings) return;
    const auto id = is_known ? room_id : static_cast<std::uint8_t>(++count);
    if (is_room(class_name)) room_id = id;
    if (!is_known) scene.things.push_back({id, class_name, part.is_group, object, part});
    std::fill(scene.thing_ids[object].begin() + part.first,
              scene.thing_ids[object].begin() + part.end, id);
  };
  scene.thing_ids.assign(scene.movers.size() + 1, {});
  scene.thing_ids[0].assign(scene.fixed.triangles.size(), 0);
  for (const NamedPart& part : scene.fixed.parts) add(0, part.class_name, part);
  for (const bool bodies : {false, true}) {
    for (std::size_t i = 0; i < scene.movers.size(); ++i) {
      const Mover& mover = scene.movers[i];
      if (mover.is_body() != bodies) continue;
      const std::size_t triangles = (bodies ? mover.body->topology() : mover.mesh).triangles.size();
      scene.thing_ids[i + 1].assign(triangles, 0);
      for (const NamedPart& part : mover.mesh.parts) add(i + 1, part.class_name, part);
      if (bodies)
        add(i + 1, mover.class_name,
            {mover.class_name, false, 0, static_cast<std::uint32_t>(triangles), 0});
    }
  }
}

ThingBox box_of(const Mesh& mesh, const NamedPart& part, const SE3& T_world_object) {
  const Mat3& R = T_world_object.R();
  ThingBox box;
  box.yaw_rad = std::remainder(part.yaw_rad + std::atan2(R(1, 0), R(0, 0)), 2 * std::numbers::pi);
  const Mat3 R_box_world = so3_exp(Vec3(0, 0, -box.yaw_rad));
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (std::uint32_t i = part.first; i < part.end; ++i) {
    for (const std::uint32_t corner : mesh.triangles[i].corner) {
      const Vec3 p = R_box_world * (T_world_object * mesh.points[corner].cast<double>());
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  box.size_m = high - low;
  box.centre = R_box_world.transpose() * (0.5 * (low + high));
  return box;
}

void TrueObjects::add(const Scene& scene, double t_s, Timestamp stamp, const TrueView& view) {
  const GreyImage& things = view.things;
  std::array<int, 256> pixels{};
  for (std::size_t i = 0; i < things.size(); ++i)
    if (view.depth_m.data()[i] <= kFar_m) ++pixels[things.data()[i]];
  for (const NamedThing& thing : scene.things) {
    if (thing.object > 0 && scene.movers[thing.object - 1].is_body()) continue;
    const SE3 T_world_object =
        thing.object == 0 ? SE3() : scene.movers[thing.object - 1].pose_at(t_s);
    std::vector<ThingPlace>& places = places_[thing.id];
    ThingPlace& place = watch(T_world_object, stamp, places);
    if (pixels[thing.id] >= kShownShare * static_cast<double>(things.size())) ++place.frames;
    if (thing.object > 0)
      note_shown(view, scene.movers[thing.object - 1].mesh, thing.part, stamp, places);
  }
  for (std::size_t i = 0; i < scene.movers.size(); ++i) {
    if (!is_nameless(scene, i)) continue;
    const Mesh& mesh = scene.movers[i].mesh;
    watch(scene.movers[i].pose_at(t_s), stamp, nameless_[i]);
    note_shown(view, mesh, whole(mesh), stamp, nameless_[i]);
  }
}

std::string TrueObjects::json(const Scene& scene) const {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const NamedThing& thing : scene.things) {
    const auto known = places_.find(thing.id);
    if (known == places_.end() || is_room(thing.class_name)) continue;
    const Mesh& mesh = thing.object == 0 ? scene.fixed : scene.movers[thing.object - 1].mesh;
    list.push_back({{"id", thing.id},
                    {"class", thing.class_name},
                    {"group", thing.is_group},
                    {"places", json_of(known->second, mesh, thing.part, thing.object > 0)}});
  }
  nlohmann::ordered_json nameless = nlohmann::ordered_json::array();
  for (const auto& [mover, places] : nameless_) {
    const Mover& its = scene.movers[mover];
    nameless.push_back(
        {{"class", its.class_name}, {"places", json_of(places, its.mesh, whole(its.mesh), true)}});
  }
  const nlohmann::ordered_json json = {{"format", "ygslam true objects"},
                                       {"version", 1},
                                       {"objects", std::move(list)},
                                       {"nameless", std::move(nameless)}};
  return json.dump(1) + "\n";
}

std::string thing_names_json(const Scene& scene) {
  nlohmann::ordered_json names = nlohmann::ordered_json::object();
  for (const NamedThing& thing : scene.things) names[std::to_string(thing.id)] = thing.class_name;
  return names.dump(2) + "\n";
}

}  // namespace ygslam::sim
