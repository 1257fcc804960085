#include "simulation/surface/mesh.hpp"

#include <cmath>
#include <numbers>

namespace ygslam::sim {

namespace {

std::uint32_t add_vertex(Mesh& mesh, const Vec3f& point, const Vec3f& normal, const Vec2f& uv) {
  mesh.points.push_back(point);
  mesh.normals.push_back(normal);
  mesh.uv.push_back(uv);
  return static_cast<std::uint32_t>(mesh.points.size() - 1);
}

void add_parallelogram(Mesh& mesh, const Vec3f& origin, const Vec3f& edge_u, const Vec3f& edge_v,
                       const std::array<Vec2f, 4>& uv, MaterialId material) {
  const Vec3f normal = edge_u.cross(edge_v).normalized();
  const std::uint32_t a = add_vertex(mesh, origin, normal, uv[0]);
  const std::uint32_t b = add_vertex(mesh, origin + edge_u, normal, uv[1]);
  const std::uint32_t c = add_vertex(mesh, origin + edge_u + edge_v, normal, uv[2]);
  const std::uint32_t d = add_vertex(mesh, origin + edge_v, normal, uv[3]);
  mesh.triangles.push_back({{a, b, c}, material});
  mesh.triangles.push_back({{a, c, d}, material});
}

}  // namespace

void append(Mesh& mesh, const Mesh& other, const SE3& T_mesh_other) {
  const auto offset = static_cast<std::uint32_t>(mesh.points.size());
  const auto first_triangle = static_cast<std::uint32_t>(mesh.triangles.size());
  const double yaw_rad = std::atan2(T_mesh_other.R()(1, 0), T_mesh_other.R()(0, 0));
  for (NamedPart part : other.parts) {
    part.first += first_triangle;
    part.end += first_triangle;
    part.yaw_rad += yaw_rad;
    mesh.parts.push_back(std::move(part));
  }
  const Eigen::Matrix3f R = T_mesh_other.R().cast<float>();
  const Vec3f t = T_mesh_other.t().cast<float>();
  for (const Vec3f& p : other.points) mesh.points.emplace_back(R * p + t);
  for (const Vec3f& n : other.normals) mesh.normals.emplace_back(R * n);
  mesh.uv.insert(mesh.uv.end(), other.uv.begin(), other.uv.end());
  for (Triangle triangle : other.triangles) {
    for (std::uint32_t& corner : triangle.corner) corner += offset;
    mesh.triangles.push_back(triangle);
  }
}

void name_part(Mesh& mesh, std::size_t first, const char* class_name, bool is_group) {
  mesh.parts.push_back({class_name, is_group, static_cast<std::uint32_t>(first),
                        static_cast<std::uint32_t>(mesh.triangles.size()), 0});
}

void add_quad(Mesh& mesh, const Vec3f& origin, const Vec3f& edge_u, const Vec3f& edge_v,
              MaterialId material) {
  const float width = edge_u.norm();
  const float height = edge_v.norm();
  add_parallelogram(mesh, origin, edge_u, edge_v,
                    {Vec2f(0, 0), Vec2f(width, 0), Vec2f(width, height), Vec2f(0, height)},
                    material);
}

void add_picture(Mesh& mesh, const Vec3f& origin, const Vec3f& edge_right, const Vec3f& edge_up,
                 MaterialId material) {
  add_parallelogram(mesh, origin, edge_right, edge_up,
                    {Vec2f(0, 1), Vec2f(1, 1), Vec2f(1, 0), Vec2f(0, 0)}, material);
}

void add_box(Mesh& mesh, const Vec3f& low, const Vec3f& high, MaterialId material) {
  const Vec3f size = high - low;
  const Vec3f x(size.x(), 0, 0);
  const Vec3f y(0, size.y(), 0);
  const Vec3f z(0, 0, size.z());
  add_quad(mesh, low, y, x, material);           // bottom
  add_quad(mesh, low + z, x, y, material);       // top
  add_quad(mesh, low, x, z, material);           // -y
  add_quad(mesh, low + x + y, -x, z, material);  // +y
  add_quad(mesh, low + y, -y, z, material);      // -x
  add_quad(mesh, low + x, y, z, material);       // +x
}

void add_cylinder(Mesh& mesh, const Vec3f& base, const Vec3f& top, float base_radius_m,
                  float top_radius_m, int sides, MaterialId material) {
  const Vec3f axis = top - base;
  const float length = axis.norm();
  const Vec3f w = axis / length;
  const Vec3f u = (std::abs(w.z()) < 0.9F ? Vec3f::UnitZ() : Vec3f::UnitX()).cross(w).normalized();
  const Vec3f v = w.cross(u);
  const float slope = (base_radius_m - top_radius_m) / length;
  const auto first = static_cast<std::uint32_t>(mesh.points.size());
  const std::uint32_t base_centre = add_vertex(mesh, base, -w, {0, 0});
  const std::uint32_t top_centre = add_vertex(mesh, top, w, {0, 0});
  for (int i = 0; i <= sides; ++i) {
    const float angle =
        2.0F * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(sides);
    const Vec3f out = std::cos(angle) * u + std::sin(angle) * v;
    const Vec3f low = base + base_radius_m * out;
    const Vec3f high = top + top_radius_m * out;
    const Vec3f normal = (out + slope * w).normalized();
    const float around = angle * std::max(base_radius_m, top_radius_m);
    add_vertex(mesh, low, normal, {around, 0});
    add_vertex(mesh, high, normal, {around, length});
    add_vertex(mesh, low, -w, {low.dot(u), low.dot(v)});
    add_vertex(mesh, high, w, {high.dot(u), high.dot(v)});
  }
  for (int i = 0; i < sides; ++i) {
    const std::uint32_t a = first + 2 + 4 * static_cast<std::uint32_t>(i);
    const std::uint32_t b = a + 4;
    mesh.triangles.push_back({{a, b, b + 1}, material});
    mesh.triangles.push_back({{a, b + 1, a + 1}, material});
    mesh.triangles.push_back({{base_centre, b + 2, a + 2}, material});
    mesh.triangles.push_back({{top_centre, a + 3, b + 3}, material});
  }
}

void add_sphere(Mesh& mesh, const Vec3f& centre, float radius_m, int rings, MaterialId material) {
  const auto first = static_cast<std::uint32_t>(mesh.points.size());
  const int sides = 2 * rings;
  constexpr float kHalfTurn_rad = std::numbers::pi_v<float>;
  for (int r = 0; r <= rings; ++r) {
    const float polar = kHalfTurn_rad * static_cast<float>(r) / static_cast<float>(rings);
    for (int s = 0; s <= sides; ++s) {
      const float angle = 2.0F * kHalfTurn_rad * static_cast<float>(s) / static_cast<float>(sides);
      const Vec3f n(std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle),
                    std::cos(polar));
      add_vertex(mesh, centre + radius_m * n, n, {angle * radius_m, polar * radius_m});
    }
  }
  const auto stride = static_cast<std::uint32_t>(sides + 1);
  for (std::uint32_t r = 0; r < static_cast<std::uint32_t>(rings); ++r) {
    for (std::uint32_t s = 0; s + 1 < stride; ++s) {
      const std::uint32_t a = first + r * stride + s;
      const std::uint32_t b = a + stride;
      mesh.triangles.push_back({{a, b, b + 1}, material});
      mesh.triangles.push_back({{a, b + 1, a + 1}, material});
    }
  }
}

}  // namespace ygslam::sim
