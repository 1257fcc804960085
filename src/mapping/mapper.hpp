// The mapping stage: the only writer of the map.
#pragma once

#include <atomic>
#include <deque>
#include <span>

#include "geometry/camera.hpp"
#include "map/local_view.hpp"
#include "map/map.hpp"
#include "map/map_gravity.hpp"
#include "map/messages.hpp"
#include "mapping/bundle_window.hpp"
#include "mapping/culling.hpp"
#include "mapping/landmark_maker.hpp"
#include "mapping/late_shutter.hpp"
#include "mapping/neighbour_fusion.hpp"
#include "mapping/view_builder.hpp"
#include "motion/labels.hpp"

namespace ygslam {

struct MapperConfig {
  NoiseConfig noise;
  LandmarkMakerConfig landmarks;
  NeighbourFusionConfig fusion;
  CullingConfig culling;
  BundleWindowConfig window;
  BundleConfig bundle;
  ViewConfig view;
  bool local_bundle = true;  ///< false: no bundle adjustment (ablation)
};

class Mapper {
 public:
  /// @param map to go on with; an empty one to start.
  Mapper(const MapperConfig& config, const Camera& camera, Map map);

  /// Takes a candidate into the map with the landmarks it brings: quick, so that the tracker can
  /// have them at once. @return its id.
  KeyframeId insert(const KeyframeCandidate& candidate);
  /// Fuses, triangulates, adjusts and culls around the newest keyframe: slow.
  /// @param abort set by another thread to end the adjustment after its current iteration.
  /// @return the keyframes that were culled.
  std::vector<KeyframeId> refine(const std::atomic<bool>* abort = nullptr);
  /// Takes over what was computed on a copy of the map.
  void correct(const MapPatch& patch);
  /// A read-out time was found late; see late_shutter.hpp.
  bool correct_shutter(double was_s, const ShutterTimes& now) {
    return ygslam::correct_shutter(map_, camera_, was_s, now);
  }
  /// See map_gravity.hpp.
  bool forget_imu(const ImuRetraction& retraction);
  /// A submap's place was found: Map::join() after the patch that moves it there.
  void join(KeyframeId root, KeyframeId parent, const MapPatch& patch);
  /// Fuses what keyframes see with what those at a place see that they were found at.
  void fuse_visits(std::span<const KeyframeId> keyframes, const std::vector<KeyframeId>& place);
  /// Views are cut out around this keyframe from now on, until a new one is inserted. One that is
  /// no longer there is as good as the newest. @return false if they are already.
  bool look_around(KeyframeId focus);
  /// The mask of a keyframe arrived: its features on movable things lose their landmarks and those
  /// seen outside are now surely static. A mask that covers nearly all features is ignored.
  /// @param labels per feature. @return true if the map changed.
  bool apply_mask(KeyframeId id, std::span<const SemanticLabel> labels);

  /// What keyframes of this run saw at masked pixels is not of the world: features there lose their
  /// weight and their landmarks. @return true if the map changed.
  bool forget_pixels(const GreyImage& mask);

  [[nodiscard]] LocalViewPtr view() const;
  [[nodiscard]] const Map& map() const { return map_; }

 private:
  [[nodiscard]] KeyframeId parent_of(const KeyframeCandidate& candidate) const;
  void associate(const KeyframeCandidate& candidate, KeyframeId id);

  MapperConfig config_;
  const Camera& camera_;
  Map map_;
  KeyframeId newest_ = kNoKeyframe;
  std::deque<KeyframeId> foci_;  // of the views so far, newest last: where the camera is
  GravityOfGrowingMap gravity_;
  std::vector<LandmarkId> recent_landmarks_;
  std::uint32_t deformations_ = 0;
};

}  // namespace ygslam
