// What the dense map was given: its views, packed, with the keyframes they are tied to and their
// poses. Knows nothing of what became of them.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "dense/dense_frame.hpp"

namespace ygslam {

struct DenseView {
  std::shared_ptr<const StoredView> images;  ///< its objects are numbers of observations, from 1
  std::vector<ObjectObservation> observations;
  Timestamp stamp;
  std::optional<DenseAnchor> anchor = {};  ///< none: a keyframe
  std::optional<SE3> T_world_camera = {};  ///< none: it has no place in the world
};

class ViewStore {
 public:
  /// In the order in which they were taken.
  using Views = std::map<DenseViewId, DenseView>;

  [[nodiscard]] const Views& all() const { return views_; }
  [[nodiscard]] const DenseView& at(DenseViewId id) const { return views_.at(id); }
  [[nodiscard]] bool contains(DenseViewId id) const { return views_.contains(id); }

  /// A keyframe under its own number, a frame under the next one after its keyframe's.
  /// @return its number.
  DenseViewId add(KeyframeId keyframe, DenseView view);
  void remove(DenseViewId id) { views_.erase(id); }
  /// A keyframe that the map dropped, and frames that are tied to it, are tied to another.
  void reanchor(const RemovedAnchor& removed);
  /// Of keyframes; a view of another has no place. @return whether a view's pose changed.
  bool set_poses(const std::map<KeyframeId, SE3>& T_world_camera);

  void restore(const SavedView& saved);
  /// Those that have a place.
  [[nodiscard]] std::vector<SavedView> saved() const;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  Views views_;
};

}  // namespace ygslam
