#include "dense/object_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace ygslam {
namespace {

constexpr int kAxisBits = 21;
constexpr std::int64_t kBias = std::int64_t{1} << (kAxisBits - 1);
constexpr double kBesideWeight = 0.5;  // of a cell next to one of the other's
constexpr int kManyViews = 4;          // then a cell that only one of them showed is not believed

std::uint64_t key_of(const Vec3& p_world, double cell_m) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::int64_t>(std::floor(p_world[axis] / cell_m));
    key = key << kAxisBits |
          static_cast<std::uint64_t>(std::clamp(i + kBias, std::int64_t{1}, 2 * kBias - 2));
  }
  return key;
}

/// Of the 26 cells around another and itself: what is added to the key.
std::vector<std::uint64_t> neighbour_steps() {
  std::vector<std::uint64_t> steps;
  for (std::int64_t x = -1; x <= 1; ++x)
    for (std::int64_t y = -1; y <= 1; ++y)
      for (std::int64_t z = -1; z <= 1; ++z)
        steps.push_back(static_cast<std::uint64_t>((x << 2 * kAxisBits) + (y << kAxisBits) + z));
  return steps;
}

/// Weight of a cell that is in a set, or beside it.
template <typename Contains>
double closeness(std::uint64_t key, const Contains& contains) {
  static const std::vector<std::uint64_t> kSteps = neighbour_steps();
  if (contains(key)) return 1;
  const bool beside = std::any_of(kSteps.begin(), kSteps.end(),
                                  [&](std::uint64_t step) { return contains(key + step); });
  return beside ? kBesideWeight : 0;
}

bool believed(const KnownObject& object, int views_of_cell) {
  return views_of_cell > 1 || object.views() < kManyViews;
}
auto cells_in(const KnownObject& object) {
  return [&object](std::uint64_t key) {
    const auto cell = object.cells.find(key);
    return cell != object.cells.end() && believed(object, cell->second);
  };
}

/// Share of the object's cells that lie in a set; sums of halves are exact in any order.
template <typename Contains>
double share_in(const KnownObject& object, const Contains& contains) {
  double sum = 0;
  int count = 0;
  for (const auto& [key, views] : object.cells) {
    if (!believed(object, views)) continue;
    sum += closeness(key, contains);
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

SemanticClass KnownObject::best_class() const {
  const auto best =
      std::max_element(class_scores.begin(), class_scores.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  return best == class_scores.end() ? SemanticClass::kUnknown : best->first;
}

float KnownObject::probability() const {
  const auto best = class_scores.find(best_class());
  if (best == class_scores.end() || seen.empty()) return 0;
  return static_cast<float>(std::min(1.0, best->second / views()));
}

ObjectMap::Cells ObjectMap::cells_of(const ThingView& view, const SE3& T_world_camera) const {
  Cells cells;
  for (const Eigen::Vector3f& p_camera : view.p_camera) {
    const Vec3 p_world = T_world_camera * p_camera.cast<double>();
    cells.extent_world.extend(p_world);
    cells.keys.push_back(key_of(p_world, config_.cell_m));
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
  for (const std::uint64_t key : cells.keys) sum += closeness(key, cells_in(object));
  const double overlap = sum / static_cast<double>(cells.keys.size());
  if (overlap < config_.min_overlap) return 0;
  if (is_in_top_two(object, detection.semantic_class)) return overlap;
  if (overlap < config_.min_other_overlap) return 0;
  // A book lies in the place of its table, but the table is not in that of the book.
  const double of_object = share_in(object, [&](std::uint64_t key) {
    return std::binary_search(cells.keys.begin(), cells.keys.end(), key);
  });
  return of_object < config_.min_other_overlap ? 0 : std::min(overlap, of_object);
}

std::vector<SceneObjectId> ObjectMap::step(std::span<const ThingView> views,
                                           const SE3& T_world_camera, Timestamp stamp) {
  struct Pair {
    double fit = 0;
    SceneObjectId object{};
    std::size_t view = 0;
  };
  std::vector<Pair> pairs;
  std::vector<Cells> cells;
  for (std::size_t i = 0; i < views.size(); ++i) {
    cells.push_back(cells_of(views[i], T_world_camera));
    if (cells[i].keys.empty()) continue;
    for (const auto& [id, object] : objects_)
      if (const double f = fit(views[i].detection, cells[i], object); f > 0)
        pairs.push_back({f, id, i});
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return std::tuple(-a.fit, a.object, a.view) < std::tuple(-b.fit, b.object, b.view);
  });
  std::vector<SceneObjectId> result(views.size(), kNoSceneObject);
  for (const Pair& pair : pairs) {
    const bool is_free = std::find(result.begin(), result.end(), pair.object) == result.end();
    if (is_free && result[pair.view] == kNoSceneObject) result[pair.view] = pair.object;
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (cells[i].keys.empty()) continue;
    if (result[i] == kNoSceneObject) {
      if (last_id_ == std::numeric_limits<std::uint16_t>::max()) continue;  // no number is left
      result[i] = SceneObjectId{++last_id_};
    }
    KnownObject& object = objects_[result[i]];
    object.class_scores[views[i].detection.semantic_class] += views[i].detection.score;
    for (const std::uint64_t key : cells[i].keys) ++object.cells[key];
    object.extent_world.extend(cells[i].extent_world);
    object.seen.insert(stamp);
  }
  for (const SceneObjectId id : result)
    if (objects_.contains(id)) merge_with_equals(id);
  for (SceneObjectId& id : result) id = current(id);
  return result;
}

void ObjectMap::merge_with_equals(SceneObjectId id) {
  for (auto it = objects_.begin(); it != objects_.end();) {
    const auto other = it++;
    KnownObject& own = objects_.at(id);
    if (other->first == id || other->second.best_class() != own.best_class() ||
        are_apart(own.extent_world, other->second.extent_world))
      continue;
    const bool own_is_smaller = own.cells.size() < other->second.cells.size();
    const KnownObject& smaller = own_is_smaller ? own : other->second;
    const KnownObject& larger = own_is_smaller ? other->second : own;
    if (share_in(smaller, cells_in(larger)) <= config_.merge_overlap) continue;
    const auto [kept, gone] = std::minmax(id, other->first);
    KnownObject& into = objects_.at(kept);
    const KnownObject& from = objects_.at(gone);
    for (const auto& [semantic_class, score] : from.class_scores)
      into.class_scores[semantic_class] += score;
    for (const auto& [key, views] : from.cells) into.cells[key] += views;
    into.extent_world.extend(from.extent_world);
    into.seen.insert(from.seen.begin(), from.seen.end());
    merged_into_[gone] = kept;
    if (gone == other->first) {
      objects_.erase(other);
    } else {
      objects_.erase(id);
      id = kept;
      it = objects_.begin();  // a larger one now: all are asked again
    }
  }
}

SceneObjectId ObjectMap::current(SceneObjectId object) const {
  for (auto it = merged_into_.find(object); it != merged_into_.end();
       it = merged_into_.find(object))
    object = it->second;
  return object;
}

}  // namespace ygslam
