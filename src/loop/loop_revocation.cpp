#include "loop/loop_revocation.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <set>

#include "core/statistics.hpp"

namespace ygslam {
namespace {

constexpr double kApart_px = 3;  // in the pyramid level of the feature
constexpr double kWorse = 2;     // times as far off as before
// Of how far what was fused comes apart: beyond, an observation is one across the weld.
constexpr double kAcross = 0.5;

using Observed = std::pair<KeyframeId, std::uint32_t>;

/// The map as it will be, as far as it is known.
class Restored {
 public:
  Restored(const Map& map, const Camera& camera, const LoopEffect& effect)
      : map_(map), camera_(camera), patch_(effect.undo), moved_(map.moved_by(effect.undo)) {
    take_back(effect.fusions);
    apart_m_ = typical_distance_m(effect.fusions);
    for (const LandmarkId id : all_landmarks()) look_after(map.landmark(id));
  }

  [[nodiscard]] MapPatch patch() && {
    for (auto& [landmark, p_world] : p_world_)
      if (map_.has_landmark(landmark))
        patch_.points.push_back({landmark, map_.landmark(landmark).p_world, p_world});
    return std::move(patch_);
  }

 private:
  /// Of a keyframe that may have been removed.
  [[nodiscard]] SE3 pose(KeyframeId id) const {
    const KeyframeId kept = map_.nearest_kept(id);
    const auto it = moved_.find(kept);
    const SE3& T_kept_world =
        it == moved_.end() ? map_.keyframe(kept).T_camera_world : it->second.T_camera_world;
    if (kept == id) return T_kept_world;
    return map_.resolved_pose(id) * map_.keyframe(kept).T_camera_world.inverse() * T_kept_world;
  }

  [[nodiscard]] Vec3 position(const FusionLog::Anchored& at) const {
    return pose(at.keyframe).inverse() * at.p_camera;
  }

  void take_back(const FusionLog& log) {
    for (auto fusion = log.fusions.rbegin(); fusion != log.fusions.rend(); ++fusion) {
      MapPatch::Split split = fusion->undo;
      split.p_world = position(fusion->at);
      p_world_[split.from] = position(fusion->into_at);
      p_world_[split.landmark] = split.p_world;
      for (const LandmarkObservation& o : split.observations)
        owner_[{o.keyframe, o.feature}] = split.landmark;
      parts_[split.from].push_back(patch_.splits.size());
      patch_.splits.push_back(std::move(split));
    }
    patch_.dropped = log.added;
    for (const MapPatch::Observation& o : log.added) dropped_.emplace(o.landmark, o.keyframe);
  }

  /// Between the two halves of what was fused.
  [[nodiscard]] double typical_distance_m(const FusionLog& log) const {
    std::vector<double> distances_m;
    for (const FusionLog::Fusion& fusion : log.fusions)
      distances_m.push_back((position(fusion.at) - position(fusion.into_at)).norm());
    return distances_m.empty() ? 0 : median(distances_m);
  }

  /// Whether the keyframe and the landmark stood on two sides of the weld.
  [[nodiscard]] bool is_across(const Landmark& landmark, KeyframeId keyframe) const {
    return (position(landmark) - moved_with(keyframe, landmark)).norm() > kAcross * apart_m_;
  }

  [[nodiscard]] std::vector<LandmarkId> all_landmarks() const {
    std::vector<LandmarkId> ids;
    map_.for_each_landmark([&](const Landmark& landmark) { ids.push_back(landmark.id); });
    std::ranges::sort(ids);
    return ids;
  }

  [[nodiscard]] Vec3 position(const Landmark& landmark) const {
    const auto known = p_world_.find(landmark.id);
    return known != p_world_.end() ? known->second
                                   : moved_with(landmark.observations.front().keyframe, landmark);
  }

  /// Where the landmark is if it goes with the keyframe.
  [[nodiscard]] Vec3 moved_with(KeyframeId keyframe, const Landmark& landmark) const {
    const auto it = moved_.find(keyframe);
    return it == moved_.end() ? landmark.p_world : it->second.T_new_old * landmark.p_world;
  }

  [[nodiscard]] const Feature& feature(const LandmarkObservation& o) const {
    return map_.keyframe(o.keyframe).data->features->points[o.feature];
  }

