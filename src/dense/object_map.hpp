// Which of the objects that one keyframe shows is which of those that others showed.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "core/time.hpp"
#include "dense/known_object.hpp"
#include "dense/object_observation.hpp"
#include "dense/place_check.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

struct ObjectMapConfig {
  double cell_m = 0.05;
  double patch_m = 0.025;
  double min_overlap = 0.25;       ///< share of a view's surface that lies in an object like it
  double min_other_overlap = 0.5;  ///< the same of both where the class is another
  double merge_overlap = 0.5;      ///< of the smaller: two objects of one class that are the same
  PlaceCheckConfig look;
  int min_views = 3;           ///< of an object that was found elsewhere again, of a known surface
  double min_new_part = 0.25;  ///< of what a view shows of an object: worth a view
  double min_like_size = 0.8;  ///< Likeness of the same object at two places
  double min_like_colour = 0.5;
  double max_way_m = 1.5, max_unseen_s = 3;  ///< of an object between two views of it on the move
};

/// The same calls give the same objects.
class ObjectMap {
 public:
  explicit ObjectMap(const ObjectMapConfig& config = {}) : config_(config) {}

  /// @return the object of each view, kNoSceneObject for one without points. An object is seen at
  /// most once by a keyframe.
  std::vector<SceneObjectId> step(std::span<const ObjectObservation> views,
                                  const SE3& T_world_camera, Timestamp stamp);
  /// Looks whether objects are still where they stood; before the step of the same keyframe.
  /// @return those that are absent since.
  std::vector<SceneObjectId> check_places(const DepthView& view, const SE3& T_world_camera,
                                          Timestamp stamp);
  /// Whether one of the objects that stand there is none that so many views showed, or shows a part
  /// of its surface that hardly any view showed.
  [[nodiscard]] bool is_poorly_known(std::span<const ObjectObservation> views,
                                     const SE3& T_world_camera, int enough_views) const;
  /// Whether the view sees through an object's place, and that says something that is not known
  /// yet.
  [[nodiscard]] bool observes_change(const DepthView& view, const SE3& T_world_camera) const;
  /// A view is not in the map any more: what no other showed is no object.
  void forget(Timestamp view);
  /// What the object was found to be the same as, by now; itself for most.
  [[nodiscard]] SceneObjectId current(SceneObjectId object) const;
  /// By place: an object that was moved is several of them.
  [[nodiscard]] const std::map<SceneObjectId, KnownObject>& objects() const { return objects_; }
  /// Where the object stood before; kNoSceneObject if nowhere.
  [[nodiscard]] SceneObjectId earlier(SceneObjectId object) const;
  /// The number that the object has at all its places: of the first.
  [[nodiscard]] SceneObjectId thing(SceneObjectId object) const;
  /// Whether it stands elsewhere by now.
  [[nodiscard]] bool has_later(SceneObjectId object) const;
  /// Of the last keyframe.
  [[nodiscard]] Timestamp now() const { return now_; }

 private:
  struct Cells {
    std::vector<CellKey> keys;  // ascending
    Eigen::AlignedBox3d extent_world;
  };
  [[nodiscard]] Cells cells_of(const ObjectObservation& view, const SE3& T_world_camera) const;
  /// How well the view fits the object; 0 if it does not.
  [[nodiscard]] double fit(const Detection& detection, const Cells& cells,
                           const KnownObject& object) const;
  /// Of each view the object that it fits best, of pairs the best first; kNoSceneObject: none.
  [[nodiscard]] std::vector<SceneObjectId> best_fits(std::span<const ObjectObservation> views,
                                                     const std::vector<Cells>& cells) const;
  [[nodiscard]] bool are_apart(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) const;
  void add_view(const ObjectObservation& view, const Cells& cells, const SE3& T_world_camera,
                Timestamp stamp, KnownObject& object) const;
  /// Of an object on the move: where it is now it will not stay.
  void note_motion(const ObjectObservation& view, const Cells& cells, Timestamp stamp);
  void merge_with_equals(SceneObjectId id);
  /// Gives an object that went and stands elsewhere its number back.
  void find_again();

  ObjectMapConfig config_;
  std::map<SceneObjectId, KnownObject> objects_;
  std::map<SceneObjectId, SceneObjectId> merged_into_;
  std::map<SceneObjectId, SceneObjectId> came_from_;  // place before
  Timestamp now_;
  std::uint16_t last_id_ = 0;
};

}  // namespace ygslam
