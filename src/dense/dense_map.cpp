#include "dense/dense_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "dense/room_structure.hpp"
#include "dense/scene_objects.hpp"
#include "volume/reading.hpp"

namespace ygslam {
namespace {

constexpr double kTypicalDepthM = 3;
constexpr double kLooseVoxels = 0.5;

/// An occupied cell is what the surest vertex of a known class in it is.
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

bool same(const std::optional<SE3>& a, const std::optional<SE3>& b) {
  return a.has_value() == b.has_value() && (!a || (a->R() == b->R() && a->t() == b->t()));
}

}  // namespace

DenseMap::DenseMap(const DenseMapConfig& config, const Camera& camera)
    : config_(config), camera_(camera), objects_(config.objects) {
  start_again();
}

void DenseMap::start_again() {
  volume_.emplace(config_.volume);
  mesher_.emplace(config_.reading);
  min_views_ = config_.reading.min_views;
  for (auto& [id, contribution] : contributions_) contribution.fused.reset();
}

void DenseMap::apply(const DenseUpdate& update) {
  if (!config_.enabled) return;
  for (const DenseKeyframe& keyframe : update.added) {
    const GreyImage excluded = dilated(keyframe.movers, config_.margin_px);
    CHECK(keyframe.detections.size() <= kMaxDetections);
    const GreyImage inner = without_edges(keyframe.things, config_.edge_px);
    Image<SceneObjectId> numbers(inner.width(), inner.height());
    std::transform(inner.begin(), inner.end(), numbers.begin(),
                   [](std::uint8_t number) { return SceneObjectId{number}; });
    DepthView view =
        make_depth_view({keyframe.frame->depth_m, keyframe.frame->colour, numbers, excluded},
                        camera_, keyframe.read_out);
    auto things = thing_views(view, keyframe.detections, config_.volume.preparation.max_depth_m);
    contributions_.emplace(
        keyframe.id,
        Contribution{StoredView(view), std::move(things), keyframe.frame->stamp, {}, {}, {}, {}});
  }
  for (const KeyframeId id : update.removed) {
    const auto gone = contributions_.find(id);
    if (gone == contributions_.end()) continue;
    const Contribution& old = gone->second;
    if (old.fused) volume_->withdraw(view_of(old, old.fused_ids), *old.fused);
    contributions_.erase(gone);
  }
  for (auto& [id, contribution] : contributions_) {
    const auto pose = update.T_world_camera.find(id);
    contribution.wanted.reset();
    if (pose != update.T_world_camera.end()) contribution.wanted = pose->second;
  }
}

bool DenseMap::Contribution::is_up_to_date() const {
  return same(wanted, fused) && (!fused || wanted_ids == fused_ids);
}

DepthView DenseMap::view_of(const Contribution& contribution, const ObjectIds& ids) {
  DepthView view = contribution.view.restored();
  for (SceneObjectId& object : view.objects) object = ids[static_cast<std::size_t>(object) - 1];
  return view;
}

double DenseMap::out_of_place_m(const Contribution& contribution) const {
  const auto& wanted = contribution.wanted;
  const auto& fused = contribution.fused;
  if (!wanted && !fused) return 0;
  if (!wanted || !fused) return std::numeric_limits<double>::infinity();
  const SE3 T_fused_wanted = fused->inverse() * *wanted;
  return T_fused_wanted.t().norm() + kTypicalDepthM * T_fused_wanted.angle();
}

void DenseMap::bring_up_to_date(Contribution& now) {
  if (now.is_up_to_date()) return;
  if (now.fused) volume_->withdraw(view_of(now, now.fused_ids), *now.fused);
  now.fused.reset();
  if (!now.wanted || volume_->views() + 1 >= Volume::kMaxViews) return;
  if (now.wanted_ids.size() != now.things.size())
    now.wanted_ids = objects_.step(now.things, *now.wanted, now.stamp);
  volume_->integrate(view_of(now, now.wanted_ids), *now.wanted);
  now.fused = now.wanted;
  now.fused_ids = now.wanted_ids;
}

void DenseMap::associate_all() {
  objects_ = ObjectMap(config_.objects);
  for (auto& [id, contribution] : contributions_) {
    contribution.wanted_ids.clear();
    if (!contribution.wanted) continue;
    contribution.wanted_ids =
        objects_.step(contribution.things, *contribution.wanted, contribution.stamp);
  }
  for (auto& [id, contribution] : contributions_)
    for (SceneObjectId& object : contribution.wanted_ids) object = objects_.current(object);
}

bool DenseMap::step() {
  Contribution* farthest = nullptr;
  double farthest_m = kLooseVoxels * config_.volume.surface.voxel_m;
  for (auto& [id, contribution] : contributions_) {
    const double off_m = out_of_place_m(contribution);
    if (off_m <= farthest_m) continue;
    farthest = &contribution;
    farthest_m = off_m;
  }
  if (!farthest) return false;
  bring_up_to_date(*farthest);
  return farthest->is_up_to_date();
}

void DenseMap::finish() {
  associate_all();
  const auto moved = std::count_if(contributions_.begin(), contributions_.end(), [](const auto& c) {
    return c.second.fused && !c.second.is_up_to_date();
  });
  // Putting all in anew costs half as much as taking each back first.
  if (2 * moved > std::ssize(contributions_)) start_again();
  for (auto& [id, contribution] : contributions_) bring_up_to_date(contribution);
}

TriangleMesh DenseMap::mesh() {
  // A scene that fewer keyframes saw than a surface needs is shown all the same.
  const int min_views = std::clamp(volume_->views(), 1, config_.reading.min_views);
  if (std::exchange(min_views_, min_views) != min_views) {
    ReadingConfig reading = config_.reading;
    reading.min_views = min_views;
    mesher_.emplace(reading);
  }
  mesher_->update(*volume_);
  return mesher_->mesh(*volume_);
}

std::vector<ColouredPoint> coloured_points(const TriangleMesh& mesh) {
  std::vector<ColouredPoint> points;
  points.reserve(mesh.vertices.size());
  for (const SurfacePoint& vertex : mesh.vertices)
    points.push_back({vertex.p_world, vertex.colour});
  return points;
}

StaticScene DenseMap::scene() {
  StaticScene scene{mesh(), space_cells(*volume_), {}, {}};
  Vec3 up = Vec3::Zero(), place = Vec3::Zero();
  int views = 0;
  for (const auto& [id, contribution] : contributions_) {
    if (!contribution.fused) continue;
    up -= contribution.fused->R().col(1);  // of a camera: y is down
    place += contribution.fused->t();
    ++views;
  }
  if (views == 0) return scene;
  scene.gravity = find_gravity(scene.mesh, up, place / views);
  scene.objects = place_objects(objects_, scene.gravity, scene.mesh, scene.space);
  label_structure(scene.mesh, scene.gravity);
  label_cells(scene.mesh, scene.space);
  return scene;
}

std::size_t DenseMap::memory_bytes() const {
  std::size_t bytes = volume_->memory_bytes() + mesher_->memory_bytes();
  for (const auto& [id, contribution] : contributions_) {
    bytes += contribution.view.bytes();
    for (const ThingView& thing : contribution.things)
      bytes += thing.p_camera.capacity() * sizeof(Eigen::Vector3f);
  }
  return bytes;
}

GreyImage dilated(const GreyImage& mask, int radius_px) {
  if (mask.empty() || radius_px <= 0) return mask;
  GreyImage rows(mask.width(), mask.height());
  GreyImage result(mask.width(), mask.height());
  // Separable: distance since the last set pixel, forwards and backwards.
  const auto spread = [radius_px](auto read, auto write, int n) {
    for (int i = 0, since = radius_px + 1; i < n; ++i) {
      since = read(i) ? 0 : since + 1;
      if (since <= radius_px) write(i);
    }
    for (int i = n - 1, since = radius_px + 1; i >= 0; --i) {
      since = read(i) ? 0 : since + 1;
      if (since <= radius_px) write(i);
    }
  };
  for (int v = 0; v < mask.height(); ++v) {
    spread([&](int u) { return mask.at(u, v) != 0; }, [&](int u) { rows.at(u, v) = 255; },
           mask.width());
  }
  for (int u = 0; u < mask.width(); ++u) {
    spread([&](int v) { return rows.at(u, v) != 0; }, [&](int v) { result.at(u, v) = 255; },
           mask.height());
  }
  return result;
}

}  // namespace ygslam
