#include "map/map_assembly.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"

namespace ygslam {
namespace {

// Rolling shutters carry features over the border. Beyond this share of the image's size lies no
// feature, and a grid that reached there would take memory out of proportion to its features.
constexpr double kOutside = 0.25;
constexpr float kMostPixels = 1e5F;  // of an image's side

std::string number(KeyframeId id) { return std::to_string(index(id)); }

std::string keyframe_name(KeyframeId id) { return "keyframe " + number(id); }

bool lies_within(const Eigen::Vector2f& px, const std::array<double, 4>& b) {
  const double margin_u = kOutside * (b[2] - b[0]);
  const double margin_v = kOutside * (b[3] - b[1]);
  return px.x() >= b[0] - margin_u && px.y() >= b[1] - margin_v && px.x() <= b[2] + margin_u &&
         px.y() <= b[3] + margin_v;
}

/// The place of each keyframe among the kept ones, by its id.
class Ranks {
 public:
  explicit Ranks(const std::map<KeyframeId, Keyframe>& keyframes) {
    for (const auto& [id, keyframe] : keyframes) ids_.push_back(id);
    if (ids_.empty() || index(ids_.back()) >= kMostInTable) return;
    table_.resize(index(ids_.back()) + 1);
    for (std::size_t i = 0; i < ids_.size(); ++i)
      table_[index(ids_[i])] = static_cast<std::uint32_t>(i);
  }
  [[nodiscard]] std::uint32_t of(KeyframeId id) const {
    if (!table_.empty()) return table_[index(id)];
    return static_cast<std::uint32_t>(std::ranges::lower_bound(ids_, id) - ids_.begin());
  }
  [[nodiscard]] KeyframeId id(std::size_t rank) const { return ids_[rank]; }
  [[nodiscard]] std::size_t size() const { return ids_.size(); }

