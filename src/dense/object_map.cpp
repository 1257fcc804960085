#include "dense/object_map.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>
#include <utility>

namespace ygslam {
namespace {

constexpr double kBesideWeight = 0.5;  // of a cell next to one of the other's

/// Cells that may lie in a box of the world or beside it: spares looking for what is far from it.
class CellsNear {
 public:
  CellsNear(const Eigen::AlignedBox3d& box_world, double cell_m) {
    if (box_world.isEmpty()) return;
    const Eigen::Vector3i one = Eigen::Vector3i::Ones();
    low_ = cell_coordinates(cell_key(box_world.min(), cell_m)) - one;
    high_ = cell_coordinates(cell_key(box_world.max(), cell_m)) + one;
  }
  [[nodiscard]] bool contains(CellKey key) const {
    const Eigen::Vector3i cell = cell_coordinates(key);
    return (cell.array() >= low_.array()).all() && (cell.array() <= high_.array()).all();
  }

 private:
  Eigen::Vector3i low_ = Eigen::Vector3i::Zero(), high_ = Eigen::Vector3i::Constant(-1);
};

/// Weight of a cell that is in a set, or beside it.
template <typename Contains>
double closeness(CellKey key, const CellsNear& near, const Contains& contains) {
  if (!near.contains(key)) return 0;
  if (contains(key)) return 1;
  const auto& steps = neighbour_steps();
  const bool beside =
      std::any_of(steps.begin(), steps.end(), [&](CellKey step) { return contains(key + step); });
  return beside ? kBesideWeight : 0;
}

auto cells_in(const KnownObject& object) {
  return [&object](CellKey key) {
    const auto cell = object.cells.find(key);
    return cell != object.cells.end() && object.believes(cell->second);
  };
}

/// Share of the object's cells that lie in a set; sums of halves are exact in any order.
template <typename Contains>
double share_in(const KnownObject& object, const CellsNear& near, const Contains& contains) {
  double sum = 0;
  int count = 0;
  for (const auto& [key, views] : object.cells) {
    if (!object.believes(views)) continue;
    sum += closeness(key, near, contains);
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

bool is_in_top_two(const KnownObject& object, SemanticClass semantic_class) {
  const auto own = object.class_scores.find(semantic_class);
  if (own == object.class_scores.end()) return false;
  return std::count_if(object.class_scores.begin(), object.class_scores.end(),
                       [&](const auto& other) { return other.second > own->second; }) < 2;
}

}  // namespace

ObjectMap::Cells ObjectMap::cells_of(const ObjectObservation& view,
                                     const SE3& T_world_camera) const {
  Cells cells;
  for (const Eigen::Vector3f& p_camera : view.p_camera) {
    const Vec3 p_world = T_world_camera * p_camera.cast<double>();
    cells.extent_world.extend(p_world);
    cells.keys.push_back(cell_key(p_world, config_.cell_m));
  }
  std::sort(cells.keys.begin(), cells.keys.end());
  cells.keys.erase(std::unique(cells.keys.begin(), cells.keys.end()), cells.keys.end());
  return cells;
}

bool ObjectMap::are_apart(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) const {
  const Vec3 reach = Vec3::Constant(2 * config_.cell_m);  // a cell each, and the one beside
  return !Eigen::AlignedBox3d(a.min() - reach, a.max() + reach).intersects(b);
}

double ObjectMap::fit(const Detection& detection, const Cells& cells,
                      const KnownObject& object) const {
  if (are_apart(cells.extent_world, object.extent_world)) return 0;
  double sum = 0;
  const CellsNear near(object.extent_world, config_.cell_m);
  for (const CellKey key : cells.keys) sum += closeness(key, near, cells_in(object));
  const double overlap = sum / static_cast<double>(cells.keys.size());
  if (overlap < config_.min_overlap) return 0;
  if (is_in_top_two(object, detection.semantic_class)) return overlap;
  if (overlap < config_.min_other_overlap) return 0;
  // A book lies in the place of its table, but the table is not in that of the book.
  const CellsNear near_view(cells.extent_world, config_.cell_m);
  const double of_object = share_in(object, near_view, [&](CellKey key) {
    return std::binary_search(cells.keys.begin(), cells.keys.end(), key);
  });
  return of_object < config_.min_other_overlap ? 0 : std::min(overlap, of_object);
}

void ObjectMap::add_view(const ObjectObservation& view, const Cells& cells,
                         const SE3& T_world_camera, Timestamp stamp, KnownObject& object) const {
  object.class_scores[view.detection.semantic_class] += view.detection.score;
  for (const CellKey key : cells.keys) ++object.cells[key];
  const auto is_in_place = [&](const SurfacePatch& patch) {  // says the look at this view's depth
    return patch.observed_at == stamp && !patch.seen_through;
  };
  for (auto& [key, patch] : object.patches) patch.in_sight += is_in_place(patch) ? 1 : 0;
  std::vector<std::pair<CellKey, Vec3>> points_world;
  points_world.reserve(view.p_camera.size());
  for (const Eigen::Vector3f& p_camera : view.p_camera) {
    const Vec3 p_world = T_world_camera * p_camera.cast<double>();
    points_world.emplace_back(cell_key(p_world, config_.patch_m), p_world);
  }
  std::stable_sort(points_world.begin(), points_world.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (auto point = points_world.begin(); point != points_world.end();) {
    SurfacePatch& patch = object.patches[point->first];
    if (!is_in_place(patch)) ++patch.in_sight;
    ++patch.views;
    patch.observed_at = std::max(patch.observed_at, std::optional(stamp));
    patch.seen_through = false;
    for (const CellKey key = point->first; point != points_world.end() && point->first == key;
         ++point) {
      patch.sum_world += point->second;
      ++patch.points;
    }
  }
  object.extent_world.extend(cells.extent_world);
  object.viewed_along_world += (cells.extent_world.center() - T_world_camera.t()).normalized();
  object.seen.insert(stamp);
  object.shown.insert(stamp);
  std::transform(object.colours.begin(), object.colours.end(), view.colours.begin(),
                 object.colours.begin(), std::plus<>());
}

std::vector<SceneObjectId> ObjectMap::check_places(const DepthView& view, const SE3& T_world_camera,
                                                   Timestamp stamp) {
  std::vector<SceneObjectId> gone;
  for (auto& [id, object] : objects_) {
    if (object.found_empty) continue;
    if (check_place(view, T_world_camera, stamp, config_.look, object)) gone.push_back(id);
  }
  return gone;
}

bool ObjectMap::is_poorly_known(std::span<const ObjectObservation> views, const SE3& T_world_camera,
                                int enough_views) const {
  return std::any_of(views.begin(), views.end(), [&](const ObjectObservation& view) {
    const Cells cells = cells_of(view, T_world_camera);
    if (cells.keys.empty() || view.is_moving) return false;
    const KnownObject* best = nullptr;
    double best_fit = 0;
    for (const auto& [id, object] : objects_) {
      const double its_fit = object.found_empty ? 0 : fit(view.detection, cells, object);
      if (its_fit <= best_fit) continue;
      best_fit = its_fit;
      best = &object;
    }
    if (best == nullptr || best->views() < enough_views) return true;
    // Masks are ragged: a cell or two at their edges are always new.
    const auto seldom_shown = std::count_if(cells.keys.begin(), cells.keys.end(), [&](CellKey key) {
      const auto known = best->cells.find(key);
      return known == best->cells.end() || known->second < config_.min_views;
    });
    return static_cast<double>(seldom_shown) >=
           config_.min_new_part * static_cast<double>(cells.keys.size());
  });
}

bool ObjectMap::observes_change(const DepthView& view, const SE3& T_world_camera) const {
  return std::any_of(objects_.begin(), objects_.end(), [&](const auto& entry) {
    const KnownObject& object = entry.second;
    return !object.found_empty && sees_through(view, T_world_camera, config_.look, object);
  });
}

std::vector<SceneObjectId> ObjectMap::best_fits(std::span<const ObjectObservation> views,
                                                const std::vector<Cells>& cells) const {
  struct Pair {
    double fit = 0;
    SceneObjectId object{};
    std::size_t view = 0;
  };
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (cells[i].keys.empty() || views[i].is_moving) continue;
    for (const auto& [id, object] : objects_) {
      if (object.found_empty || object.is_leaving) continue;
      if (const double f = fit(views[i].detection, cells[i], object); f > 0)
        pairs.push_back({f, id, i});
    }
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return std::tuple(-a.fit, a.object, a.view) < std::tuple(-b.fit, b.object, b.view);
  });
  std::vector<SceneObjectId> best(views.size(), kNoSceneObject);
  for (const Pair& pair : pairs) {
    const bool is_free = std::find(best.begin(), best.end(), pair.object) == best.end();
    if (is_free && best[pair.view] == kNoSceneObject) best[pair.view] = pair.object;
  }
  return best;
}

std::vector<SceneObjectId> ObjectMap::step(std::span<const ObjectObservation> views,
                                           const SE3& T_world_camera, Timestamp stamp) {
  now_ = std::max(now_, stamp);
  std::vector<Cells> cells;
  for (const ObjectObservation& view : views) cells.push_back(cells_of(view, T_world_camera));
  std::vector<SceneObjectId> result = best_fits(views, cells);
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (cells[i].keys.empty()) continue;
    if (views[i].is_moving) {
      note_motion(views[i], cells[i], stamp);
      continue;
    }
    if (result[i] == kNoSceneObject) {
      if (last_id_ + 1 >= static_cast<int>(kUnsureObject)) continue;  // no number is left
      result[i] = SceneObjectId{++last_id_};
    }
    add_view(views[i], cells[i], T_world_camera, stamp, objects_[result[i]]);
  }
  for (const SceneObjectId id : result)
    if (objects_.contains(id)) merge_with_equals(id);
  find_again();
  for (SceneObjectId& id : result) id = current(id);
  return result;
}

void ObjectMap::note_motion(const ObjectObservation& view, const Cells& cells, Timestamp stamp) {
  const Vec3 middle = cells.extent_world.center();
  KnownObject* nearest = nullptr;
  double nearest_m = config_.max_way_m;
  for (auto& [id, object] : objects_) {
    if (object.best_class() != view.detection.semantic_class || has_later(id)) continue;
    const Timestamp last = std::max(*object.shown.rbegin(), object.moving.value_or(Timestamp{}));
    if (seconds_between(stamp, last) > config_.max_unseen_s) continue;
    const bool was_moving = object.moving && *object.moving >= *object.shown.rbegin();
    const Vec3 from = was_moving ? object.moving_world : object.extent_world.center();
    if ((from - middle).norm() > nearest_m) continue;
    nearest_m = (from - middle).norm();
    nearest = &object;
  }
  if (!nearest) return;
  nearest->moving = stamp;
  nearest->moving_world = middle;
}

void ObjectMap::merge_with_equals(SceneObjectId id) {
  for (auto it = objects_.begin(); it != objects_.end();) {
    const auto other = it++;
    KnownObject& own = objects_.at(id);
    if (other->first == id || other->second.found_empty ||
        other->second.best_class() != own.best_class() ||
        are_apart(own.extent_world, other->second.extent_world))
      continue;
    const bool own_is_smaller = own.cells.size() < other->second.cells.size();
    const KnownObject& smaller = own_is_smaller ? own : other->second;
    const KnownObject& larger = own_is_smaller ? other->second : own;
    const CellsNear near(larger.extent_world, config_.cell_m);
    if (share_in(smaller, near, cells_in(larger)) <= config_.merge_overlap) continue;
    const auto [kept, gone] = std::minmax(id, other->first);
    objects_.at(kept).merge(objects_.at(gone));
    merged_into_[gone] = kept;
    if (const auto from = came_from_.extract(gone)) came_from_.try_emplace(kept, from.mapped());
    if (gone == other->first) {
      objects_.erase(other);
    } else {
      objects_.erase(id);
      id = kept;
      it = objects_.begin();  // a larger one now: all are asked again
    }
  }
}

void ObjectMap::find_again() {
  for (const auto& [old_id, old] : objects_) {
    if (!old.found_empty || old.views() < config_.min_views || has_later(old_id)) continue;
    double best = 0;
    SceneObjectId best_id = kNoSceneObject;
    for (const auto& [id, object] : objects_) {
      if (object.found_empty || object.views() < config_.min_views || came_from_.contains(id) ||
          object.best_class() != old.best_class() || *object.seen.begin() <= *old.seen.rbegin())
        continue;
      const Likeness like = likeness(old, object);
      if (like.size < config_.min_like_size || like.colour < config_.min_like_colour ||
          like.size * like.colour <= best)
        continue;
      best = like.size * like.colour;
      best_id = id;
    }
    if (best > 0) came_from_[best_id] = old_id;
  }
}

void ObjectMap::forget(Timestamp view) {
  for (auto at = objects_.begin(); at != objects_.end();) {
    auto& [id, object] = *at;
    object.seen.erase(view);
    object.shown.erase(view);
    if (!object.seen.empty()) {
      ++at;
      continue;
    }
    came_from_.erase(id);
    std::erase_if(came_from_, [&](const auto& way) { return way.second == id; });
    at = objects_.erase(at);
  }
}

SceneObjectId ObjectMap::earlier(SceneObjectId object) const {
  const auto from = came_from_.find(object);
  return from == came_from_.end() ? kNoSceneObject : from->second;
}

SceneObjectId ObjectMap::thing(SceneObjectId object) const {
  object = current(object);
  for (SceneObjectId before = earlier(object); before != kNoSceneObject; before = earlier(object))
    object = before;
  return object;
}

bool ObjectMap::has_later(SceneObjectId object) const {
  return std::any_of(came_from_.begin(), came_from_.end(),
                     [&](const auto& entry) { return entry.second == object; });
}

SceneObjectId ObjectMap::current(SceneObjectId object) const {
  for (auto it = merged_into_.find(object); it != merged_into_.end();
       it = merged_into_.find(object))
    object = it->second;
  return object;
}

}  // namespace ygslam
