// Objects over time: what a mask showed or what was seen to move keeps its identity from frame to
// frame, through missed detections, until nothing has confirmed it for a while.
//
// An object is a set of features. Where the flow takes them the object goes; a new mask's instance
// is the object most of its features were; failing that, the one whose motion puts it there.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "core/ids.hpp"
#include "core/time.hpp"
#include "geometry/se3.hpp"
#include "image/pixel_box.hpp"

namespace ygslam {

inline constexpr int kUnknownClass = -1;  ///< moves, but no network knows it

struct ObjectConfig {
  bool enabled = true;
  int keep_frames = 30;  ///< without mask or motion that confirms it: forgotten, and no later than
                         ///< after twice as many frames as have confirmed it
  int min_mask_points = 4;          ///< features a mask's instance needs to become an object
  int min_mover_points = 8;         ///< features that move together, without a mask
  int confirm_frames = 4;           ///< an object is shown once so many have confirmed it
  double group_radius_px = 25;      ///< moving points this near ...
  double group_depth_ratio = 0.08;  ///< ... and this alike in depth are one thing
  double gate_m = 0.5;  ///< an instance farther from where an object should be is another one
  double velocity_window_s = 0.5;
  double rest_moving_share = 0.1;  ///< fewer of its judged points move: it rests ...
  int rest_frames = 15;            ///< ... once that has held for so long
};

/// What is known about one feature of the current frame.
struct ObjectPoint {
  Eigen::Vector2f uv_px = Eigen::Vector2f::Zero();
  float depth_m = 0;             ///< 0 = none
  Vec3 p_world = Vec3::Zero();   ///< meaningful with depth
  std::int32_t previous = -1;    ///< point of the previous step that it surely continues, -1 = none
  std::uint64_t instance = 0;    ///< equal for the points of one instance of one mask, 0 = none
  int class_id = kUnknownClass;  ///< of that instance
  bool outside = false;          ///< seen outside every mask
  bool moves = false;            ///< breaks the camera's motion
  bool stands = false;           ///< was judged and obeys it
};

struct TrackedObject {
  ObjectId id = kNoObject;
  int class_id = kUnknownClass;
  int age_frames = 0;                ///< since it was first seen
  int missing_frames = 0;            ///< since a mask showed it or it was seen to move
  bool resting = false;              ///< demonstrably stands still
  int points = 0;                    ///< features on it now
  Vec3 centre_world = Vec3::Zero();  ///< median of its points, or where its motion puts it
  Vec3 velocity_world_mps = Vec3::Zero();
  Vec3 min_world = Vec3::Zero();  ///< box about 90 % of its visible points, along the world's axes
  Vec3 max_world = Vec3::Zero();
  PixelBox box_px;  ///< where it is seen in the image; empty if it is not
};

class ObjectTracker {
 public:
  explicit ObjectTracker(const ObjectConfig& config) : config_(config) {}

  /// @param points one per feature of the current frame.
  void step(Timestamp stamp, std::vector<ObjectPoint> points);

  /// Objects of the last step, oldest first, without those not confirmed yet.
  [[nodiscard]] std::vector<TrackedObject> objects() const;
  /// Object that a point of the last step lies on; nullptr if none.
  [[nodiscard]] const TrackedObject* object_at(std::size_t point) const;
  /// The last step's points can no longer be followed; objects wait to be seen again.
  void lose_points() { track_of_.clear(); }
  void clear();

 private:
  using Points = std::span<const ObjectPoint>;
  using Members = std::vector<std::uint32_t>;  // points of one thing
  struct Move {
    double dt_s = 0;
    Vec3 moved_m = Vec3::Zero();
  };
  struct Track {
    TrackedObject seen;
    int judged_frames = 0;    // that went into the share below
    double moving_share = 1;  // of its judged points, mean over about rest_frames
    std::deque<Move> moves;   // of the last velocity_window_s
    int confirmations = 0;    // frames in which a mask or motion did
  };

  [[nodiscard]] std::vector<std::int32_t> inherited(Points points) const;
  void take_instances(Points points, std::vector<std::int32_t>& track_of);
  void take_unknown_movers(Points points, std::vector<std::int32_t>& track_of);
  [[nodiscard]] std::int32_t match_instance(Points points, const Members& members, int class_id,
                                            std::span<const std::int32_t> track_of) const;
  std::int32_t add_track(int class_id);
  void update_tracks(Points points, std::span<const std::int32_t> track_of, double dt_s);
  void update_motion(Points points, const Members& members, double dt_s, Track& track) const;
  void update_rest(Points points, const Members& members, Track& track) const;
  void forget_old_tracks();

  ObjectConfig config_;
  std::vector<Track> tracks_;           // oldest first
  std::vector<std::int32_t> track_of_;  // per point of the last step, -1 = none
  std::vector<ObjectPoint> before_;     // the last step's points
  std::optional<Timestamp> stamp_;
  std::uint32_t next_id_ = 0;
};

}  // namespace ygslam
