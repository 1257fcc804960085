// Objects over time: what masks show and what is seen to move, each with a number that stays.
//
// A mask comes frames late. Its instances are associated with the tracks as they were in the mask's
// own frame; from there box and place are carried to the present along the flow of their points.
#pragma once

#include "objects/association.hpp"

namespace ygslam {

struct ObjectConfig {
  MovableClasses movable;  ///< objects at rest, too
  double keep_s = 10;      ///< an object out of sight is known again for so long
};

class ObjectTracker {
 public:
  /// @param camera must outlive it.
  ObjectTracker(ObjectConfig config, const Camera& camera)
      : config_(std::move(config)), camera_(camera) {}

  /// @return the confirmed objects known after this frame, oldest first.
  std::vector<TrackedObject> step(ObjectInput input);

  /// Per point of the last step 1 where it lies on an object that demonstrably stands still.
  [[nodiscard]] std::vector<std::uint8_t> resting_points() const;
  /// The last step's points can no longer be followed; objects wait to be seen again.
  void lose_points() { frames_.clear(); }

 private:
  void add_frame(ObjectInput input);
  void carry(const ObjectFrame& from, ObjectFrame& to) const;
  void take_mask(const Segmentation& masks);
  void see(const InstanceView& instance, const PointIndices& points_on, const GreyImage& ids,
           int key, ObjectFrame& frame);
  int add_track(int class_id, const Appearance& appearance, Timestamp stamp);
  void take_movers(ObjectFrame& now);
  [[nodiscard]] int track_of_group(const PointIndices& group, const ObjectFrame& now);
  [[nodiscard]] bool is_on_known(const ObjectPoint& point, const ObjectFrame& now) const;
  void update_tracks(ObjectFrame& now);
  void forget(Timestamp now);
  void drop_erased();

  ObjectConfig config_;
  const Camera& camera_;
  std::deque<ObjectFrame> frames_;  // newest last
  Tracks tracks_;
  FrameId newest_mask_ = kNoFrame;
  Timestamp mask_stamp_;  // its frame's
  int next_key_ = 0;
  std::uint32_t next_id_ = 0;
};

}  // namespace ygslam
