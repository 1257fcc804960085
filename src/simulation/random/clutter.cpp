#include "simulation/random/clutter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "geometry/random_vector.hpp"
#include "simulation/world/furniture.hpp"

namespace ygslam::sim {

namespace {

float uniform(Rng& rng, double low, double high) {
  return static_cast<float>(rng.uniform(low, high));
}

/// Sizes of small things: many of a few centimetres, some of half a metre.
float small_m(Rng& rng) { return std::exp(uniform(rng, std::log(0.015), std::log(0.3))); }
Vec3f small_size_m(Rng& rng) {
  return drawn_vector<Vec3f>([&] { return small_m(rng); });
}
/// Horizontal, within these bounds either way.
Vec3f flat(Rng& rng, const Vec2& bound) {
  const Vec2 drawn = random_in_box<2>(rng, -bound, bound);
  return {static_cast<float>(drawn.x()), static_cast<float>(drawn.y()), 0};
}

/// Soft and uneven: bags, cushions, clothes in a heap, fruit.
Mesh lump(MaterialId material, Rng& rng) {
  Mesh mesh;
  add_sphere(mesh, Vec3f::Zero(), 1, 9, material);
  const Vec3f half = small_size_m(rng);
  const auto waves = drawn_vector<Vec3f>([&] { return uniform(rng, 1, 5); });
  const float phase = uniform(rng, 0, 2 * std::numbers::pi);
  const float bumps = uniform(rng, 0, 0.3);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const Vec3f on_ball = mesh.points[i];
    const float swell = 1 + bumps * std::sin(waves.dot(on_ball) + phase);
    mesh.points[i] = half.cwiseProduct(swell * on_ball) + Vec3f(0, 0, 0.8F * half.z());
    mesh.normals[i] = on_ball.cwiseQuotient(half).normalized();
  }
  return mesh;
}

Mesh rod_or_tin(MaterialId material, Rng& rng) {
  Mesh mesh;
  const float radius = 0.4F * small_m(rng);
  const float other = rng.uniform() < 0.6 ? radius : radius * uniform(rng, 0.3, 1.2);
  const float length = 2 * small_m(rng);
  const bool lies = rng.uniform() < 0.4;
  const Vec3f foot(0, 0, lies ? radius : 0);
  const Vec3f along = lies ? Vec3f(length, 0, uniform(rng, 0, 0.2)) : Vec3f(0, 0, length);
  add_cylinder(mesh, foot, foot + along, radius, other, 12, material);
  return mesh;
}

Mesh made_thing(MaterialLibrary& materials, Rng& rng) {
  static const std::array<std::string, 16> kinds = {
      "paper", "books", "books",   "mug",     "mug",     "bottle",   "bottle", "lamp",
      "duck",  "bin",   "monitor", "monitor", "monitor", "keyboard", "carton", "plant"};
  const std::string& kind = kinds[rng.below(static_cast<std::uint32_t>(kinds.size()))];
  std::optional<Vec3f> size_m;
  if (kind == "carton") size_m = small_size_m(rng) * 1.5F;
  if (kind == "monitor") {
    const float height = uniform(rng, 0.2, 0.45);
    size_m = Vec3f(uniform(rng, 0.35, 0.75), 0.05F, height);
  }
  if (kind == "plant") size_m = Vec3f(0.2F, 0.2F, uniform(rng, 0.15, 0.5));
  return *make_furniture(kind, static_cast<int>(rng.below(40)), size_m, materials);
}

/// Two or three upright shapes on each other, as tall as a head and a chest: kettles, coffee
/// makers, machines.
Mesh appliance(MaterialLibrary& materials, Rng& rng) {
  Mesh mesh;
  const int pieces = 2 + static_cast<int>(rng.below(2));
  float top = 0;
  for (int i = 0; i < pieces; ++i) {
    const MaterialId material = random_material(materials, rng);
    const float height = uniform(rng, 0.06, 0.25);
    const Vec3f foot = flat(rng, {0.04, 0.04}) + Vec3f(0, 0, top);
    const float half_width = uniform(rng, 0.06, 0.16);
    const Vec3f half(uniform(rng, 0.06, 0.2), half_width, 0);
    if (rng.uniform() < 0.5) {
      add_box(mesh, foot - half, foot + half + Vec3f(0, 0, height), material);
    } else {
      add_cylinder(mesh, foot, foot + Vec3f(0, 0, height), half.x(),
                   half.x() * uniform(rng, 0.5, 1.1), 14, material);
    }
    top += height;
  }
  return mesh;
}

Mesh small_thing(MaterialLibrary& materials, Rng& rng) {
  const double what = rng.uniform();
  if (what < 0.45) return made_thing(materials, rng);
  const MaterialId material = random_material(materials, rng);
  if (what < 0.65) return lump(material, rng);
  if (what < 0.82) return rod_or_tin(material, rng);
  Mesh box;
  const Vec3f size = small_size_m(rng);
  add_box(box, -0.5F * size, 0.5F * size, material);
  const Vec3 turn = flat(rng, {0.3, 0.3}).cast<double>();
  Mesh turned;
  append(turned, box, SE3(so3_exp(turn), Vec3(0, 0, 0.5 * static_cast<double>(size.z()))));
  return turned;
}

}  // namespace

