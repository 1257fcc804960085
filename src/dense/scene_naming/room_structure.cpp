#include "dense/scene_naming/room_structure.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <vector>

namespace ygslam {

std::vector<double> vertex_areas_m2(const TriangleMesh& mesh) {
  std::vector<double> areas(mesh.vertices.size(), 0);
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3f& a = mesh.vertices[triangle[0]].p_world;
    const Eigen::Vector3f& b = mesh.vertices[triangle[1]].p_world;
    const Eigen::Vector3f& c = mesh.vertices[triangle[2]].p_world;
    const double area_m2 = 0.5 * static_cast<double>((b - a).cross(c - a).norm());
    for (const std::uint32_t corner : triangle) areas[corner] += area_m2 / 3;
  }
  return areas;
}

namespace {

constexpr double kHeightBin_m = 0.02;
constexpr double kLevelCos = 0.94;      // within 20 degrees of up
constexpr double kUprightSin = 0.26;    // within 15 degrees of level
constexpr std::size_t kAzimuths = 180;  // of walls: bins of 2 degrees
constexpr std::size_t kPeakReach = 4;   // bins to either side that belong to a peak
constexpr double kWallCos = 0.97;       // within 14 degrees of what a wall faces
constexpr double kSlice_m = 0.02;       // of walls, by distance
constexpr double kFacingCos = 0.9;
constexpr int kFillRounds = 3;
constexpr std::array kStructure = {SemanticClass::kFloor, SemanticClass::kCeiling,
                                   SemanticClass::kWall};

/// Mean direction of the surfaces that face up or down, in a narrowing cone around the last one.
Vec3 refined_up(const TriangleMesh& mesh, const std::vector<double>& areas_m2, const Vec3& guess,
                double max_tilt_rad) {
  Vec3 up = guess.normalized();
  for (double cone_rad = max_tilt_rad; cone_rad > 0.08; cone_rad *= 0.7) {
    const double least_cos = std::cos(cone_rad);
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < areas_m2.size(); ++i) {
      const Vec3 normal = mesh.vertices[i].normal_world.cast<double>();
      const double cosine = normal.dot(up);
      if (std::abs(cosine) >= least_cos) sum += std::copysign(areas_m2[i], cosine) * normal;
    }
    if (sum.norm() > 0) up = sum.normalized();
  }
  return up;
}

/// Area by height of the surfaces whose normal's part along up is within [low, high].
std::map<int, double> area_by_height(const TriangleMesh& mesh, const std::vector<double>& areas_m2,
                                     const Vec3& up, double low, double high) {
  std::map<int, double> area;
  for (std::size_t i = 0; i < areas_m2.size(); ++i) {
    const SurfacePoint& vertex = mesh.vertices[i];
    const double cosine = vertex.normal_world.cast<double>().dot(up);
    if (cosine < low || cosine > high) continue;
    const double height_m = vertex.p_world.cast<double>().dot(up);
    area[static_cast<int>(std::floor(height_m / kHeightBin_m))] += areas_m2[i];
  }
  return area;
}

/// Area within plane_m of a bin's middle.
double area_near(const std::map<int, double>& area, int bin, double plane_m) {
  const int reach = static_cast<int>(plane_m / kHeightBin_m);
  double sum = 0;
  for (auto it = area.lower_bound(bin - reach); it != area.end() && it->first <= bin + reach; ++it)
    sum += it->second;
  return sum;
}

/// Height of the plane with most area among those next to the first (in the order of `bins`) that
/// has enough.
template <typename Bins>
std::optional<double> first_plane_m(const std::map<int, double>& area, const Bins& bins,
                                    double min_m2, double plane_m) {
  const int reach = 2 * static_cast<int>(plane_m / kHeightBin_m);
  for (const int first : bins) {
    if (area_near(area, first, plane_m) < min_m2) continue;
    int best = first;
    for (int bin = first - reach; bin <= first + reach; ++bin)
      if (area_near(area, bin, plane_m) > area_near(area, best, plane_m)) best = bin;
    double weighted = 0, sum = 0;
    for (auto it = area.lower_bound(best - reach / 2);
         it != area.end() && it->first <= best + reach / 2; ++it) {
      weighted += it->second * (it->first + 0.5) * kHeightBin_m;
      sum += it->second;
    }
    return weighted / sum;
  }
  return std::nullopt;
}

/// Upright surfaces by direction and distance. Directions are those that many surfaces face, told
/// to a fraction of a degree: a wall 8 m from the origin is off by 7 cm for half a degree.
class Walls {
 public:
  Walls(const TriangleMesh& mesh, const std::vector<double>& areas_m2, const Vec3& up,
        const RoomStructureConfig& config)
      : up_(up), x_(up.unitOrthogonal()), y_(up.cross(x_)), config_(config) {
    find_directions(mesh, areas_m2);
    for (std::size_t i = 0; i < areas_m2.size(); ++i) {
      const SurfacePoint& vertex = mesh.vertices[i];
      if (!is_upright(vertex)) continue;
      const double height_m = vertex.p_world.cast<double>().dot(up_);
      for (Direction& direction : directions_) {
        if (!faces(vertex, direction)) continue;
        Slice& slice = direction.slices[slice_of(vertex, direction)];
        slice.area_m2 += areas_m2[i];
        slice.low_m = std::min(slice.low_m, height_m);
        slice.high_m = std::max(slice.high_m, height_m);
      }
    }
  }

