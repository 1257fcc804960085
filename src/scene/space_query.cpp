#include "scene/space_query.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace ygslam {
namespace {

auto order(const Eigen::Vector3i& i) { return std::tuple(i.z(), i.y(), i.x()); }

auto first_from(const SpaceCells& space, const Eigen::Vector3i& index) {
  return std::lower_bound(space.cells.begin(), space.cells.end(), index,
                          [](const SpaceCell& cell, const Eigen::Vector3i& wanted) {
                            return order(cell.index) < order(wanted);
                          });
}

SpaceState state_of_cell(const SpaceCells& space, const Eigen::Vector3i& index) {
  const auto found = first_from(space, index);
  return found != space.cells.end() && found->index == index ? found->state : SpaceState::kUnknown;
}

Eigen::Vector3i cell_of(const SpaceCells& space, const Vec3& p_world) {
  return (p_world / space.cell_m).array().floor().cast<int>();
}

}  // namespace

SpaceState state_at(const SpaceCells& space, const Vec3& p_world) {
  return state_of_cell(space, cell_of(space, p_world));
}

SpaceState state_of_box(const SpaceCells& space, const Vec3& low, const Vec3& high) {
  const Eigen::Vector3i first = cell_of(space, low);
  // A box that ends where a cell begins does not touch it.
  const Eigen::Vector3i last =
      ((high / space.cell_m).array().ceil().cast<int>() - 1).max(first.array());
  bool all_known = true;
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      int known = 0;
      for (auto cell = first_from(space, {first.x(), y, z});
           cell != space.cells.end() && order(cell->index) <= std::tuple(z, y, last.x()); ++cell) {
        if (cell->state == SpaceState::kOccupied) return SpaceState::kOccupied;
        if (cell->state == SpaceState::kFree) ++known;
      }
      all_known = all_known && known == last.x() - first.x() + 1;
    }
  }
  return all_known ? SpaceState::kFree : SpaceState::kUnknown;
}

SpaceHit cast_ray(const SpaceCells& space, const SpaceRay& ray) {
  Eigen::Vector3i cell = cell_of(space, ray.from_world);
  Eigen::Vector3i step = Eigen::Vector3i::Zero();
  Vec3 next_m = Vec3::Constant(std::numeric_limits<double>::infinity()), across_m = next_m;
  for (int axis = 0; axis < 3; ++axis) {
    const double direction = ray.direction_world[axis];
    if (direction == 0) continue;
    step[axis] = direction > 0 ? 1 : -1;
    const double border_m = (cell[axis] + (direction > 0 ? 1 : 0)) * space.cell_m;
    next_m[axis] = (border_m - ray.from_world[axis]) / direction;
    across_m[axis] = space.cell_m / std::abs(direction);
  }
  double distance_m = 0;
  while (distance_m <= ray.length_m) {
    const SpaceState state = state_of_cell(space, cell);
    const bool passes =
        state == SpaceState::kFree || (state == SpaceState::kUnknown && ray.past_unknown);
    if (!passes) return {state, distance_m};
    Eigen::Index axis = 0;
    distance_m = next_m.minCoeff(&axis);
    cell[axis] += step[axis];
    next_m[axis] += across_m[axis];
  }
  return {SpaceState::kFree, ray.length_m};
}

}  // namespace ygslam