 private:
  static constexpr std::uint32_t kMostInTable = 1U << 22;  // 16 MB
  std::vector<KeyframeId> ids_;
  std::vector<std::uint32_t> table_;
};

}  // namespace

std::optional<PyramidScales> MapAssembly::scales(std::uint32_t levels, double factor) {
  if (!(levels >= 1 && levels <= kMostLevels && factor > 1 && factor <= 4)) return std::nullopt;
  return PyramidScales(static_cast<int>(levels), factor);
}

MapAssembly::MapAssembly(PyramidScales scales, const Numbers& numbers,
                         const std::array<double, 4>& bounds)
    : map_(std::move(scales)), numbers_(numbers), bounds_(bounds) {
  map_.next_landmark_ = numbers.next_landmark;
}

MapAssembly::Fault MapAssembly::add_keyframe(std::shared_ptr<KeyframeData> data,
                                             const SE3& T_camera_world, KeyframeId parent,
                                             std::vector<float> static_weight) {
  const std::string name = keyframe_name(data->id);
  if (index(data->id) >= numbers_.next_keyframe)
    return name + ": the map has numbers below " + std::to_string(numbers_.next_keyframe) + " only";
  if (!map_.keyframes_.empty() && map_.keyframes_.rbegin()->first >= data->id)
    return name + ": comes twice or not in order";
  if (map_.removed(data->id) != nullptr) return name + ": is said to be removed, too";
  const std::size_t features = data->features->size();
  if (static_weight.size() != features)
    return name + ": " + std::to_string(static_weight.size()) + " weights of " +
           std::to_string(features) + " features";
  for (const Feature& f : data->features->points) {
    if (f.octave >= map_.scales_.levels()) return name + ": a feature of a pyramid level too high";
    if (!lies_within(f.ideal_px, bounds_) || !(f.uv_px.cwiseAbs().maxCoeff() < kMostPixels))
      return name + ": a feature lies outside the image";
  }
  data->frame = kNoFrame;
  data->grid = FeatureGrid(*data->features, bounds_);
  map_.add_keyframe(std::move(data), T_camera_world, parent, std::move(static_weight));
  return std::nullopt;
}

MapAssembly::Fault MapAssembly::add_removed(const RemovedKeyframe& removed) {
  const std::string name = "removed keyframe " + number(removed.id);
  auto& all = map_.removed_keyframes_;
  if (index(removed.id) >= numbers_.next_keyframe)
    return name + ": the map has numbers below " + std::to_string(numbers_.next_keyframe) + " only";
  if (!all.empty() && all.back().id >= removed.id) return name + ": comes twice or not in order";
  if (map_.has_keyframe(removed.id)) return name + ": is still in the map";
  all.push_back(removed);
  return std::nullopt;
}

MapAssembly::Fault MapAssembly::add_landmark(Landmark landmark, std::uint8_t source) {
  const std::string name = "landmark " + std::to_string(index(landmark.id));
  if (index(landmark.id) >= numbers_.next_landmark)
    return name + ": the map has numbers below " + std::to_string(numbers_.next_landmark) + " only";
  if (map_.has_landmark(landmark.id)) return name + ": comes twice";
  if (landmark.observations.empty()) return name + ": nobody sees it";
  if (index(landmark.first_keyframe) >= numbers_.next_keyframe)
    return name + ": first seen by keyframe " + number(landmark.first_keyframe) +
           ", which never was";
  for (std::size_t i = 0; i < landmark.observations.size(); ++i) {
    const LandmarkObservation& o = landmark.observations[i];
    const auto keyframe = map_.keyframes_.find(o.keyframe);
    if (keyframe == map_.keyframes_.end())
      return name + ": seen by keyframe " + number(o.keyframe) + ", which is not there";
    if (i > 0 && landmark.observations[i - 1].keyframe >= o.keyframe)
      return name + ": its observations are not in order";
    const auto& seen = keyframe->second.landmarks;
    if (o.feature >= seen.size())
      return name + ": " + keyframe_name(o.keyframe) + " has no feature " +
             std::to_string(o.feature);
    if (seen[o.feature] != kNoLandmark)
      return name + ": feature " + std::to_string(o.feature) + " of " + keyframe_name(o.keyframe) +
             " shows another landmark";
  }
  if (source != map_fields::kOwnDescriptor) {
    if (source >= landmark.observations.size())
      return name + ": its descriptor is of an observation that it has not";
    const LandmarkObservation& o = landmark.observations[source];
    landmark.descriptor =
        map_.keyframes_.find(o.keyframe)->second.data->features->descriptors[o.feature];
  }
  for (const LandmarkObservation& o : landmark.observations)
    map_.keyframes_.find(o.keyframe)->second.landmarks[o.feature] = landmark.id;
  const LandmarkId id = landmark.id;
  map_.landmarks_.emplace(id, std::move(landmark));
  return std::nullopt;
}

MapAssembly::Fault MapAssembly::parent_fault() const {
  // Ids grow from parent to child: no way through parents comes back.
  const auto is_before = [&](KeyframeId parent, KeyframeId id) {
    return parent < id && (map_.keyframes_.contains(parent) || map_.removed(parent) != nullptr);
  };
  const auto fault = [](const std::string& name, KeyframeId parent) {
    return name + ": its parent " + number(parent) + " is not there or not older";
  };
  for (const auto& [id, keyframe] : map_.keyframes_)
    if (keyframe.parent != kNoKeyframe && !is_before(keyframe.parent, id))
      return fault(keyframe_name(id), keyframe.parent);
  for (const RemovedKeyframe& removed : map_.removed_keyframes_)
    if (!is_before(removed.parent, removed.id))
      return fault("removed keyframe " + number(removed.id), removed.parent);
  return std::nullopt;
}

void MapAssembly::count_covisibility() {
  const Ranks ranks(map_.keyframes_);
  std::vector<std::vector<const Landmark*>> seen(ranks.size());
  for (const auto& [id, landmark] : map_.landmarks_)
    for (const LandmarkObservation& o : landmark.observations)
      seen[ranks.of(o.keyframe)].push_back(&landmark);
  std::vector<int> shared(ranks.size(), 0);
  std::vector<std::uint32_t> others;
  for (std::size_t rank = 0; rank < ranks.size(); ++rank) {
    others.clear();
    for (const Landmark* landmark : seen[rank]) {
      for (const LandmarkObservation& o : landmark->observations) {
        const std::uint32_t other = ranks.of(o.keyframe);
        if (other != rank && shared[other]++ == 0) others.push_back(other);
      }
    }
    std::ranges::sort(others);
    auto& covisible = map_.keyframes_.find(ranks.id(rank))->second.covisible;
    for (const std::uint32_t other : others) {
      covisible.emplace_hint(covisible.end(), ranks.id(other), shared[other]);
      shared[other] = 0;
    }
  }
}

void MapAssembly::number_by_parts() {
  numbers_.next_keyframe = 0;
  if (!map_.keyframes_.empty()) numbers_.next_keyframe = index(map_.keyframes_.rbegin()->first) + 1;
  if (!map_.removed_keyframes_.empty())
    numbers_.next_keyframe =
        std::max(numbers_.next_keyframe, index(map_.removed_keyframes_.back().id) + 1);
  map_.next_landmark_ = 0;
  for (const auto& [id, landmark] : map_.landmarks_)
    map_.next_landmark_ = std::max(map_.next_landmark_, index(id) + 1);
}

Map MapAssembly::finish() {
  CHECK(!parent_fault());
  count_covisibility();
  map_.next_keyframe_ = numbers_.next_keyframe;
  map_.version_ = numbers_.version;
  map_.origin_ = map_.largest_root();
  return std::move(map_);
}

}  // namespace ygslam
