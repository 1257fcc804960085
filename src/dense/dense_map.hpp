// The dense map stage: a pure function of the dense views, their poses and the state of their
// pixels. A corrected pose and a view that went are both "this contribution changed": it is
// taken back as it was and put in as it is. Views are the keyframes, and frames between them as
// long as they show what others do not.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "dense/dense_frame.hpp"
#include "dense/object_map.hpp"
#include "dense/pixel_state.hpp"
#include "dense/space_changes.hpp"
#include "dense/surface_sample.hpp"
#include "image/coloured_point.hpp"
#include "volume/mesher.hpp"

namespace ygslam {

struct DenseMapConfig {
  bool enabled = true;  ///< false: it stays empty
  VolumeConfig volume;
  ReadingConfig reading;
  ObjectMapConfig objects;  ///< its cells are as large as those of the volume's space
  SpaceChangesConfig changes;
  int margin_px = 6;  ///< this far around a mover nothing is taken: masks and depth have soft edges
  double interval_s = 0.5;  ///< without a view for so long, a frame is offered; 0: keyframes alone
  double min_new = 0.02;    ///< share of a frame's surface, less of which is not worth a view
  int spare_views = 2;      ///< beyond those that a surface needs: then a frame's goes again,
  int thing_views = 6;      ///< if each thing that it shows has more than these
  double protected_s = 10;  ///< a frame stays so long after it was taken
  int most_near = 40;       ///< frames of one place, whatever they show
  double near_m = 1.5;      ///< from which so little of what they see moved in the image [m]
};

/// A keyframe that the map dropped: what it was the anchor of has another from now on.
struct RemovedAnchor {
  KeyframeId id = kNoKeyframe;
  DenseAnchor now;  ///< its camera's
};

/// What changed since the last one.
struct DenseUpdate {
  std::vector<DenseFrame> added;
  std::vector<RemovedAnchor> removed;
  /// Of the keyframes that have a place in the world: all of them.
  std::map<KeyframeId, SE3> T_world_camera;
};

/// The mesh's vertices.
[[nodiscard]] std::vector<ColouredPoint> coloured_points(const TriangleMesh& mesh);

class DenseMap {
 public:
  DenseMap(const DenseMapConfig& config, const Camera& camera);

  void apply(const DenseUpdate& update);
  /// Takes over the views of an earlier run; they go in where the next update has their poses.
  void restore(const std::vector<SavedView>& views);
  /// Of the views that have a place in the world.
  [[nodiscard]] std::vector<SavedView> saved() const;
  /// Brings the view up to date that is most out of place, if one is by more than half a voxel
  /// at some distance; a frame between keyframes that shows nothing new is dropped instead.
  /// @return false if none is.
  bool step();
  /// Brings all of them up to date, however little they moved.
  void finish();

  /// Puts a view in that is no keyframe's, whatever the next finish() does; not for a map that
  /// goes on. @return false where there are too many already.
  bool add(const DepthView& view, const SE3& T_world_camera);