MaterialId random_material(MaterialLibrary& materials, Rng& rng) {
  static const std::array<std::string, 8> kinds = {"wood",  "plaster",   "cloth", "board",
                                                   "brick", "cardboard", "print", "stripes"};
  if (rng.uniform() < 0.5) {
    const std::string& kind = kinds[rng.below(static_cast<std::uint32_t>(kinds.size()))];
    return materials.get(kind, static_cast<int>(rng.below(40)));
  }
  const float r = uniform(rng, 10, 250);
  const float g = uniform(rng, 10, 250);
  const float b = uniform(rng, 10, 250);
  const float ir_return = uniform(rng, 0.1, 1);
  return materials.plain({r, g, b}, ir_return, uniform(rng, 0, 0.5));
}

Mesh random_clutter(const Vec2& size_m, MaterialLibrary& materials, Rng& rng) {
  Mesh mesh;
  const double things_per_m2 = std::exp(rng.uniform(std::log(4), std::log(50)));
  const int things = 1 + static_cast<int>(things_per_m2 * size_m.prod());
  for (int i = 0; i < things; ++i) {
    const double x = rng.uniform(-0.5, 0.5) * size_m.x();
    const double y = rng.uniform(-0.5, 0.5) * size_m.y();
    const double z = rng.uniform() < 0.25 ? rng.uniform(0, 0.2) : 0;  // on something else
    const double yaw_rad = rng.uniform(-std::numbers::pi, std::numbers::pi);
    append(mesh, small_thing(materials, rng), SE3(so3_exp(Vec3(0, 0, yaw_rad)), Vec3(x, y, z)));
  }
  // What stands up and hides who is behind it, or looks like somebody's upper half.
  const auto at = [&] {
    const double y = rng.uniform(-0.4, 0.4) * size_m.y();
    return Vec3(rng.uniform(-0.4, 0.4) * size_m.x(), y, 0);
  };
  const auto facing = [&](double yaw_rad) { return SE3(so3_exp(Vec3(0, 0, yaw_rad)), at()); };
  const int monitors = rng.uniform() < 0.35 ? 1 + static_cast<int>(rng.below(3)) : 0;
  const double towards_rad = rng.uniform(-std::numbers::pi, std::numbers::pi);
  for (int i = 0; i < monitors; ++i) {
    const float height = uniform(rng, 0.25, 0.45);
    const Vec3f screen_m(uniform(rng, 0.4, 0.75), 0.05F, height);
    const SE3 T_here_monitor = facing(towards_rad + rng.normal(0, 0.3));
    const auto variant = static_cast<int>(rng.below(40));
    append(mesh, *make_furniture("monitor", variant, screen_m, materials), T_here_monitor);
  }
  const int machines = rng.uniform() < 0.35 ? 1 + static_cast<int>(rng.below(3)) : 0;
  for (int i = 0; i < machines; ++i) {
    const SE3 T_here_machine = facing(rng.uniform(-std::numbers::pi, std::numbers::pi));
    append(mesh, appliance(materials, rng), T_here_machine);
  }
  return mesh;
}

}  // namespace ygslam::sim