  /// Whether the vertex lies in a plane of which enough is seen, and faces as it does.
  [[nodiscard]] bool have(const SurfacePoint& vertex) const {
    return is_upright(vertex) &&
           std::any_of(directions_.begin(), directions_.end(), [&](const Direction& direction) {
             return faces(vertex, direction) && is_large(direction, slice_of(vertex, direction));
           });
  }

 private:
  struct Slice {
    double area_m2 = 0;
    double low_m = 1e9, high_m = -1e9;
  };
  struct Direction {
    Vec3 normal_world;
    std::map<int, Slice> slices;  // by distance
  };

  [[nodiscard]] bool is_upright(const SurfacePoint& vertex) const {
    return std::abs(vertex.normal_world.cast<double>().dot(up_)) <= kUprightSin;
  }
  [[nodiscard]] static bool faces(const SurfacePoint& vertex, const Direction& direction) {
    return vertex.normal_world.cast<double>().dot(direction.normal_world) >= kWallCos;
  }
  [[nodiscard]] static int slice_of(const SurfacePoint& vertex, const Direction& direction) {
    const double distance_m = vertex.p_world.cast<double>().dot(direction.normal_world);
    return static_cast<int>(std::floor(distance_m / kSlice_m));
  }
  [[nodiscard]] bool is_large(const Direction& direction, int middle) const {
    const int reach = static_cast<int>(config_.plane_m / kSlice_m);
    Slice sum;
    for (auto at = direction.slices.lower_bound(middle - reach);
         at != direction.slices.end() && at->first <= middle + reach; ++at) {
      sum.area_m2 += at->second.area_m2;
      sum.low_m = std::min(sum.low_m, at->second.low_m);
      sum.high_m = std::max(sum.high_m, at->second.high_m);
    }
    return sum.area_m2 >= config_.min_wall_m2 &&
           sum.high_m - sum.low_m >= config_.min_wall_height_m;
  }

  /// Where the area by azimuth has a peak; then the mean normal of what faces there.
  void find_directions(const TriangleMesh& mesh, const std::vector<double>& areas_m2) {
    std::array<double, kAzimuths> area{}, around{};
    const auto bin_of = [&](const Vec3& normal) {
      const double turn = std::atan2(normal.dot(y_), normal.dot(x_)) / (2 * std::numbers::pi) + 1;
      return static_cast<std::size_t>(std::floor(turn * kAzimuths + 0.5)) % kAzimuths;
    };
    for (std::size_t i = 0; i < areas_m2.size(); ++i)
      if (is_upright(mesh.vertices[i]))
        area[bin_of(mesh.vertices[i].normal_world.cast<double>())] += areas_m2[i];
    const auto beside = [](std::size_t bin, std::size_t steps) {
      return (bin + steps) % kAzimuths;
    };
    for (std::size_t bin = 0; bin < kAzimuths; ++bin)
      for (std::size_t k = kAzimuths - kPeakReach; k <= kAzimuths + kPeakReach; ++k)
        around[bin] += area[beside(bin, k)];
    for (std::size_t bin = 0; bin < kAzimuths; ++bin) {
      bool is_peak = around[bin] >= config_.min_wall_m2;
      for (std::size_t k = 1; k <= kPeakReach; ++k)  // the first of equals
        is_peak = is_peak && around[bin] >= around[beside(bin, k)] &&
                  around[bin] > around[beside(bin, kAzimuths - k)];
      if (!is_peak) continue;
      const double angle = 2 * std::numbers::pi * static_cast<double>(bin) / kAzimuths;
      Direction direction{std::cos(angle) * x_ + std::sin(angle) * y_, {}};
      for (int round = 0; round < 3; ++round) {
        Vec3 sum = Vec3::Zero();
        for (std::size_t i = 0; i < areas_m2.size(); ++i)
          if (is_upright(mesh.vertices[i]) && faces(mesh.vertices[i], direction))
            sum += areas_m2[i] * mesh.vertices[i].normal_world.cast<double>();
        sum -= sum.dot(up_) * up_;
        if (sum.norm() > 0) direction.normal_world = sum.normalized();
      }
      directions_.push_back(std::move(direction));
    }
  }

  Vec3 up_, x_, y_;
  RoomStructureConfig config_;
  std::vector<Direction> directions_;
};

