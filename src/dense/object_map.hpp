// Which of the things that one keyframe shows is which of those that others showed.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <unordered_map>
#include <vector>

#include "core/time.hpp"
#include "dense/thing_view.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

struct ObjectMapConfig {
  double cell_m = 0.05;
  double min_overlap = 0.25;       ///< share of a view's surface that lies in an object like it
  double min_other_overlap = 0.5;  ///< the same of both where the class is another
  double merge_overlap = 0.5;      ///< of the smaller: two objects of one class that are the same
};

/// Counts of the things seen at one place.
struct KnownObject {
  std::map<SemanticClass, double> class_scores;  ///< sums over its views
  std::unordered_map<std::uint64_t, int> cells;  ///< how many views showed its surface there
  Eigen::AlignedBox3d extent_world;              ///< of all its cells
  std::set<Timestamp> seen;                      ///< of the keyframes that showed it

  [[nodiscard]] int views() const { return static_cast<int>(seen.size()); }
  [[nodiscard]] SemanticClass best_class() const;
  /// Share of the best class in its views: what the scores left open is unknown.
  [[nodiscard]] float probability() const;
};

/// The same calls give the same objects.
class ObjectMap {
 public:
  explicit ObjectMap(const ObjectMapConfig& config = {}) : config_(config) {}

  /// @return the object of each view, kNoSceneObject for one without points. An object is seen at
  /// most once by a keyframe.
  std::vector<SceneObjectId> step(std::span<const ThingView> views, const SE3& T_world_camera,
                                  Timestamp stamp);
  /// What the object was found to be the same as, by now; itself for most.
  [[nodiscard]] SceneObjectId current(SceneObjectId object) const;
  [[nodiscard]] const std::map<SceneObjectId, KnownObject>& objects() const { return objects_; }

 private:
  struct Cells {
    std::vector<std::uint64_t> keys;  // ascending
    Eigen::AlignedBox3d extent_world;
  };
  [[nodiscard]] Cells cells_of(const ThingView& view, const SE3& T_world_camera) const;
  /// How well the view fits the object; 0 if it does not.
  [[nodiscard]] double fit(const Detection& detection, const Cells& cells,
                           const KnownObject& object) const;
  [[nodiscard]] bool are_apart(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) const;
  void merge_with_equals(SceneObjectId id);

  ObjectMapConfig config_;
  std::map<SceneObjectId, KnownObject> objects_;
  std::map<SceneObjectId, SceneObjectId> merged_into_;
  std::uint16_t last_id_ = 0;
};

}  // namespace ygslam
