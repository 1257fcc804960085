#include "simulation/world/furniture.hpp"

#include <algorithm>
#include <cmath>

#include "simulation/world/furniture_makers.hpp"

namespace ygslam::sim {

namespace {

Mesh desk(const Order& o) {
  Mesh mesh;
  const Vec3f s = o.size_or(1.5F, 0.75F, 0.74F);
  const MaterialId top =
      o.variant % 2 == 0 ? o.materials.plain({214, 206, 190}) : o.materials.get("wood", o.variant);
  const MaterialId metal = o.materials.plain({150, 152, 156}, 0.6F, 0.3F);
  box_at(mesh, 0, 0, s.z() - 0.035F, s.x(), s.y(), 0.035F, top);
  for (const float side : {-1.0F, 1.0F}) {
    const float x = side * (s.x() / 2 - 0.07F);
    box_at(mesh, x, -s.y() / 2 + 0.08F, 0, 0.05F, 0.05F, s.z() - 0.035F, metal);
    box_at(mesh, x, s.y() / 2 - 0.08F, 0, 0.05F, 0.05F, s.z() - 0.035F, metal);
    box_at(mesh, x, 0, 0.02F, 0.05F, s.y() - 0.2F, 0.04F, metal);
  }
  box_at(mesh, 0, s.y() / 2 - 0.05F, 0.35F, s.x() - 0.2F, 0.015F, 0.3F,
         o.materials.plain({170, 168, 164}));
  name_part(mesh, 0, "dining table");
  return mesh;
}

Mesh chair(const Order& o) {
  Mesh mesh;
  const MaterialId seat =
      o.variant % 2 == 0 ? o.materials.get("wood", 2) : o.materials.get("cloth", o.variant);
  const MaterialId metal = o.materials.plain({136, 138, 142}, 0.5F, 0.4F);
  box_at(mesh, 0, 0, 0.43F, 0.42F, 0.42F, 0.03F, seat);
  add_quad(mesh, {-0.2F, 0.20F, 0.62F}, {0.4F, 0, 0}, {0, 0.06F, 0.30F}, seat);
  add_quad(mesh, {0.2F, 0.22F, 0.62F}, {-0.4F, 0, 0}, {0, 0.06F, 0.30F}, seat);
  for (const float x : {-0.19F, 0.19F}) {
    add_cylinder(mesh, {x, -0.19F, 0}, {x, -0.17F, 0.43F}, 0.012F, 0.012F, 8, metal);
    add_cylinder(mesh, {x, 0.22F, 0}, {x, 0.18F, 0.45F}, 0.012F, 0.012F, 8, metal);
    add_cylinder(mesh, {x, 0.18F, 0.45F}, {x, 0.27F, 0.90F}, 0.012F, 0.012F, 8, metal);
  }
  name_part(mesh, 0, "chair");
  return mesh;
}

Mesh office_chair(const Order& o) {
  Mesh mesh;
  const MaterialId cloth = o.materials.get("cloth", o.variant == 0 ? 2 : o.variant);
  const MaterialId dark = o.materials.plain({40, 40, 44}, 0.5F);
  for (int i = 0; i < 5; ++i) {
    const float a = 1.2566371F * static_cast<float>(i);
    const Vec3f tip(0.28F * std::cos(a), 0.28F * std::sin(a), 0.05F);
    add_cylinder(mesh, {0, 0, 0.09F}, tip, 0.025F, 0.015F, 8, dark);
    add_sphere(mesh, {tip.x(), tip.y(), 0.03F}, 0.03F, 6, dark);
  }
  add_cylinder(mesh, {0, 0, 0.08F}, {0, 0, 0.42F}, 0.025F, 0.025F, 10, dark);
  box_at(mesh, 0, 0, 0.42F, 0.46F, 0.44F, 0.07F, cloth);
  box_at(mesh, 0, 0.24F, 0.40F, 0.06F, 0.03F, 0.3F, dark);
  box_at(mesh, 0, 0.23F, 0.58F, 0.42F, 0.05F, 0.42F, cloth);
  name_part(mesh, 0, "chair");
  return mesh;
}

Mesh monitor(const Order& o) {
  Mesh mesh;
  const Vec3f s = o.size_or(0.52F, 0.05F, 0.32F);
  const MaterialId frame = o.variant % 2 == 0 ? o.materials.plain({30, 30, 33}, 0.3F, 0.3F)
                                              : o.materials.plain({196, 198, 200}, 0.8F, 0.2F);
  const float low = 0.12F;
  box_at(mesh, 0, 0, low, s.x(), s.y(), s.z(), frame);
  const float border = 0.02F;
  const Vec3f corner(-s.x() / 2 + border, -s.y() / 2 - 0.001F, low + border);
  const std::string picture =
      o.variant % 10 == 9 ? "video" : (o.variant % 3 == 1 ? "screen_off" : "screen");
  add_picture(mesh, corner, {s.x() - 2 * border, 0, 0}, {0, 0, s.z() - 2 * border},
              o.materials.get(picture, o.variant));
  box_at(mesh, 0, 0.03F, 0.01F, 0.06F, 0.03F, 0.2F, frame);
  box_at(mesh, 0, 0.03F, 0, 0.24F, 0.16F, 0.012F, frame);
  name_part(mesh, 0, "tv");
  return mesh;
}

Mesh keyboard(const Order& o) {
  Mesh mesh;
  box_at(mesh, 0, 0, 0, 0.45F, 0.16F, 0.018F, o.materials.plain({34, 34, 36}, 0.6F));
  add_picture(mesh, {-0.22F, -0.075F, 0.0185F}, {0.44F, 0, 0}, {0, 0.15F, 0},
              o.materials.get("keyboard", o.variant));
  name_part(mesh, 0, "keyboard");
  const std::size_t mouse = mesh.triangles.size();
  box_at(mesh, 0.31F, -0.01F, 0, 0.06F, 0.10F, 0.03F, o.materials.plain({30, 30, 32}, 0.6F));
  name_part(mesh, mouse, "mouse");
  return mesh;
}

Mesh shelf(const Order& o) {
  Mesh mesh;
  const Vec3f s = o.size_or(1.2F, 0.32F, 1.9F);
  const MaterialId wood = o.materials.get("wood", o.variant + 2);
  Rng rng = o.rng();
  box_at(mesh, -s.x() / 2 + 0.012F, 0, 0, 0.024F, s.y(), s.z(), wood);
  box_at(mesh, s.x() / 2 - 0.012F, 0, 0, 0.024F, s.y(), s.z(), wood);
  box_at(mesh, 0, s.y() / 2 - 0.006F, 0, s.x(), 0.012F, s.z(), wood);
  const int boards = std::max(2, static_cast<int>(s.z() / 0.36F));
  for (int i = 0; i <= boards; ++i) {
    const float z = (s.z() - 0.024F) * static_cast<float>(i) / static_cast<float>(boards);
    box_at(mesh, 0, 0, z, s.x() - 0.05F, s.y(), 0.024F, wood);
    if (i == boards) break;
    const auto fill = static_cast<float>(rng.uniform(0.45, 0.95)) * (s.x() - 0.06F);
    const float height = std::min(0.30F, s.z() / static_cast<float>(boards) - 0.06F);
    const float depth = 0.62F * s.y();
    const Vec3f low(-s.x() / 2 + 0.03F, s.y() / 2 - 0.02F - depth, z + 0.024F);
    const std::size_t first = mesh.triangles.size();
    add_box(mesh, low, low + Vec3f(fill, depth, height), o.materials.plain({52, 44, 40}));
    Mesh spines;  // every shelf starts elsewhere in the strip of books
    add_quad(spines, low + Vec3f(0, -0.001F, 0), {fill, 0, 0}, {0, 0, height},
             o.materials.get("books", o.variant));
    const auto shift = static_cast<float>(rng.uniform(0, 1.2));
    for (Vec2f& uv : spines.uv) uv = {uv.x() + shift, 0.32F * (1 - uv.y() / height)};
    append(mesh, spines, SE3());
    name_part(mesh, first, "book", true);
    if (fill < 0.75F * s.x()) {
      box_at(mesh, s.x() / 2 - 0.16F, 0, z + 0.024F, 0.16F, 0.16F, 0.18F,
             o.materials.get("cardboard", o.variant + i));
    }
  }
  return mesh;
}

Mesh picture_box(const Order& o, const Vec3f& s, const std::string& kind) {
  Mesh mesh;
  const MaterialId m = o.materials.get(kind, o.variant);
  const Vec3f low(-s.x() / 2, -s.y() / 2, 0);
  const Vec3f x(s.x(), 0, 0);
  const Vec3f y(0, s.y(), 0);
  const Vec3f z(0, 0, s.z());
  add_picture(mesh, low, x, z, m);
  add_picture(mesh, low + x + y, -x, z, m);
  add_picture(mesh, low + y, -y, z, m);
  add_picture(mesh, low + x, y, z, m);
  add_picture(mesh, low + z, x, y, m);
  add_picture(mesh, low, y, x, m);
  return mesh;
}

Mesh carton(const Order& o) { return picture_box(o, o.size_or(0.4F, 0.3F, 0.3F), "cardboard"); }

Mesh cabinet(const Order& o) {
  Mesh mesh;
  const Vec3f s = o.size_or(0.45F, 0.55F, 0.7F);
  add_box(mesh, {-s.x() / 2, -s.y() / 2, 0}, {s.x() / 2, s.y() / 2, s.z()},
          o.materials.plain({206, 206, 202}));
  add_picture(mesh, {-s.x() / 2, -s.y() / 2 - 0.001F, 0}, {s.x(), 0, 0}, {0, 0, s.z()},
              o.materials.get("cabinet", o.variant));
  return mesh;
}

Mesh partition(const Order& o) {
  Mesh mesh;
  const Vec3f s = o.size_or(1.6F, 0.05F, 1.4F);
  add_box(mesh, {-s.x() / 2, -s.y() / 2, 0.05F}, {s.x() / 2, s.y() / 2, s.z()},
          o.materials.get("board", o.variant));
  const MaterialId metal = o.materials.plain({176, 178, 180}, 0.7F, 0.3F);
  box_at(mesh, 0, 0, s.z(), s.x(), s.y() + 0.01F, 0.02F, metal);
  for (const float x : {-s.x() / 2, s.x() / 2})
    box_at(mesh, x, 0, 0, 0.03F, s.y() + 0.012F, s.z(), metal);
  return mesh;
}

Mesh flat_picture(const Order& o, const Vec3f& s, const std::string& kind) {
  Mesh mesh;
  box_at(mesh, 0, 0, 0, s.x(), s.y(), s.z(), o.materials.plain({90, 84, 78}));
  add_picture(mesh, {-s.x() / 2, -s.y() / 2 - 0.001F, 0}, {s.x(), 0, 0}, {0, 0, s.z()},
              o.materials.get(kind, o.variant));
  return mesh;
}

Mesh poster(const Order& o) { return flat_picture(o, o.size_or(0.6F, 0.01F, 0.8F), "poster"); }
Mesh whiteboard(const Order& o) {
  return flat_picture(o, o.size_or(1.6F, 0.02F, 1.0F), "whiteboard");
}
Mesh window(const Order& o) { return flat_picture(o, o.size_or(1.4F, 0.04F, 1.3F), "window"); }
Mesh door(const Order& o) { return flat_picture(o, o.size_or(0.92F, 0.04F, 2.05F), "door"); }

Mesh sofa(const Order& o) {
  Mesh mesh;
  const MaterialId m = o.materials.get("cloth", o.variant + 1);
  box_at(mesh, 0, 0, 0.08F, 1.8F, 0.85F, 0.34F, m);
  box_at(mesh, 0, 0.33F, 0.40F, 1.8F, 0.2F, 0.42F, m);
  for (const float x : {-0.82F, 0.82F}) box_at(mesh, x, 0, 0.3F, 0.16F, 0.85F, 0.3F, m);
  name_part(mesh, 0, "couch");
  return mesh;
}

Mesh column(const Order& o) {
  Mesh mesh;
  const Vec3f s = o.size_or(0.35F, 0.35F, 2.8F);
  add_box(mesh, {-s.x() / 2, -s.y() / 2, 0}, {s.x() / 2, s.y() / 2, s.z()},
          o.materials.get("concrete", o.variant));
  return mesh;
}

Mesh block(const Order& o) {
  Mesh mesh;
  const Vec3f s = o.size_or(0.4F, 0.4F, 0.4F);
  add_box(mesh, {-s.x() / 2, -s.y() / 2, 0}, {s.x() / 2, s.y() / 2, s.z()},
          o.materials.get("board", o.variant));
  return mesh;
}

/// A worked-at desk: monitors, keyboard, papers, mug, books.
Mesh workplace(const Order& o) {
  Mesh mesh = desk(o);
  Rng rng = o.rng();
  const double top = 0.74;
  const auto put = [&](const Mesh& thing, double x, double y, double yaw) {
    append(mesh, thing, SE3(so3_exp(Vec3(0, 0, yaw)), Vec3(x, y, top)));
  };
  const auto put_about = [&](const Mesh& thing, double left, double right, double y, double turn) {
    const double yaw = rng.uniform(-turn, turn);
    put(thing, rng.uniform(left, right), y, yaw);
  };
  const auto small = [](const char* kind, const Order& order) {
    return small_things().at(kind)(order);
  };
  const auto order = [&](int variant) { return Order{variant, std::nullopt, o.materials}; };
  put_about(monitor(order(o.variant)), -0.25, 0.05, 0.15, 0.2);
  put_about(keyboard(order(o.variant)), -0.2, 0.0, -0.18, 0.1);
  put_about(small("paper", order(o.variant)), 0.35, 0.55, -0.12, 0.6);
  put_about(small("books", order(o.variant)), 0.4, 0.6, 0.2, 0.4);
  const double mug_y = rng.uniform(-0.2, 0.1);
  put(small("mug", order(o.variant)), rng.uniform(-0.6, -0.4), mug_y, 0);
  if (o.variant % 2 == 0) put(small("bottle", order(o.variant)), 0.3, 0.1, 0);
  if (o.variant % 3 == 0) put(small("duck", order(0)), 0.27, -0.05, 0.7);
  if (o.variant % 3 == 1) put(small("lamp", order(0)), -0.6, 0.22, -0.4);
  return mesh;
}

const MakerTable& makers() {
  static const MakerTable table = [] {
    MakerTable all = {{"desk", desk},
                      {"chair", chair},
                      {"office_chair", office_chair},
                      {"monitor", monitor},
                      {"keyboard", keyboard},
                      {"shelf", shelf},
                      {"carton", carton},
                      {"cabinet", cabinet},
                      {"partition", partition},
                      {"poster", poster},
                      {"whiteboard", whiteboard},
                      {"window", window},
                      {"door", door},
                      {"sofa", sofa},
                      {"column", column},
                      {"block", block},
                      {"workplace", workplace}};
    all.insert(small_things().begin(), small_things().end());
    return all;
  }();
  return table;
}

}  // namespace

std::optional<Mesh> make_furniture(const std::string& kind, int variant,
                                   const std::optional<Vec3f>& size_m, MaterialLibrary& materials) {
  const auto found = makers().find(kind);
  if (found == makers().end()) return std::nullopt;
  return found->second(Order{variant, size_m, materials});
}

const std::vector<std::string>& furniture_kinds() {
  static const std::vector<std::string> kinds = [] {
    std::vector<std::string> names;
    for (const auto& [name, maker] : makers()) names.push_back(name);
    return names;
  }();
  return kinds;
}

}  // namespace ygslam::sim
