// Triangle meshes and the primitives that rooms and furniture are made of.
#pragma once

#include <array>
#include <cstdint>
#include <string>
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

/// Triangles of a mesh, [first, end), that are a thing or a part of the room with a name.
struct NamedPart {
  std::string class_name;  ///< COCO's, or "floor", "wall", "ceiling"
  bool is_group = false;   ///< several things of the class that touch: a pile of books
  std::uint32_t first = 0, end = 0;
  double yaw_rad = 0;  ///< of its front about the mesh's z, 0 = towards -y
};

/// Vertex attributes are parallel vectors. Texture coordinates are metres on the surface for tiled
/// materials and 0..1 for fitted ones (v downwards, as in images).
struct Mesh {
  std::vector<Vec3f> points;   ///< [m], frame of the object
  std::vector<Vec3f> normals;  ///< unit, outwards
  std::vector<Vec2f> uv;
  std::vector<Triangle> triangles;
  std::vector<NamedPart> parts;  ///< in ascending order, apart from one another
};

/// Appends other, moved by T_mesh_other.
void append(Mesh& mesh, const Mesh& other, const SE3& T_mesh_other);

/// Names the triangles from `first` to the last so far.
void name_part(Mesh& mesh, std::size_t first, const char* class_name, bool is_group = false);

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
