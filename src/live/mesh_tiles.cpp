#include "live/mesh_tiles.hpp"

#include <cmath>
#include <cstdlib>
#include <unordered_map>

#include "live/run_messages.hpp"
#include "scene/class_colour.hpp"

namespace ygslam {
namespace {

/// Along a tile.
constexpr std::array kCells = {40, 32, 25, 20, 16, 12, 10, 8, 6, 5, 4, 2, 1};
/// A corner that moved by so little, or changed its colour by so little, is where it was: else
/// noise would change every tile that is in view.
constexpr double kSameShare = 0.1;  // of a cell
constexpr int kSameColour = 16;

ros::Colour to_ros(Rgb8 c) {
  constexpr float kFull = 255;
  return {static_cast<float>(c.r) / kFull, static_cast<float>(c.g) / kFull,
          static_cast<float>(c.b) / kFull, 1};
}

bool is_near(Rgb8 a, Rgb8 b) {
  return std::abs(a.r - b.r) <= kSameColour && std::abs(a.g - b.g) <= kSameColour &&
         std::abs(a.b - b.b) <= kSameColour;
}

/// The class of two corners at least; where all differ, the first's.
SemanticClass class_of(const std::vector<SurfacePoint>& vertices,
                       const std::array<std::uint32_t, 3>& triangle) {
  const auto of = [&](std::size_t k) { return vertices[triangle[k]].label.semantic_class; };
  return of(1) == of(2) ? of(1) : of(0);
}

}  // namespace

ClusteredMesh reduced_mesh(const TriangleMesh& mesh, double finest_cell_m,
                           std::size_t most_triangles) {
  constexpr double kSlack = 1e-9;
  for (const int cells : kCells) {
    const double cell_m = static_cast<double>(kTile_m) / cells;
    if (cell_m < finest_cell_m - kSlack && cells > 1) continue;
    ClusteredMesh coarse = clustered_mesh(mesh, cell_m);
    if (coarse.mesh.triangles.size() <= most_triangles || cells == 1) return coarse;
  }
  return {};
}

std::map<MeshTiles::Place, MeshTiles::Look> MeshTiles::looks(const ClusteredMesh& mesh) {
  std::map<Place, Look> looks;
  std::map<Place, std::unordered_map<std::uint32_t, std::uint32_t>> numbers;
  const int cells = static_cast<int>(std::lround(kTile_m / mesh.cell_m));
  for (std::array<std::uint32_t, 3> triangle : mesh.mesh.triangles) {
    Place place{};
    for (int axis = 0; axis < 3; ++axis) {
      const int cell = mesh.cells[triangle[0]][axis];
      place[static_cast<std::size_t>(axis)] =
          (cell - (cell < 0 ? cells - 1 : 0)) / cells;  // rounded down
    }
    Look& look = looks[place];
    auto& number_of = numbers[place];
    for (std::uint32_t& corner : triangle) {
      const auto [number, is_new] =
          number_of.try_emplace(corner, static_cast<std::uint32_t>(look.vertices.size()));
      if (is_new) look.vertices.push_back(mesh.mesh.vertices[corner]);
      corner = number->second;
    }
    look.triangles.push_back(triangle);
  }
  return looks;
}

bool MeshTiles::is_same(const Look& a, const Look& b, double cell_m) const {
  if (a.triangles != b.triangles || a.vertices.size() != b.vertices.size()) return false;
  const auto moved_m = static_cast<float>(kSameShare * cell_m);
  for (std::size_t i = 0; i < a.vertices.size(); ++i) {
    const SurfacePoint &p = a.vertices[i], &q = b.vertices[i];
    if ((p.p_world - q.p_world).cwiseAbs().maxCoeff() > moved_m) return false;
    const bool is_same_colour = colours_ == Colours::kSeen
                                    ? is_near(p.colour, q.colour)
                                    : p.label.semantic_class == q.label.semantic_class;
    if (!is_same_colour) return false;
  }
  return true;
}

std::vector<ros::Marker> MeshTiles::markers(Told& told, ros::Time stamp) const {
  ros::Marker empty;
  empty.header = {stamp, "map"};
  empty.id = static_cast<std::int32_t>(told.number);
  empty.type = ros::Marker::kTriangleList;
  empty.action = ros::Marker::kDelete;
  empty.scale = {1, 1, 1};
  std::map<SemanticClass, ros::Marker> of_class;
  for (const SemanticClass known : told.classes) of_class.emplace(known, empty);
  for (const auto& triangle : told.look.triangles) {
    const SemanticClass key = colours_ == Colours::kSeen ? SemanticClass::kUnknown
                                                         : class_of(told.look.vertices, triangle);
    told.classes.insert(key);
    ros::Marker& marker = of_class.try_emplace(key, empty).first->second;
    marker.action = ros::Marker::kAdd;
    for (const std::uint32_t corner : triangle) {
      const SurfacePoint& vertex = told.look.vertices[corner];
      const Vec3 p_map = T_body_optical() * vertex.p_world.cast<double>();
      marker.points.push_back({p_map.x(), p_map.y(), p_map.z()});
      if (colours_ == Colours::kSeen) marker.colours.push_back(to_ros(vertex.colour));
    }
  }
  std::vector<ros::Marker> markers;
  for (auto& [semantic_class, marker] : of_class) {
    if (colours_ == Colours::kSeen) {
      marker.ns = "mesh";
    } else {
      marker.ns = semantic_class_name(semantic_class);
      marker.colour = to_ros(class_colour(semantic_class));
    }
    markers.push_back(std::move(marker));
  }
  return markers;
}

std::vector<MeshTile> MeshTiles::changed(const ClusteredMesh& mesh, ros::Time stamp) {
  std::map<Place, Look> now = looks(mesh);
  for (const auto& [place, told] : told_) now.try_emplace(place);  // those that went are empty
  std::vector<MeshTile> tiles;
  for (auto& [place, look] : now) {
    const auto [it, is_new] = told_.try_emplace(place);
    Told& told = it->second;
    if (is_new) told.number = static_cast<std::uint32_t>(told_.size());
    if (!is_new && is_same(told.look, look, mesh.cell_m)) continue;
    told.look = std::move(look);
    tiles.push_back({told.number, markers(told, stamp)});
  }
  return tiles;
}

}  // namespace ygslam