/// Normals are noisy far away: a vertex without a name, of whose neighbours most have one, has the
/// same.
void fill_gaps(TriangleMesh& mesh) {
  struct Votes {
    std::array<int, kStructure.size()> of{};
    std::array<float, kStructure.size()> probability{};
    int all = 0;
  };
  std::vector<Votes> votes(mesh.vertices.size());
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) {
      const SurfaceLabel& label = mesh.vertices[corner].label;
      const auto name = static_cast<std::size_t>(
          std::find(kStructure.begin(), kStructure.end(), label.semantic_class) -
          kStructure.begin());
      for (const std::uint32_t other : triangle) {
        if (other == corner) continue;
        ++votes[other].all;
        if (name == kStructure.size()) continue;
        ++votes[other].of[name];
        votes[other].probability[name] += label.probability;
      }
    }
  }
  for (std::size_t i = 0; i < votes.size(); ++i) {
    SurfaceLabel& label = mesh.vertices[i].label;
    if (label.object != kNoSceneObject || label.semantic_class != SemanticClass::kUnknown) continue;
    for (std::size_t name = 0; name < kStructure.size(); ++name) {
      const int count = votes[i].of[name];
      if (2 * count > votes[i].all)
        label = {kStructure[name], kNoSceneObject,
                 votes[i].probability[name] / static_cast<float>(votes[i].all)};
    }
  }
}

}  // namespace

Gravity find_gravity(const TriangleMesh& mesh, const Vec3& up_guess_world, const Vec3& camera_world,
                     const RoomStructureConfig& config) {
  const auto areas_m2 = vertex_areas_m2(mesh);
  Gravity gravity;
  gravity.up_world = refined_up(mesh, areas_m2, up_guess_world, config.max_tilt_rad);
  const auto area = area_by_height(mesh, areas_m2, gravity.up_world, kLevelCos, 1.01);
  const double camera_m = camera_world.dot(gravity.up_world);
  std::vector<int> bins;
  for (const auto& [bin, m2] : area)
    if ((bin + 0.5) * kHeightBin_m < camera_m - config.min_below_camera_m) bins.push_back(bin);
  const auto floor_m = first_plane_m(area, bins, config.min_floor_m2, config.plane_m);
  gravity.has_floor = floor_m.has_value();
  gravity.floor_m = floor_m.value_or(area.empty() ? 0 : area.begin()->first * kHeightBin_m);
  return gravity;
}

void label_structure(TriangleMesh& mesh, const Gravity& gravity,
                     const RoomStructureConfig& config) {
  const auto areas_m2 = vertex_areas_m2(mesh);
  const Vec3& up = gravity.up_world;
  const auto down = area_by_height(mesh, areas_m2, up, -1.01, -kLevelCos);
  std::vector<int> bins;
  for (const auto& [bin, m2] : down)
    if ((bin + 0.5) * kHeightBin_m > gravity.floor_m + config.min_room_height_m)
      bins.push_back(bin);
  std::reverse(bins.begin(), bins.end());
  const auto ceiling_m = first_plane_m(down, bins, config.min_floor_m2, config.plane_m);

  const Walls walls(mesh, areas_m2, up, config);
  for (SurfacePoint& vertex : mesh.vertices) {
    if (vertex.label.object != kNoSceneObject) continue;
    const double cosine = vertex.normal_world.cast<double>().dot(up);
    const double height_m = vertex.p_world.cast<double>().dot(up);
    const auto near = [&](double plane_m) {
      return static_cast<float>(
          std::clamp(1 - std::abs(height_m - plane_m) / (2 * config.plane_m), 0.0, 1.0));
    };
    if (cosine > kFacingCos && near(gravity.floor_m) > 0.5F) {
      vertex.label = {SemanticClass::kFloor, kNoSceneObject, near(gravity.floor_m)};
    } else if (cosine < -kFacingCos && ceiling_m && near(*ceiling_m) > 0.5F) {
      vertex.label = {SemanticClass::kCeiling, kNoSceneObject, near(*ceiling_m)};
    } else if (walls.have(vertex)) {
      vertex.label = {SemanticClass::kWall, kNoSceneObject,
                      static_cast<float>(1 - std::abs(cosine) / (2 * kUprightSin))};
    }
  }
  for (int round = 0; round < kFillRounds; ++round) fill_gaps(mesh);
}

void label_cells(const TriangleMesh& mesh, SpaceCells& space) {
  using Index = std::array<int, 3>;
  std::map<Index, SurfaceLabel> labels;
  for (const SurfacePoint& vertex : mesh.vertices) {
    if (vertex.label.semantic_class == SemanticClass::kUnknown) continue;
    Index index;
    for (int axis = 0; axis < 3; ++axis)
      index[static_cast<std::size_t>(axis)] =
          static_cast<int>(std::floor(vertex.p_world[axis] / space.cell_m));
    SurfaceLabel& label = labels[index];
    if (vertex.label.probability > label.probability) label = vertex.label;
  }
  for (SpaceCell& cell : space.cells) {
    if (cell.state != SpaceState::kOccupied) continue;
    const auto label = labels.find({cell.index.x(), cell.index.y(), cell.index.z()});
    if (label != labels.end()) cell.label = label->second;
  }
}

}  // namespace ygslam
