#include "dense/pixel_state.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace ygslam {
namespace {

constexpr double kInFront_m = 0.05;  // nearer which a box is taken to fill the image

/// Cells, and as bits all of the box around them.
class CellSet {
 public:
  CellSet(const std::vector<CellKey>& keys, double cell_m, bool of_objects_too)
      : of_objects(of_objects_too), cells_(&keys), cell_m_(cell_m), per_m_(1 / cell_m) {
    if (keys.empty()) return;
    Eigen::AlignedBox3i box;
    for (const CellKey key : keys) box.extend(cell_coordinates(key));
    low_ = box.min();
    size_ = box.max() - low_ + Eigen::Vector3i::Ones();
    origin_ = cell_coordinates(cell_key(Vec3::Zero(), cell_m));
    for (const CellKey key : keys) {
      const Vec3 low = low_corner(key, cell_m);
      box_world.extend(low);
      box_world.extend(low + Vec3::Constant(cell_m));
    }
    const double bits = size_.cast<double>().prod();
    if (bits > kMostBits) return;
    bits_.resize(static_cast<std::size_t>(bits));
    for (const CellKey key : keys) bits_[offset(cell_coordinates(key) - low_)] = true;
  }
  [[nodiscard]] bool contains(const Vec3& p_world) const {
    if (!box_world.contains(p_world)) return false;
    const Vec3 at = p_world * per_m_, down = at.array().floor();
    const Vec3 part = at - down;
    // Near a cell's border only cell_key() knows on which side of it a point is.
    if (bits_.empty() || part.minCoeff() < kBorder || part.maxCoeff() > 1 - kBorder)
      return std::binary_search(cells_->begin(), cells_->end(), cell_key(p_world, cell_m_));
    return bits_[offset(down.cast<int>() + origin_ - low_)];
  }

  Eigen::AlignedBox3d box_world;
  bool of_objects;  // whatever its surface was taken for

 private:
  static constexpr double kMostBits = 1 << 24, kBorder = 1e-6;
  [[nodiscard]] std::size_t offset(const Eigen::Vector3i& cell) const {
    return static_cast<std::size_t>((cell.z() * size_.y() + cell.y()) * size_.x() + cell.x());
  }

  const std::vector<CellKey>* cells_;
  double cell_m_, per_m_;
  Eigen::Vector3i low_, size_, origin_;  // as cell_coordinates() counts
  std::vector<bool> bits_;
};

/// Pixels from the first to before the last.
struct Window {
  int u0 = 0, u1 = 0, v0 = 0, v1 = 0;

  void add(const Window& other) {
    if (other.u0 >= other.u1 || other.v0 >= other.v1) return;
    const bool is_empty = u0 == u1;
    u0 = is_empty ? other.u0 : std::min(u0, other.u0);
    v0 = is_empty ? other.v0 : std::min(v0, other.v0);
    u1 = std::max(u1, other.u1);
    v1 = std::max(v1, other.v1);
  }
};

/// Outside it nothing of the box is seen.
Window window_of(const Eigen::AlignedBox3d& box_world, const SE3& T_camera_world,
                 const Pinhole& camera) {
  if (box_world.isEmpty()) return {};
  Eigen::AlignedBox2d box_px;
  for (int i = 0; i < 8; ++i) {
    const Vec3 p =
        T_camera_world * box_world.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
    if (p.z() < kInFront_m) return {0, camera.width, 0, camera.height};
    box_px.extend(
        Vec2(camera.fx * p.x() / p.z() + camera.cx, camera.fy * p.y() / p.z() + camera.cy));
  }
  const auto pixel = [](double at_px, int size_px) {
    return static_cast<int>(std::clamp(std::floor(at_px), 0.0, static_cast<double>(size_px)));
  };
  return {pixel(box_px.min().x() - 1, camera.width), pixel(box_px.max().x() + 2, camera.width),
          pixel(box_px.min().y() - 1, camera.height), pixel(box_px.max().y() + 2, camera.height)};
}

void exclude_places(const PixelState& state, const SE3& T_world_camera, double cell_m,
                    DepthView& view) {
  std::vector<CellSet> places;
  for (const RemovedCells& removed_objects : state.removed_objects)
    places.emplace_back(*removed_objects, cell_m, false);
  if (state.removed) places.emplace_back(*state.removed, cell_m, true);
  const Pinhole& camera = view.camera;
  const SE3 T_camera_world = T_world_camera.inverse();
  Window window;
  for (const CellSet& place : places)
    window.add(window_of(place.box_world, T_camera_world, camera));
  std::vector<double> ray_x;
  for (int u = window.u0; u < window.u1; ++u) ray_x.push_back((u - camera.cx) / camera.fx);
  for (int v = window.v0; v < window.v1; ++v) {
    const double ray_y = (v - camera.cy) / camera.fy;
    for (int u = window.u0; u < window.u1; ++u) {
      std::uint8_t& object = view.object.at(u, v);
      const double depth_m = view.depth.at(u, v) * DepthView::kUnit_m;
      if (object == DepthView::kExcluded || depth_m <= 0) continue;
      const Vec3 p_camera(ray_x[static_cast<std::size_t>(u - window.u0)] * depth_m, ray_y * depth_m,
                          depth_m);
      const Vec3 p_world = T_world_camera * p_camera;
      const bool is_object = DepthView::is_object(object);
      if (std::any_of(places.begin(), places.end(), [&](const CellSet& place) {
            return (place.of_objects || !is_object) && place.contains(p_world);
          }))
        object = DepthView::kExcluded;
    }
  }
}

template <typename Cells>
bool same_cells(const Cells& a, const Cells& b) {
  return a == b || (a && b && *a == *b);
}

}  // namespace

bool PixelState::operator==(const PixelState& other) const {
  return same_cells(removed, other.removed) && is_same_but_for_removed(*this, other);
}

bool is_same_but_for_removed(const PixelState& a, const PixelState& b) {
  return same_cells(a.appeared, b.appeared) && is_same_but_for_changes(a, b);
}

bool is_same_but_for_changes(const PixelState& a, const PixelState& b) {
  return a.ids == b.ids &&
         std::equal(a.removed_objects.begin(), a.removed_objects.end(), b.removed_objects.begin(),
                    b.removed_objects.end(), same_cells<RemovedCells>);
}

PixelState without_changes(PixelState state) {
  state.removed = nullptr;
  state.appeared = nullptr;
  return state;
}

PixelState space_state(PixelState state) {
  for (SceneObjectId& id : state.ids)
    if (id != kRemovedObject) id = kNoSceneObject;
  return without_changes(std::move(state));
}

void apply_state(const PixelState& state, const SE3& T_world_camera, int margin_px, double cell_m,
                 DepthView& view) {
  std::vector<bool> is_removed;
  for (SceneObjectId& object : view.objects) {
    object = state.ids[static_cast<std::size_t>(object) - 1];
    is_removed.push_back(object == kRemovedObject);
  }
  exclude_objects(view, is_removed, margin_px);
  if (state.appeared) view.spared = *state.appeared;
  if (!state.removed_objects.empty() || state.removed)
    exclude_places(state, T_world_camera, cell_m, view);
}

}  // namespace ygslam