  /// As of the contributions that are in.
  [[nodiscard]] TriangleMesh mesh();
  [[nodiscard]] std::vector<ColouredPoint> cloud() { return coloured_points(mesh()); }
  [[nodiscard]] const Volume& volume() const { return volume_; }
  [[nodiscard]] const DenseMapConfig& config() const { return config_; }
  [[nodiscard]] const Camera& camera() const { return camera_; }
  [[nodiscard]] const ObjectMap& objects() const { return objects_; }
  struct PlacedView {
    DenseViewId id;  ///< of no keyframe: by add()
    Timestamp stamp;
    SE3 T_world_camera;
    const StoredView* view;  ///< until the next change
  };
  /// Of all that is in.
  [[nodiscard]] std::vector<PlacedView> views() const;
  /// What of the view is in, unpacked.
  [[nodiscard]] DepthView images(const PlacedView& view);
  /// Of the volume, its mesh and the views' images.
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Contribution {
    std::shared_ptr<const StoredView> view;  // its objects are numbers of detections, from 1
    std::vector<ThingView> things;
    Timestamp stamp;
    std::optional<DenseAnchor> anchor;    // none: a keyframe
    std::optional<SurfaceSample> sample;  // of a frame that was found worth it
    std::optional<SE3> wanted;            // T_world_camera; none: it has no place
    std::optional<SE3> fused;
    std::optional<SE3> associated;           // the pose its things were compared with others at
    std::optional<PixelState> wanted_state;  // none: not compared with the others yet
    PixelState fused_state;
    bool decides_change = false;  // without it the map would show what went, or not what came
    struct Seen {
      SeenSpace space;
      SE3 T_world_camera;
      PixelState state;
      [[nodiscard]] bool is_of(const SE3& T_world_now, const PixelState& state_now) const;
    };
    std::optional<Seen> seen;  // what it said of space at last
    /// The same as it was put in, where that differs: something went.
    std::optional<SeenSpace> seen_without_gone;

    [[nodiscard]] bool is_up_to_date() const;
  };
  /// The last one stays unpacked.
  /// @return until the next call.
  const DepthView& restored(const Contribution& contribution);
  [[nodiscard]] DepthView view_of(const Contribution& contribution, const PixelState& state,
                                  const SE3& T_world_camera);
  void take_back(Contribution& contribution);
  /// Exchanges the cells that it must not carve if nothing else of its pixels changed; it stays
  /// where it was put in.
  void spare_anew(Contribution& contribution);
  /// Of a frame taken after that keyframe.
  [[nodiscard]] DenseViewId next_id(KeyframeId newest) const;
  /// Whether a keyframe was corrected by more than what things are told apart by.
  [[nodiscard]] bool association_is_loose() const;
  void associate_all();
  void associate(Contribution& contribution);
  /// Of a thing that went: its pixels in the keyframes that showed it.
  void withdraw(SceneObjectId gone);
  /// What it says of space, whatever came or went.
  [[nodiscard]] const SeenSpace& space_seen(Contribution& contribution);
  /// Whether it looks through a surface, or sees one in the air, which too few views did as yet.
  [[nodiscard]] bool sees_space_change(Contribution& contribution);
  /// Whether one of the cells lies in its picture.
  [[nodiscard]] bool may_see(const Contribution& contribution,
                             const std::vector<SpaceIndex>& cells) const;
  /// By all counts something stands in such a cell, or would not be shown.
  [[nodiscard]] bool may_be_gone(SpaceCounts known) const;
  [[nodiscard]] bool may_have_come(SpaceCounts known) const;
  /// Where views disagree about cells the last ones decide: what others saw there is taken back.
  void settle_space(const std::vector<SpaceIndex>& disputed, int most_views);
  /// Of the whole map, as if nothing had been taken back before.
  void settle_space();
  /// Of what a new view saw.
  void settle_space_of(Contribution& contribution);
  [[nodiscard]] double out_of_place_m(const Contribution& contribution) const;
  void bring_up_to_date(Contribution& contribution);
  /// Drops a frame between keyframes that shows nothing new. @return whether it did.
  bool drop_needless(DenseViewId id);
  [[nodiscard]] bool shows_new(Contribution& contribution, const SurfaceSample& sample);
  void take_in_new_frames();
  /// Takes frames back of which the map has enough by now; looks at a few of them.
  void cull();
  /// Of more frames near this one than a place may have those go that show least of what others
  /// do not: noise makes each of them look a little new, for ever.
  void thin_out(const SE3& T_world_camera);
  [[nodiscard]] bool may_go(const Contribution& old) const;
  void remove(std::map<DenseViewId, Contribution>::iterator old);
  [[nodiscard]] double share_of_its_own(const Contribution& old) const;
  [[nodiscard]] bool is_needed(const Contribution& old) const;
  void start_again();

  DenseMapConfig config_;
  const Camera& camera_;
  std::map<DenseViewId, Contribution> contributions_;
  DenseViewId culled_up_to_{KeyframeId{0}};        // the next look begins behind it
  std::vector<std::pair<SE3, StoredView>> added_;  // by add()
  ObjectMap objects_;
  Volume volume_;
  std::optional<Mesher> mesher_;
  int min_views_ = 0;  // that the mesher asks for
  struct Restored {
    std::shared_ptr<const StoredView> packed;
    DepthView view;
  };
  Restored restored_;
  bool is_finished_ = false;      // nothing changed since
  bool is_space_settled_ = true;  // since things were last compared anew
};

}  // namespace ygslam
