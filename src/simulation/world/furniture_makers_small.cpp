#include <cmath>

#include "simulation/world/furniture_makers.hpp"

namespace ygslam::sim {

namespace {

Mesh paper(const Order& o) {
  Mesh mesh;
  Rng rng = o.rng();
  const int sheets = 1 + static_cast<int>(rng.below(3));
  for (int i = 0; i < sheets; ++i) {
    Mesh sheet;
    add_picture(sheet, {-0.105F, -0.148F, 0.001F + 0.001F * static_cast<float>(i)}, {0.21F, 0, 0},
                {0, 0.297F, 0}, o.materials.get("paper", o.variant + i));
    const double shift_y = rng.uniform(-0.06, 0.06);
    const Vec3 shift(rng.uniform(-0.08, 0.08), shift_y, 0);
    append(mesh, sheet, SE3(so3_exp(Vec3(0, 0, rng.uniform(-0.5, 0.5))), shift));
  }
  return mesh;
}

Mesh book_pile(const Order& o) {
  Mesh mesh;
  Rng rng = o.rng();
  float z = 0;
  const int books = 2 + static_cast<int>(rng.below(4));
  for (int i = 0; i < books; ++i) {
    Order one{o.variant * 5 + i, std::nullopt, o.materials};
    const auto thick = static_cast<float>(rng.uniform(0.015, 0.045));
    Mesh book;
    const auto w = static_cast<float>(rng.uniform(0.15, 0.21));
    box_at(book, 0, 0, 0, w, w * 1.35F, thick,
           o.materials.plain({static_cast<float>(60 + rng.below(160)),
                              static_cast<float>(60 + rng.below(160)),
                              static_cast<float>(60 + rng.below(160))}));
    add_picture(book, {-w / 2, -w * 0.675F, thick + 0.0005F}, {w, 0, 0}, {0, w * 1.35F, 0},
                o.materials.get("poster", one.variant % 7));
    append(mesh, book, SE3(so3_exp(Vec3(0, 0, rng.uniform(-0.3, 0.3))), Vec3(0, 0, z)));
    z += thick;
  }
  name_part(mesh, 0, "book", true);
  return mesh;
}

Mesh mug(const Order& o) {
  Mesh mesh;
  Rng rng = o.rng();
  const MaterialId m = o.materials.plain(
      {static_cast<float>(80 + rng.below(170)), static_cast<float>(80 + rng.below(170)),
       static_cast<float>(80 + rng.below(170))},
      0.9F, 0.3F);
  add_cylinder(mesh, {0, 0, 0}, {0, 0, 0.095F}, 0.038F, 0.042F, 18, m);
  box_at(mesh, 0.05F, 0, 0.02F, 0.025F, 0.012F, 0.055F, m);
  name_part(mesh, 0, "cup");
  return mesh;
}

Mesh bottle(const Order& o) {
  Mesh mesh;
  const MaterialId m =
      o.materials.plain(o.variant % 2 == 0 ? Vec3f(70, 150, 80) : Vec3f(60, 90, 150), 0.1F, 0.5F);
  add_cylinder(mesh, {0, 0, 0}, {0, 0, 0.19F}, 0.034F, 0.034F, 16, m);
  add_cylinder(mesh, {0, 0, 0.19F}, {0, 0, 0.25F}, 0.034F, 0.012F, 16, m);
  add_cylinder(mesh, {0, 0, 0.07F}, {0, 0, 0.14F}, 0.0345F, 0.0345F, 16,
               o.materials.plain({230, 226, 210}));
  name_part(mesh, 0, "bottle");
  return mesh;
}

Mesh lamp(const Order& o) {
  Mesh mesh;
  const MaterialId m = o.materials.plain({60, 62, 66}, 0.6F, 0.3F);
  add_cylinder(mesh, {0, 0, 0}, {0, 0, 0.02F}, 0.09F, 0.09F, 18, m);
  add_cylinder(mesh, {0, 0, 0.02F}, {0.05F, 0, 0.36F}, 0.01F, 0.01F, 8, m);
  add_cylinder(mesh, {0.05F, 0, 0.36F}, {0.2F, -0.1F, 0.46F}, 0.01F, 0.01F, 8, m);
  add_cylinder(mesh, {0.2F, -0.1F, 0.46F}, {0.24F, -0.12F, 0.38F}, 0.03F, 0.08F, 16,
               o.materials.plain({190, 60, 50}, 0.8F, 0.2F));
  return mesh;
}

Mesh plant(const Order& o) {
  Mesh mesh;
  Rng rng = o.rng();
  const float height = o.size_or(0.6F, 0.6F, 1.2F).z();
  add_cylinder(mesh, {0, 0, 0}, {0, 0, 0.28F * height}, 0.11F * height, 0.15F * height, 18,
               o.materials.plain({156, 96, 70}));
  const MaterialId green = o.materials.get("plant", o.variant);
  for (int i = 0; i < 26; ++i) {
    const auto a = static_cast<float>(rng.uniform(0, 6.28));
    const auto reach = static_cast<float>(rng.uniform(0.1, 0.36)) * height;
    const auto top = static_cast<float>(rng.uniform(0.5, 1.0)) * height;
    const Vec3f out(std::cos(a), std::sin(a), 0);
    const Vec3f side(-out.y() * 0.05F * height, out.x() * 0.05F * height, 0);
    const Vec3f foot(0, 0, 0.28F * height);
    const Vec3f tip = out * reach + Vec3f(0, 0, top);
    const Vec3f from = foot + 0.35F * (tip - foot);
    add_quad(mesh, from - side, 2 * side, tip - from, green);
    add_quad(mesh, from + side, -2 * side, tip - from, green);
  }
  name_part(mesh, 0, "potted plant");
  return mesh;
}

Mesh duck(const Order& o) {
  Mesh mesh;
  const MaterialId yellow = o.materials.plain({240, 196, 40});
  add_sphere(mesh, {0, 0, 0.035F}, 0.035F, 8, yellow);
  add_sphere(mesh, {0, -0.025F, 0.085F}, 0.024F, 8, yellow);
  add_cylinder(mesh, {0, -0.045F, 0.083F}, {0, -0.065F, 0.08F}, 0.009F, 0.004F, 8,
               o.materials.plain({230, 100, 40}));
  return mesh;
}

Mesh ball(const Order& o) {
  Mesh mesh;
  const float radius = o.size_or(0.22F, 0.22F, 0.22F).x() / 2;
  add_sphere(mesh, Vec3f::Zero(), radius, 16, o.materials.get("ball", o.variant));
  name_part(mesh, 0, "sports ball");
  return mesh;
}

Mesh bin(const Order& o) {
  Mesh mesh;
  add_cylinder(mesh, {0, 0, 0}, {0, 0, 0.32F}, 0.11F, 0.15F, 20,
               o.materials.plain({60, 70, 84}, 0.7F));
  return mesh;
}
}  // namespace

const MakerTable& small_things() {
  static const MakerTable table = {{"paper", paper},   {"books", book_pile}, {"mug", mug},
                                   {"bottle", bottle}, {"lamp", lamp},       {"plant", plant},
                                   {"duck", duck},     {"ball", ball},       {"bin", bin}};
  return table;
}

}  // namespace ygslam::sim
