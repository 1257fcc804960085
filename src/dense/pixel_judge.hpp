// What the pixels of each view show: which object, and what of it is not there any more. A pure
// function of all views and their poses; what views already told is kept, so that one more costs
// little.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>

#include "dense/fused_volume.hpp"
#include "dense/object_map.hpp"
#include "dense/space_judge.hpp"
#include "dense/view_store.hpp"

namespace ygslam {

class PixelJudge {
 public:
  PixelJudge(const DenseMapConfig& config, const Camera& camera,
             std::shared_ptr<ViewUnpacker> unpacker);

  /// nullptr: not judged.
  [[nodiscard]] const PixelState* state(DenseViewId id) const;
  [[nodiscard]] const ObjectMap& objects() const { return objects_.map; }
  /// Whether the map would show something else without the view: what was removed, or appeared.
  [[nodiscard]] bool decides(DenseViewId id) const { return deciding_.contains(id); }
  /// Whether a view that is not in the volume observes a change of space.
  [[nodiscard]] bool observes_change(const DenseView& view, FusedVolume& fused) const;

  /// Objects of all views that have a place, in their order. What was removed or appeared in the
  /// space of views that are fused stays until judge_space().
  void judge_objects(const ViewStore& views, const FusedVolume& fused);
  /// Of one more view.
  void judge_objects(DenseViewId id, const ViewStore& views, const FusedVolume& fused);
  /// What was removed or appeared in the space of all views that are fused.
  void judge_space(FusedVolume& fused);
  /// In the space that one of them observed.
  void judge_space(DenseViewId id, FusedVolume& fused);
  /// Judges anew if poses were corrected by more than what objects are told apart by: objects of a
  /// few views a call, which count with the last of them, then space. @return whether it did.
  bool judge_corrected(const ViewStore& views, FusedVolume& fused);
  /// What is being judged anew does not count yet.
  [[nodiscard]] bool is_judging() const { return anew_.has_value(); }
  void forget(DenseViewId id, Timestamp stamp);

 private:
  struct Judged {
    Timestamp stamp;
    SE3 T_world_camera;  // its objects were compared with others at
    PixelState state;
  };
  struct Objects {
    ObjectMap map;
    std::map<DenseViewId, Judged> judged;  // views
  };
  struct Anew {
    Objects objects;
    std::optional<DenseViewId> last;  // that was judged
  };
  [[nodiscard]] bool was_corrected(const ViewStore& views) const;
  static void remove_pixels_of(SceneObjectId removed, Objects& objects);
  void judge(DenseViewId id, const ViewStore& views, const FusedVolume& fused,
             Objects& objects) const;
  /// Of views that have a place, the next ones. With the last of all they count.
  void judge_anew(std::size_t most_views, const ViewStore& views, const FusedVolume& fused);
  void take(const SpaceVerdict& verdict);

  DenseMapConfig config_;
  std::shared_ptr<ViewUnpacker> unpacker_;
  SpaceJudge space_;
  Objects objects_;
  std::optional<Anew> anew_;
  std::set<DenseViewId> deciding_;
  bool is_space_judged_ = true;  // since objects were last judged anew
};

}  // namespace ygslam