  /// In units of the feature's pyramid level.
  [[nodiscard]] double error_px(const SE3& T_camera_world, const Vec3& p_world,
                                const LandmarkObservation& o) const {
    const Vec3 p_camera = T_camera_world * p_world;
    if (p_camera.z() < 0.1) return std::numeric_limits<double>::infinity();
    const Feature& f = feature(o);
    return (camera_.project(p_camera) - f.ideal_px.cast<double>()).norm() /
           map_.scales().of(f.octave);
  }
  [[nodiscard]] double error_px(const Vec3& p_world, const LandmarkObservation& o) const {
    return error_px(pose(o.keyframe), p_world, o);
  }

  /// Finds the observations of a landmark from across the weld that do not show it any more, and
  /// what they show instead.
  void look_after(const Landmark& landmark) {
    const Vec3 p_world = position(landmark);
    std::vector<LandmarkObservation> apart;
    for (const LandmarkObservation& o : landmark.observations) {
      const auto owner = owner_.find({o.keyframe, o.feature});
      const bool stays = owner == owner_.end() || owner->second == landmark.id;
      if (!stays || dropped_.contains({landmark.id, o.keyframe})) continue;
      if (!is_across(landmark, o.keyframe)) continue;
      const double after_px = error_px(p_world, o);
      if (give_to_part(landmark.id, o, after_px)) continue;
      const double before_px =
          error_px(map_.keyframe(o.keyframe).T_camera_world, landmark.p_world, o);
      if (after_px > kApart_px && after_px > kWorse * before_px) apart.push_back(o);
    }
    make_again(landmark.id, apart);
  }

  /// What was fused into the landmark and is now apart may be what is shown.
  bool give_to_part(LandmarkId landmark, const LandmarkObservation& o, double of_landmark_px) {
    const auto parts = parts_.find(landmark);
    if (parts == parts_.end()) return false;
    return std::ranges::any_of(parts->second, [&](std::size_t i) {
      MapPatch::Split& split = patch_.splits[i];
      return error_px(split.p_world, o) < of_landmark_px && give(split, o);
    });
  }

  static bool give(MapPatch::Split& split, const LandmarkObservation& o) {
    const auto same = [&](const LandmarkObservation& other) {
      return other.keyframe == o.keyframe;
    };
    if (std::ranges::any_of(split.observations, same)) return false;
    split.observations.push_back(o);
    return true;
  }

  /// A new landmark where the first of the observations has it; what does not show that shows
  /// nothing.
  void make_again(LandmarkId landmark, const std::vector<LandmarkObservation>& apart) {
    MapPatch::Split made;
    for (const LandmarkObservation& o : apart) {
      const Feature& f = feature(o);
      if (made.observations.empty() && f.depth_m > 0) {
        made.p_world =
            pose(o.keyframe).inverse() * camera_.unproject(f.ideal_px.cast<double>(), f.depth_m);
        made.first_keyframe = o.keyframe;
        made.observations.push_back(o);
      } else if (made.observations.empty() || error_px(made.p_world, o) > kApart_px ||
                 !give(made, o)) {
        patch_.dropped.push_back({landmark, o.keyframe});
      }
    }
    if (!made.observations.empty()) patch_.splits.push_back(std::move(made));
  }

  const Map& map_;
  const Camera& camera_;
  MapPatch patch_;
  const std::map<KeyframeId, Map::Moved> moved_;
  std::map<LandmarkId, Vec3> p_world_;                    // of what the weld fused
  std::map<LandmarkId, std::vector<std::size_t>> parts_;  // splits of a landmark
  std::map<Observed, LandmarkId> owner_;                  // after the splits
  std::set<std::pair<LandmarkId, KeyframeId>> dropped_;
  double apart_m_ = 0;  // between what was fused
};

}  // namespace

MapPatch inverse_poses(const MapPatch& patch) {
  MapPatch inverse;
  inverse.first_later = patch.first_later;
  for (const MapPatch::Pose& pose : patch.poses)
    inverse.poses.push_back({pose.keyframe, pose.T_camera_world, pose.T_camera_base});
  return inverse;
}

void add_adjustment(LoopEffect& effect, const MapPatch& adjustment) {
  std::map<KeyframeId, SE3> T_old_new;
  for (const MapPatch::Pose& pose : adjustment.poses)
    T_old_new[pose.keyframe] = pose.T_camera_base.inverse() * pose.T_camera_world;
  for (MapPatch::Pose& pose : effect.undo.poses) {
    const auto it = T_old_new.find(pose.keyframe);
    if (it != T_old_new.end()) pose.T_camera_base = pose.T_camera_base * it->second;
  }
}

MapPatch make_revocation(const Map& map, const Camera& camera, const LoopEffect& effect) {
  return Restored(map, camera, effect).patch();
}

}  // namespace ygslam
