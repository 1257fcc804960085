#include "simulation/random/random_room.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "geometry/random_vector.hpp"
#include "simulation/random/clutter.hpp"
#include "simulation/random/random_body.hpp"
#include "simulation/world/furniture.hpp"
#include "simulation/world/mover_motions.hpp"

namespace ygslam::sim {

namespace {

template <std::size_t N>
const std::string& one_of(const std::array<std::string, N>& names, Rng& rng) {
  return names[rng.below(static_cast<std::uint32_t>(N))];
}

}  // namespace

void RandomRoom::add_walls() {
  static const std::array<std::string, 5> walls = {"plaster", "brick", "concrete", "board", "wood"};
  static const std::array<std::string, 4> floors = {"carpet", "tiles", "parquet", "concrete"};
  RoomPlan& r = room_;
  const auto half = drawn_vector<Vec2>([&] { return uniform(1.4, 4.5); });
  r.low = -half;
  r.high = half;
  r.height_m = uniform(2.2, 3.6);
  r.wall = one_of(walls, rng_);
  r.floor = one_of(floors, rng_);
  r.variant = variant();
  r.lamps_x = 1 + static_cast<int>(rng_.below(3));
  r.lamps_y = 1 + static_cast<int>(rng_.below(2));
  r.brightness = uniform(0.4, 1.6);
  scene_.ambient = static_cast<float>(uniform(0.12, 0.5));
  add_room(scene_, r);
}

void RandomRoom::furnish() {
  const double crowded = uniform(0.2, 1.6);
  const auto along_walls = static_cast<int>(crowded * (room_.high - room_.low).sum() * 0.9);
  for (int i = 0; i < along_walls; ++i) add_at_wall();
  const int inside = static_cast<int>(crowded * uniform(0, 7));
  for (int i = 0; i < inside; ++i) add_inside();
  const int junk = static_cast<int>(crowded * uniform(0, 8));
  for (int i = 0; i < junk; ++i) add_shape();
  const int cluttered = 1 + static_cast<int>(crowded * uniform(0, 5));
  for (int i = 0; i < cluttered; ++i) add_cluttered();
  const int coats = rng_.uniform() < 0.35 ? 1 + static_cast<int>(rng_.below(4)) : 0;
  for (int i = 0; i < coats; ++i) add_coat();
  for (const ColourImage& picture : album_) {
    if (rng_.uniform() < 0.4) add_picture_of_people(picture);
  }
}

bool RandomRoom::is_free(const Vec2& at, double radius_m) const {
  if (((at - room_.low).array() < radius_m).any() || ((room_.high - at).array() < radius_m).any())
    return false;
  return std::none_of(taken_.begin(), taken_.end(), [&](const auto& disc) {
    return (disc.first - at).norm() < disc.second + radius_m;
  });
}

Vec2 RandomRoom::somewhere() {
  return {uniform(room_.low.x(), room_.high.x()), uniform(room_.low.y(), room_.high.y())};
}

void RandomRoom::put(const std::string& kind, const Vec3& at, double yaw_deg,
                     const std::optional<Vec3f>& size_m) {
  const auto mesh = make_furniture(kind, variant(), size_m, scene_.materials);
  append(scene_.fixed, *mesh, placed(at, yaw_deg));
}

Vec3f RandomRoom::size(double x0, double x1, double y0, double y1, double z0, double z1) {
  const double x = uniform(x0, x1);
  const double y = uniform(y0, y1);
  return Vec3(x, y, uniform(z0, z1)).cast<float>();
}

double RandomRoom::wall_place(double off_m, Vec2& at) {
  at = somewhere();
  switch (rng_.below(4)) {
    case 0:
      at.y() = room_.high.y() - off_m;
      return 0;
    case 1:
      at.y() = room_.low.y() + off_m;
      return 180;
    case 2:
      at.x() = room_.low.x() + off_m;
      return 90;
    default:
      at.x() = room_.high.x() - off_m;
      return -90;
  }
}

void RandomRoom::add_at_wall() {
  Vec2 at;
  const double what = rng_.uniform();
  if (what < 0.25) {
    const Vec3f s = size(0.4, 1.4, 0.01, 0.03, 0.3, 1.3);
    const double yaw = wall_place(0.02, at);
    static const std::array<std::string, 4> flat = {"poster", "whiteboard", "window", "poster"};
    const double height_m = uniform(0.6, 1.7);
    put(one_of(flat, rng_), {at.x(), at.y(), height_m}, yaw, s);
  } else if (what < 0.32) {
    const double yaw = wall_place(0.03, at);
    put("door", {at.x(), at.y(), 0}, yaw);
  } else if (what < 0.45) {
    const Vec3f s = size(0.4, 1.2, 0.25, 0.4, 0.4, 0.8);  // cupboard on the wall
    const double yaw = wall_place(0.5 * static_cast<double>(s.y()) + 0.01, at);
    put("cabinet", {at.x(), at.y(), uniform(1.2, 1.6)}, yaw, s);
  } else if (what < 0.72) {
    const Vec3f s = size(0.4, 2, 0.35, 0.65, 0.5, 2.2);
    static const std::array<std::string, 3> kinds = {"cabinet", "shelf", "carton"};
    stand(one_of(kinds, rng_), s);
  } else if (what < 0.9) {
    const double yaw = wall_place(0.45, at);
    put("workplace", {at.x(), at.y(), 0}, yaw);
    take(at, 0.75);
  } else {
    const double yaw = wall_place(0.5, at);
    put("sofa", {at.x(), at.y(), 0}, yaw);
    take(at, 0.7);
  }
}

void RandomRoom::stand(const std::string& kind, const Vec3f& s) {
  Vec2 at;
  const double yaw = wall_place(0.5 * static_cast<double>(s.y()) + 0.01, at);
  put(kind, {at.x(), at.y(), 0}, yaw, s);
  take(at, 0.5 * static_cast<double>(std::max(s.x(), s.y())));
  if (s.z() < 1.3F && rng_.uniform() < 0.7) {
    static const std::array<std::string, 6> small = {"books",  "bottle", "plant",
                                                     "carton", "lamp",   "monitor"};
    const double turned_deg = yaw + uniform(-40, 40);
    put(one_of(small, rng_), {at.x(), at.y(), static_cast<double>(s.z())}, turned_deg);
  }
}

void RandomRoom::add_inside() {
  static const std::array<std::string, 10> kinds = {"chair",  "office_chair", "chair", "desk",
                                                    "plant",  "carton",       "block", "bin",
                                                    "column", "partition"};
  const std::string& kind = one_of(kinds, rng_);
  std::optional<Vec3f> s;
  if (kind == "block" || kind == "carton") s = size(0.2, 0.9, 0.2, 0.9, 0.2, 1.2);
  if (kind == "plant") s = size(0.4, 0.9, 0.4, 0.9, 0.5, 1.9);
  if (kind == "partition") s = size(0.8, 2, 0.04, 0.08, 1, 1.7);
  if (kind == "column") s = size(0.15, 0.5, 0.15, 0.5, 1.4, 2.2);
  const Vec2 at = somewhere();
  put(kind, {at.x(), at.y(), 0}, uniform(0, 360), s);
  take(at, kind == "desk" ? 0.7 : 0.3);
}

void RandomRoom::add_cluttered() {
  Vec2 at = somewhere();
  double yaw_deg = uniform(0, 360);
  Vec3f s = size(0.8, 2, 0.5, 0.9, 0.5, 0.8);
  const double what = rng_.uniform();
  if (what < 0.35) {
    s = size(0.8, 3, 0.45, 0.7, 0.7, 1.05);
    yaw_deg = wall_place(0.5 * static_cast<double>(s.y()) + 0.01, at);
    Mesh counter;
    add_box(counter, {-s.x() / 2, -s.y() / 2, 0}, {s.x() / 2, s.y() / 2, s.z()},
            random_material(scene_.materials, rng_));
    append(scene_.fixed, counter, placed({at.x(), at.y(), 0}, yaw_deg));
  } else if (what < 0.8) {
    put("desk", {at.x(), at.y(), 0}, yaw_deg, s);
  } else {
    s = size(0.3, 1, 0.3, 1, 0, 0);
  }
  append(scene_.fixed, random_clutter(0.9 * s.head<2>().cast<double>(), scene_.materials, rng_),
         placed({at.x(), at.y(), static_cast<double>(s.z())}, yaw_deg));
  take(at, 0.4 * static_cast<double>(s.x()));
  cluttered_world_.emplace_back(at.x(), at.y(), s.z());
}

void RandomRoom::add_shape() {
  const Vec2 at = somewhere();
  const Vec3f foot(static_cast<float>(at.x()), static_cast<float>(at.y()),
                   static_cast<float>(rng_.uniform() < 0.6 ? 0 : uniform(0.2, 1.6)));
  const auto f = [&](double low, double high) { return static_cast<float>(uniform(low, high)); };
  const MaterialId m = random_material(scene_.materials, rng_);
  const double what = rng_.uniform();
  if (what < 0.4) {
    const float up = f(0.2, 1.9);
    const auto aside = drawn_vector<Vec2f>([&] { return f(-0.3, 0.3); });
    const float other = f(0.01, 0.25);
    const Vec3f top = foot + Vec3f(aside.x(), aside.y(), up);
    add_cylinder(scene_.fixed, foot, top, f(0.01, 0.25), other, 14, m);
  } else if (what < 0.6) {
    add_sphere(scene_.fixed, foot + Vec3f(0, 0, 0.2F), f(0.04, 0.35), 10, m);
  } else if (what < 0.8) {
    const Vec3f half = size(0.05, 0.4, 0.05, 0.4, 0.1, 1.0);
    Mesh box;
    add_box(box, -half, half, m);
    const double yaw = uniform(-3, 3);
    const auto tilt = drawn_vector<Vec2>([&] { return uniform(-0.5, 0.5); });
    const Vec3 turn(tilt.x(), tilt.y(), yaw);
    append(scene_.fixed, box, SE3(so3_exp(turn), (foot + Vec3f(0, 0, half.z())).cast<double>()));
  } else {  // like a coat stand or a lamp: a rod with something on it
    const float height = f(1.1, 1.9);
    const Vec3f top = foot + Vec3f(0, 0, height);
    add_cylinder(scene_.fixed, foot, top, 0.02F, 0.02F, 8, m);
    const MaterialId of_shade = random_material(scene_.materials, rng_);
    const float upper = f(0.05, 0.25);
    const float lower = f(0.08, 0.28);
    add_cylinder(scene_.fixed, top - Vec3f(0, 0, f(0.1, 0.9)), top, lower, upper, 14, of_shade);
    if (rng_.uniform() < 0.4) add_sphere(scene_.fixed, top + Vec3f(0, 0, 0.1F), 0.11F, 10, m);
  }
  if (foot.z() == 0) take(at, 0.25);
}

void RandomRoom::add_coat() {
  const Mesh coat = hung_coat(baked_, scene_.materials, rng_);
  Vec2 at;
  if (rng_.uniform() < 0.7) {
    const double yaw = wall_place(0.01, at);
    append(scene_.fixed, coat, placed({at.x(), at.y(), uniform(1.2, 1.9)}, yaw));
  } else {  // over the back of a chair
    at = somewhere();
    const double yaw = uniform(0, 360);
    put("chair", {at.x(), at.y(), 0}, yaw);
    append(scene_.fixed, coat,
           placed({at.x(), at.y(), 0}, yaw) *
               SE3(so3_exp(Vec3(0, 0, std::numbers::pi)), Vec3(0, 0.24, 0.95)));
    take(at, 0.4);
  }
}

void RandomRoom::add_picture_of_people(const ColourImage& picture) {
  Vec2 at;
  const auto width = static_cast<float>(uniform(0.3, 2.2));
  const float height = width * static_cast<float>(uniform(0.6, 1.1));
  const bool screen = rng_.uniform() < 0.4;
  const MaterialId m = scene_.materials.picture(picture, screen ? 0.9F : 0);
  const double yaw = wall_place(screen ? 0.06 : 0.005, at);
  Mesh mesh;
  add_picture(mesh, {-width / 2, 0, 0}, {width, 0, 0}, {0, 0, height}, m);
  append(scene_.fixed, mesh, placed({at.x(), at.y(), uniform(0.2, 1.5)}, yaw));
}

}  // namespace ygslam::sim
