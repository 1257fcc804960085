#include "dense/known_object.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace ygslam {
namespace {

constexpr std::int64_t kBias = std::int64_t{1} << (kCellAxisBits - 1);
constexpr int kManyViews = 4;
constexpr double kLeastShare = 0.1;  // of an object's views that show a point of its surface
constexpr double kEnoughViews = 3;   // if that is less: most may show it half hidden
constexpr double kLeastVotes = 0.5;  // of those that see the point

/// Mean distance of the surface from its middle.
double radius_m(const std::vector<Vec3>& surface_world) {
  if (surface_world.empty()) return 0;
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : surface_world) middle += p;
  middle /= static_cast<double>(surface_world.size());
  double sum = 0;
  for (const Vec3& p : surface_world) sum += (p - middle).norm();
  return sum / static_cast<double>(surface_world.size());
}

}  // namespace

CellKey cell_key(const Vec3& p_world, double cell_m) {
  CellKey key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::int64_t>(std::floor(p_world[axis] / cell_m));
    key = key << kCellAxisBits |
          static_cast<CellKey>(std::clamp(i + kBias, std::int64_t{1}, 2 * kBias - 2));
  }
  return key;
}

Vec3 low_corner(CellKey key, double cell_m) {
  const Eigen::Vector3i bias = Eigen::Vector3i::Constant(static_cast<int>(kBias));
  return cell_m * (cell_coordinates(key) - bias).cast<double>();
}

const std::vector<CellKey>& neighbour_steps() {
  static const std::vector<CellKey> kSteps = [] {
    std::vector<CellKey> steps;
    for (std::int64_t x = -1; x <= 1; ++x)
      for (std::int64_t y = -1; y <= 1; ++y)
        for (std::int64_t z = -1; z <= 1; ++z)
          steps.push_back(
              static_cast<CellKey>((x << 2 * kCellAxisBits) + (y << kCellAxisBits) + z));
    return steps;
  }();
  return kSteps;
}

SemanticClass KnownObject::best_class() const {
  const auto best =
      std::max_element(class_scores.begin(), class_scores.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  return best == class_scores.end() ? SemanticClass::kUnknown : best->first;
}

float KnownObject::probability() const {
  const auto best = class_scores.find(best_class());
  if (best == class_scores.end() || seen.empty()) return 0;
  const double looks = static_cast<double>(std::max(seen.size(), shown.size()));
  return static_cast<float>(std::min(1.0, best->second / looks));
}

bool KnownObject::believes(int views_of_it) const {
  return views() < kManyViews ||
         (views_of_it > 1 && views_of_it >= std::min(kLeastShare * views(), kEnoughViews));
}

bool KnownObject::believes(const SurfacePatch& patch) const {
  return believes(patch.views) &&
         (views() < kManyViews || patch.views >= kLeastVotes * patch.in_sight);
}

std::vector<Vec3> KnownObject::surface_world() const {
  std::vector<Vec3> surface;
  for (const auto& [key, patch] : patches)
    if (believes(patch)) surface.push_back(patch.mean_world());
  return surface;
}

std::vector<CellKey> KnownObject::place() const {
  std::vector<CellKey> keys;
  for (const auto& [key, views_of_it] : cells)
    if (believes(views_of_it)) keys.push_back(key);
  std::sort(keys.begin(), keys.end());
  return keys;
}

void KnownObject::merge(const KnownObject& other) {
  for (const auto& [semantic_class, score] : other.class_scores)
    class_scores[semantic_class] += score;
  for (const auto& [key, views_of_it] : other.cells) cells[key] += views_of_it;
  for (const auto& [key, patch] : other.patches) {
    SurfacePatch& own = patches[key];
    own.sum_world += patch.sum_world;
    own.points += patch.points;
    own.views += patch.views;
    own.in_sight += patch.in_sight;
    if (!patch.observed_at || (own.observed_at && *patch.observed_at < *own.observed_at)) continue;
    own.observed_at = patch.observed_at;
    own.seen_through = patch.seen_through;
  }
  extent_world.extend(other.extent_world);
  viewed_along_world += other.viewed_along_world;
  seen.insert(other.seen.begin(), other.seen.end());
  shown.insert(other.shown.begin(), other.shown.end());
  std::transform(colours.begin(), colours.end(), other.colours.begin(), colours.begin(),
                 std::plus<>());
  empty_observations = std::min(empty_observations, other.empty_observations);
  is_leaving = is_leaving && other.is_leaving;
  if (other.moving > moving) moving_world = other.moving_world;
  moving = std::max(moving, other.moving);
}

Likeness likeness(const KnownObject& a, const KnownObject& b) {
  Likeness like;
  const double radius_a = radius_m(a.surface_world()), radius_b = radius_m(b.surface_world());
  if (radius_a > 0 && radius_b > 0)
    like.size = std::min(radius_a, radius_b) / std::max(radius_a, radius_b);
  const auto total = [](const ColourCounts& counts) {
    return static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}));
  };
  const double all_a = total(a.colours), all_b = total(b.colours);
  if (all_a > 0 && all_b > 0) {
    for (std::size_t i = 0; i < a.colours.size(); ++i)
      like.colour += std::min(static_cast<double>(a.colours[i]) / all_a,
                              static_cast<double>(b.colours[i]) / all_b);
  }
  return like;
}

}  // namespace ygslam
