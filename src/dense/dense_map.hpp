// The dense map stage: a pure function of its views, their poses and the states of their pixels.
// Whatever changes later, a view's contribution to the volume is taken back as it was and put in as
// it is. Views are the keyframes, and frames between them as long as they show what others do not.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "dense/dense_config.hpp"
#include "dense/dense_frame.hpp"
#include "dense/fused_volume.hpp"
#include "dense/ground_plan.hpp"
#include "dense/pixel_judge.hpp"
#include "dense/view_policy.hpp"
#include "dense/view_store.hpp"
#include "image/coloured_point.hpp"

namespace ygslam {

/// The mesh's vertices.
[[nodiscard]] std::vector<ColouredPoint> coloured_points(const TriangleMesh& mesh);

class DenseMap {
 public:
  DenseMap(const DenseMapConfig& config, const Camera& camera);

  void apply(const DenseUpdate& update);
  /// Somebody will look at it before finish(): what walking people leave is taken out of older
  /// views within a second, not ten, and corrected poses are followed at once. A plan is always
  /// looked at.
  void expect_looks();
  /// Takes over the views of an earlier run; they go in where the next update has their poses.
  void restore(const std::vector<SavedView>& views);
  /// Of the views that have a place in the world.
  [[nodiscard]] std::vector<SavedView> saved() const { return views_.saved(); }
  /// Brings the view up to date that is most out of place and in or has room, if one is by more
  /// than half a voxel at some distance (where nobody looks, and for ten seconds after the last
  /// time, by more than a cell of space); a frame between keyframes that shows nothing new is
  /// dropped instead.
  /// @return false if none is.
  bool step();
  /// Brings all of them up to date, however little they moved.
  void finish();
  /// Puts a view in that is no keyframe's, whatever the next finish() does; not for a map that
  /// goes on. @return false where there are too many already.
  bool add(const DepthView& view, const SE3& T_world_camera) {
    return fused_.add(view, T_world_camera);
  }

  /// As of the contributions that are in.
  [[nodiscard]] TriangleMesh mesh() { return fused_.mesh(); }
  [[nodiscard]] std::vector<ColouredPoint> cloud() { return coloured_points(mesh()); }
  [[nodiscard]] const Volume& volume() const { return fused_.volume(); }
  /// As of the contributions that are in, and of frames that entered nothing but showed what is
  /// free; DenseMapConfig::keeps_plan. Without a floor it is empty (live_plan() looks for it).
  [[nodiscard]] GroundPlan& plan();
  [[nodiscard]] const ObjectMap& objects() const { return judge_.objects(); }
  [[nodiscard]] const DenseMapConfig& config() const { return config_; }
  [[nodiscard]] const Camera& camera() const { return camera_; }
  struct PlacedView {
    DenseViewId id;
    Timestamp stamp;
    SE3 T_world_camera;
    const StoredView* view;  ///< until the next change
  };
  /// Of all that is in.
  [[nodiscard]] std::vector<PlacedView> views() const;
  /// Whether the floor should be looked for: at first with each view, then the more seldom the
  /// more there are.
  [[nodiscard]] bool wants_floor() const;
  /// What was found, be it no floor.
  void set_floor(const Gravity& gravity);
  /// Of the newest image that the plan has seen.
  [[nodiscard]] Timestamp planned() const { return planned_; }
  /// What of the view is in, unpacked.
  [[nodiscard]] DepthView images(const PlacedView& view) { return fused_.pixels(view.id); }
  /// Of the volume, its mesh and the views' images.
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  void add(const DenseFrame& frame);
  void drop_keyframe(const RemovedAnchor& removed);
  [[nodiscard]] double out_of_place_m(DenseViewId id, const DenseView& view) const;
  [[nodiscard]] bool was_synced_lately(DenseViewId id) const;
  [[nodiscard]] std::optional<DenseViewId> most_out_of_place() const;
  bool judge_corrected();
  /// Of a frame of which it is not decided whether it enters. @return whether it was dropped.
  bool drop_needless(DenseViewId id);
  void bring_up_to_date(DenseViewId id, double tolerance_m = 0);
  bool make_room();
  /// Removes frames of which the map has enough since a view from here came; looks at a few of
  /// them.
  void cull(const SE3& T_world_camera);
  void remove(DenseViewId id);
  /// Of a frame that enters nothing.
  void note_in_plan(const DenseView& dropped);
  /// @param T_world_before where the view was in the map; nullopt: it was not.
  void note_in_plan(DenseViewId id, const std::optional<SE3>& T_world_before);
  /// Of the views that came later, the newest first; until something is put in or taken out.
  [[nodiscard]] std::vector<const SeenSpace*> observed_after(Timestamp stamp);
  void update_plan();
  void take_in_new_frames();
  /// Of all views that have a place and were judged.
  [[nodiscard]] FusedVolume::Placements wanted() const;

  DenseMapConfig config_;
  const Camera& camera_;
  std::shared_ptr<ViewUnpacker> unpacker_ = std::make_shared<ViewUnpacker>();
  ViewStore views_;
  FusedVolume fused_;
  PixelJudge judge_;
  ViewPolicy policy_;
  GroundPlan plan_;
  int placements_ = 0, looked_for_floor_ = 0;  // of views, again after corrections, too
  Timestamp planned_;
  bool is_watched_;
  Timestamp newest_;                            // of the images that came
  std::map<DenseViewId, Timestamp> synced_at_;  // newest_ when the view was brought up to date
  std::set<DenseViewId> refused_;               // that make_room() was called for since it is full
  bool is_finished_ = false;                    // nothing changed since
};

}  // namespace ygslam
