// The dense map stage: a pure function of the dense keyframes, their poses and the state of their
// pixels. A corrected pose and a keyframe that went are both "this contribution changed": it is
// taken back as it was and put in as it is.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/ids.hpp"
#include "dense/object_map.hpp"
#include "dense/pixel_state.hpp"
#include "dense/stored_view.hpp"
#include "image/coloured_point.hpp"
#include "image/rgbd_frame.hpp"
#include "volume/mesher.hpp"

namespace ygslam {

struct DenseMapConfig {
  bool enabled = true;  ///< false: it stays empty
  VolumeConfig volume;
  ReadingConfig reading;
  ObjectMapConfig objects;
  int edge_px = 2;    ///< so near the edge of a thing's mask nothing is said to be of the thing
  int margin_px = 6;  ///< this far around a mover nothing is taken: masks and depth have soft edges
};

struct DenseKeyframe {
  KeyframeId id = kNoKeyframe;
  FramePtr frame;
  ReadOut read_out;
  GreyImage movers;                   ///< 255 where something moves or may move; empty = none
  GreyImage things;                   ///< 0 = none, i + 1 = detections[i]; empty = none
  std::vector<Detection> detections;  ///< of things that stand about; at most kMaxDetections
};

/// A keyframe's contribution as it is kept on disk; its pose is the map's.
struct SavedView {
  KeyframeId id = kNoKeyframe;
  Timestamp stamp;
  std::vector<ThingView> things;
  std::shared_ptr<const StoredView> view;  ///< its objects are numbers of things, from 1
};

/// What changed since the last one.
struct DenseUpdate {
  std::vector<DenseKeyframe> added;
  std::vector<KeyframeId> removed;
  /// Of the keyframes that have a place in the world: all of them.
  std::map<KeyframeId, SE3> T_world_camera;
};

/// The mesh's vertices.
[[nodiscard]] std::vector<ColouredPoint> coloured_points(const TriangleMesh& mesh);

class DenseMap {
 public:
  DenseMap(const DenseMapConfig& config, const Camera& camera);

  void apply(const DenseUpdate& update);
  /// Takes over the keyframes of an earlier run; they go in where the next update has their poses.
  void restore(const std::vector<SavedView>& views);
  /// Of the keyframes that have a place in the world.
  [[nodiscard]] std::vector<SavedView> saved() const;
  /// Brings the keyframe up to date that is most out of place, if one is by more than half a voxel
  /// at some distance. @return false if none is.
  bool step();
  /// Brings all of them up to date, however little they moved.
  void finish();

  /// Puts a view in that is no keyframe's, whatever the next finish() does; not for a map that
  /// goes on. @return false where there are too many already.
  bool add(const DepthView& view, const SE3& T_world_camera);

  /// As of the contributions that are in.
  [[nodiscard]] TriangleMesh mesh();
  [[nodiscard]] std::vector<ColouredPoint> cloud() { return coloured_points(mesh()); }
  [[nodiscard]] StaticScene scene();
  [[nodiscard]] const Volume& volume() const { return *volume_; }
  [[nodiscard]] const DenseMapConfig& config() const { return config_; }
  struct PlacedView {
    SE3 T_world_camera;
    const StoredView* view;  ///< until the next change
  };
  /// Of all that is in.
  [[nodiscard]] std::vector<PlacedView> views() const;
  /// Of the volume, its mesh and the keyframes' images.
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Contribution {
    std::shared_ptr<const StoredView> view;  // its objects are numbers of detections, from 1
    std::vector<ThingView> things;
    Timestamp stamp;
    std::optional<SE3> wanted;  // T_world_camera; none: it has no place
    std::optional<SE3> fused;
    std::optional<SE3> associated;           // the pose its things were compared with others at
    std::optional<PixelState> wanted_state;  // none: not compared with the others yet
    PixelState fused_state;

    [[nodiscard]] bool is_up_to_date() const;
  };
  [[nodiscard]] DepthView view_of(const Contribution& contribution, const PixelState& state,
                                  const SE3& T_world_camera) const;
  void take_back(Contribution& contribution);
  /// Whether a keyframe was corrected by more than what things are told apart by.
  [[nodiscard]] bool association_is_loose() const;
  void associate_all();
  void associate(Contribution& contribution);
  /// Of a thing that went: its pixels in the keyframes that showed it.
  void withdraw(SceneObjectId gone);
  [[nodiscard]] double out_of_place_m(const Contribution& contribution) const;
  void bring_up_to_date(Contribution& contribution);
  void start_again();

  DenseMapConfig config_;
  const Camera& camera_;
  std::map<KeyframeId, Contribution> contributions_;
  std::vector<std::pair<SE3, StoredView>> added_;  // by add()
  ObjectMap objects_;
  std::optional<Volume> volume_;
  std::optional<Mesher> mesher_;
  int min_views_ = 0;  // that the mesher asks for
};

}  // namespace ygslam
