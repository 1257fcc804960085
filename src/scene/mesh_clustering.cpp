#include "scene/mesh_clustering.hpp"

#include <algorithm>
#include <numeric>
#include <unordered_map>

#include "core/check.hpp"

namespace ygslam {
namespace {

constexpr int kBits = 21;
constexpr int kBias = 1 << (kBits - 1);

/// Ascending in (z, y, x).
std::uint64_t key_of(const Eigen::Vector3i& cell) {
  const auto part = [](int i) {
    return static_cast<std::uint64_t>(std::clamp(i, -kBias, kBias - 1) + kBias);
  };
  return part(cell.z()) << (2 * kBits) | part(cell.y()) << kBits | part(cell.x());
}

struct Cluster {
  std::uint64_t key = 0;
  Eigen::Vector3i cell = Eigen::Vector3i::Zero();
  Eigen::Vector3d place_sum = Eigen::Vector3d::Zero(), normal_sum = Eigen::Vector3d::Zero();
  std::array<std::uint32_t, 3> colour_sum{};
  std::uint32_t count = 0;
  SurfaceLabel label;  // by the majority vote of Boyer & Moore 1981
  int lead = 0;

  void add(const SurfacePoint& vertex) {
    place_sum += vertex.p_world.cast<double>();
    normal_sum += vertex.normal_world.cast<double>();
    colour_sum[0] += vertex.colour.r;
    colour_sum[1] += vertex.colour.g;
    colour_sum[2] += vertex.colour.b;
    ++count;
    if (lead == 0) label = vertex.label;
    lead += vertex.label.semantic_class == label.semantic_class ? 1 : -1;
  }
  [[nodiscard]] SurfacePoint mean() const {
    SurfacePoint point;
    point.p_world = (place_sum / count).cast<float>();
    const double length = normal_sum.norm();
    if (length > 0) point.normal_world = (normal_sum / length).cast<float>();
    const auto channel = [&](std::size_t i) {
      return static_cast<std::uint8_t>((colour_sum[i] + count / 2) / count);
    };
    point.colour = {channel(0), channel(1), channel(2)};
    point.label = label;
    return point;
  }
};

}  // namespace

ClusteredMesh clustered_mesh(const TriangleMesh& mesh, double cell_m) {
  CHECK(cell_m > 0);
  std::vector<Cluster> clusters;
  std::unordered_map<std::uint64_t, std::uint32_t> number_of;
  std::vector<std::uint32_t> cluster_of;
  cluster_of.reserve(mesh.vertices.size());
  for (const SurfacePoint& vertex : mesh.vertices) {
    const Eigen::Vector3i cell =
        (vertex.p_world.cast<double>() / cell_m).array().floor().cast<int>();
    const std::uint64_t key = key_of(cell);
    const auto [found, is_new] =
        number_of.try_emplace(key, static_cast<std::uint32_t>(clusters.size()));
    if (is_new) clusters.emplace_back();
    Cluster& cluster = clusters[found->second];
    cluster.key = key;
    cluster.cell = cell;
    cluster.add(vertex);
    cluster_of.push_back(found->second);
  }
  std::vector<std::uint32_t> order(clusters.size()), place(clusters.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, {}, [&](std::uint32_t i) { return clusters[i].key; });

  ClusteredMesh result{cell_m, {}, {}};
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    place[order[i]] = i;
    result.mesh.vertices.push_back(clusters[order[i]].mean());
    result.cells.push_back(clusters[order[i]].cell);
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    std::array<std::uint32_t, 3> t{place[cluster_of[a]], place[cluster_of[b]],
                                   place[cluster_of[c]]};
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    std::ranges::rotate(t, std::ranges::min_element(t));  // the same turn, the same triple
    result.mesh.triangles.push_back(t);
  }
  std::ranges::sort(result.mesh.triangles);
  const auto [last, end] = std::ranges::unique(result.mesh.triangles);
  result.mesh.triangles.erase(last, end);
  return result;
}

ClusteredMesh without_specks(ClusteredMesh mesh, double least_m2) {
  // Pieces as trees of vertices, each of which points to the root of all (Tarjan 1975).
  std::vector<std::uint32_t> parent(mesh.mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&parent](std::uint32_t vertex) {
    while (parent[vertex] != vertex) vertex = parent[vertex] = parent[parent[vertex]];
    return vertex;
  };
  for (const auto& triangle : mesh.mesh.triangles)
    for (const std::uint32_t corner : triangle) parent[root(corner)] = root(triangle[0]);
  std::vector<double> area_m2(parent.size(), 0);
  for (const auto& triangle : mesh.mesh.triangles) {
    const auto& p = mesh.mesh.vertices;
    const Eigen::Vector3f side = p[triangle[1]].p_world - p[triangle[0]].p_world;
    const Eigen::Vector3f other = p[triangle[2]].p_world - p[triangle[0]].p_world;
    area_m2[root(triangle[0])] += 0.5 * static_cast<double>(side.cross(other).norm());
  }
  std::erase_if(mesh.mesh.triangles,
                [&](const auto& triangle) { return area_m2[root(triangle[0])] < least_m2; });
  return mesh;
}

}  // namespace ygslam
