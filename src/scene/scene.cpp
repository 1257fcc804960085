#include "scene/scene.hpp"

#include <algorithm>
#include <tuple>

namespace ygslam {

bool is_free(const SpaceCells& space, const Vec3& p_world) {
  const Eigen::Vector3i at = (p_world / space.cell_m).array().floor().cast<int>();
  const auto order = [](const Eigen::Vector3i& i) { return std::tuple(i.z(), i.y(), i.x()); };
  const auto found = std::lower_bound(space.cells.begin(), space.cells.end(), at,
                                      [&](const SpaceCell& cell, const Eigen::Vector3i& wanted) {
                                        return order(cell.index) < order(wanted);
                                      });
  return found != space.cells.end() && found->index == at && found->state == SpaceState::kFree;
}

}  // namespace ygslam
