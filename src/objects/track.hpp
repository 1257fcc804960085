// One object over time: where it is, how it moves and looks, and whether it is confirmed.
#pragma once

#include <deque>
#include <optional>

#include "objects/object_frame.hpp"
#include "objects/object_motion.hpp"

namespace ygslam {

inline constexpr int kPersonClass = 0;             ///< of COCO
inline constexpr int kUnknownClass = -1;           ///< moves, but no network knows it
inline constexpr std::size_t kMinTrackPoints = 4;  ///< that say how a thing moves

struct TrackedObject {
  ObjectId id = kNoObject;
  int class_id = kUnknownClass;
  int age_frames = 0;                ///< since it was first seen
  int missing_frames = 0;            ///< since a mask showed it or it was seen to move
  bool resting = false;              ///< demonstrably stands still
  bool faded = false;                ///< not confirmed for over a second: a memory of where it was
  int points = 0;                    ///< features on it now
  PixelBox box_px;                   ///< where it is seen in the image; empty while out of sight
  Vec3 centre_world = Vec3::Zero();  ///< median of its visible surface, or where its motion puts it
  Vec3 velocity_world_mps = Vec3::Zero();  ///< mean of half a second
  ObjectMotion body_world;        ///< filtered: place and velocity now, and what they will be
  Vec3 min_world = Vec3::Zero();  ///< box about 90 % of its visible surface, along the axes
  Vec3 max_world = Vec3::Zero();
};

/// The state of one track, places in the odometry frame.
struct Track {
  ObjectId id = kNoObject;  ///< once confirmed
  int class_id = kUnknownClass;
  Timestamp seen;  ///< when a mask showed it or it was seen to move
  int age_frames = 0;
  int missing_frames = 0;
  int points = 0;
  PixelBox box_px;
  TrackPlace place;
  Vec3 low_m = Vec3::Zero(), high_m = Vec3::Zero();  ///< corners of its box, from the centre
  Vec3 whole_low_m = Vec3::Zero(), whole_high_m = Vec3::Zero();  ///< the same while not hidden
  Vec3 velocity_odom_mps = Vec3::Zero();
  bool resting = false;
  Appearance appearance;

  /// Of a class the network knows.
  [[nodiscard]] bool is_known() const { return class_id != kUnknownClass; }
  /// It may turn out to be one that was out of sight.
  [[nodiscard]] bool is_young() const { return age_frames < 30; }
  [[nodiscard]] bool is_confirmed() const;
  [[nodiscard]] bool is_forgotten(Timestamp now, double keep_s) const;
  [[nodiscard]] TrackedObject in_world(const SE3& T_world_odom, Timestamp now) const;

  /// Its place one frame on: along the flow of its points, without enough of them along its
  /// velocity. @param on_it points of `to` that continue points on it.
  [[nodiscard]] TrackPlace carried(const TrackPlace& place, const ObjectFrame& from,
                                   const ObjectFrame& to, const PointIndices& on_it,
                                   const Camera& camera) const;
  /// A mask shows it in a frame. @param covered another track, which is nearer, hides a part of it.
  /// @param ids of the mask.
  void see(const InstanceView& instance, const ObjectFrame& frame, const GreyImage& ids,
           bool covered, TrackPlace& place_then);
  /// A mask does not show it. Where its place is in plain view that speaks against it.
  /// @param ids of the mask.
  void overlook(const ObjectFrame& frame, const TrackPlace& place_then, const GreyImage& ids);
  void see_motion(Timestamp now);
  /// The end of a frame. @param before the frame before, null = none.
  /// @param masks_seen stamp of the newest frame whose mask has come.
  void update(const ObjectFrame& now, const ObjectFrame* before, const PointIndices& on_it,
              Timestamp masks_seen, const Camera& camera, TrackPlace& place_now);

 private:
  struct Move {
    double dt_s = 0;
    Vec3 moved_m = Vec3::Zero();
  };
  void remember_whole(const Vec3& low, const Vec3& high);
  void measure(const ObjectFrame& now, const PointIndices& on_it, TrackPlace& place_now);
  void update_rest(const ObjectFrame& now, const PointIndices& on_it);
  void update_velocity(const ObjectFrame& now, const ObjectFrame* before,
                       const PointIndices& on_it);
  [[nodiscard]] ObjectMotion body() const;
  void update_motion(const ObjectFrame& now, const ObjectFrame* before, bool is_measured);
  void update_box(const ObjectFrame& now, Timestamp masks_seen, const Camera& camera);
  [[nodiscard]] bool is_present(const ObjectFrame& now) const;

  MotionFilter filter_;
  bool is_new_ = false;                    // its place was measured since the last update
  double evidence_ = 0;                    // masks by their scores, or frames of motion
  Vec3 way_m_ = Vec3::Zero();              // that its points came since its birth
  double path_m_ = 0;                      // the same, without regard to direction
  std::deque<Move> moves_;                 // of the last kVelocityWindow_s
  std::optional<Vec3> first_centre_odom_;  // of what no mask shows
  int judged_frames_ = 0;
  double moving_share_ = 1;  // of its judged points, mean over about half a second
};

}  // namespace ygslam
