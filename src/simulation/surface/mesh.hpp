// Triangle meshes and the primitives that rooms and furniture are made of.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "geometry/se3.hpp"

namespace ygslam::sim {

using Vec2f = Eigen::Vector2f;
using Vec3f = Eigen::Vector3f;
using MaterialId = std::uint16_t;

struct Triangle {
  std::array<std::uint32_t, 3> corner{};  ///< indices of vertices, counter-clockwise from outside
  MaterialId material = 0;
};

/// Vertex attributes are parallel vectors. Texture coordinates are metres on the surface for tiled
/// materials and 0..1 for fitted ones (v downwards, as in images).
struct Mesh {
  std::vector<Vec3f> points;   ///< [m], frame of the object
  std::vector<Vec3f> normals;  ///< unit, outwards
  std::vector<Vec2f> uv;
  std::vector<Triangle> triangles;
};

/// Appends other, moved by T_mesh_other.
void append(Mesh& mesh, const Mesh& other, const SE3& T_mesh_other);

/// A parallelogram; its normal is edge_u x edge_v. uv in metres from the origin.
void add_quad(Mesh& mesh, const Vec3f& origin, const Vec3f& edge_u, const Vec3f& edge_v,
              MaterialId material);

/// A parallelogram that shows a picture once: origin is the picture's lower left corner.
void add_picture(Mesh& mesh, const Vec3f& origin, const Vec3f& edge_right, const Vec3f& edge_up,
                 MaterialId material);

/// Axis-aligned box between two corners.
void add_box(Mesh& mesh, const Vec3f& low, const Vec3f& high, MaterialId material);

/// Closed cylinder (or cone frustum) around the axis from base to top.
void add_cylinder(Mesh& mesh, const Vec3f& base, const Vec3f& top, float base_radius_m,
                  float top_radius_m, int sides, MaterialId material);

void add_sphere(Mesh& mesh, const Vec3f& centre, float radius_m, int rings, MaterialId material);

}  // namespace ygslam::sim
