#include "dense/scene_naming/edge_labels.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

constexpr int kRings = 2;  // so many edges of the mesh from where labels change, ends included
constexpr double kLeastDepth_m = 0.2;
// A pixel shows the vertex if its depth is off by at most kMargin_m + kMarginSigmas * sigma.
constexpr double kMargin_m = 0.01, kMarginSigmas = 3;

/// Of each vertex, whether another number lies in one of the rings about it.
std::vector<bool> near_edges(const TriangleMesh& mesh) {
  std::vector<bool> is_near(mesh.vertices.size(), false);
  for (const auto& t : mesh.triangles) {
    const auto object = [&](std::size_t i) { return mesh.vertices[t[i]].label.object; };
    if (object(0) == object(1) && object(0) == object(2)) continue;
    for (const std::uint32_t vertex : t) is_near[vertex] = true;
  }
  for (int ring = 1; ring < kRings; ++ring) {
    const std::vector<bool> inner = is_near;
    for (const auto& t : mesh.triangles)
      if (inner[t[0]] || inner[t[1]] || inner[t[2]])
        for (const std::uint32_t vertex : t) is_near[vertex] = true;
  }
  return is_near;
}

}  // namespace

EdgeLabels::EdgeLabels(const TriangleMesh& mesh, const PreparationConfig& preparation)
    : noise_(preparation.noise), max_depth_m_(preparation.max_depth_m) {
  const std::vector<bool> is_near = near_edges(mesh);
  for (std::uint32_t i = 0; i < mesh.vertices.size(); ++i)
    if (is_near[i]) vertices_.push_back({i, mesh.vertices[i].p_world.cast<double>(), 0, {}});
}

void EdgeLabels::add_votes(const DepthView& view, const SE3& T_world_camera) {
  const SE3 T_camera_world = T_world_camera.inverse();
  const Pinhole& camera = view.camera;
  for (Vertex& vertex : vertices_) {
    const Vec3 p = T_camera_world * vertex.p_world;
    if (p.z() < kLeastDepth_m || p.z() > max_depth_m_) continue;
    const double x = camera.fx * p.x() / p.z() + camera.cx + 0.5;
    const double y = camera.fy * p.y() / p.z() + camera.cy + 0.5;
    if (!(x >= 0 && y >= 0 && x < camera.width && y < camera.height)) continue;
    const int u = static_cast<int>(x), v = static_cast<int>(y);
    const double depth_m = view.depth.at(u, v) * DepthView::kUnit_m;
    const auto sigma_m = static_cast<double>(noise_.sigma_m(static_cast<float>(p.z())));
    if (depth_m <= 0 || std::abs(depth_m - p.z()) > kMargin_m + kMarginSigmas * sigma_m) continue;
    const std::uint8_t shown = view.object.at(u, v);
    if (shown != DepthView::kNothing && !DepthView::is_object(shown)) continue;
    const SceneObjectId object =
        shown == DepthView::kNothing ? kNoSceneObject : view.objects[shown - 1U];
    if (object == kNoSceneObject) {
      ++vertex.votes_for_none;
      continue;
    }
    const auto known = std::lower_bound(
        vertex.votes.begin(), vertex.votes.end(), object,
        [](const auto& entry, SceneObjectId wanted) { return entry.first < wanted; });
    if (known != vertex.votes.end() && known->first == object)
      ++known->second;
    else
      vertex.votes.insert(known, {object, 1});
  }
}

void EdgeLabels::write_labels(TriangleMesh& mesh) const {
  for (const Vertex& vertex : vertices_) {
    int all = vertex.votes_for_none, most = 0;
    SceneObjectId best = kNoSceneObject;
    for (const auto& [object, count] : vertex.votes) {
      all += count;
      if (count <= most) continue;
      most = count;
      best = object;
    }
    if (all == 0) continue;
    if (most < vertex.votes_for_none) {
      best = kNoSceneObject;
      most = vertex.votes_for_none;
    }
    SurfaceLabel& label = mesh.vertices[vertex.index].label;
    label.object = best;
    label.probability = static_cast<float>(most) / static_cast<float>(all);
  }
}

}  // namespace ygslam
