// Objects over time: what masks show and what is seen to move, each with a number that stays.
//
// A mask comes frames late. Its instances are held against where the objects were in the mask's own
// frame; from there box and place are carried to the present along the flow of the points on them.
// Poses and places are in the odometry frame, which never jumps.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "core/ids.hpp"
#include "core/time.hpp"
#include "objects/instance_view.hpp"

namespace ygslam {

inline constexpr int kUnknownClass = -1;  ///< moves, but no network knows it

struct ObjectConfig {
  std::vector<int> movable_classes{0};  ///< COCO classes that are objects at rest too; 0 = person
  double keep_s = 10;                   ///< an object out of sight is known again for so long
};

/// What is known about one feature of the current frame.
struct ObjectPoint {
  Eigen::Vector2f uv_px = Eigen::Vector2f::Zero();
  float depth_m = 0;           ///< 0 = none
  Vec3 p_odom = Vec3::Zero();  ///< meaningful with depth
  std::int32_t previous = -1;  ///< point of the previous step that it surely continues, -1 = none
  bool moves = false;          ///< breaks the camera's motion
  bool stands = false;         ///< was judged and obeys it
};

struct ObjectInput {
  FrameId frame = kNoFrame;
  Timestamp stamp;
  SE3 T_camera_odom;
  std::vector<ObjectPoint> points;     ///< one per feature
  Thumbnail thumbnail;                 ///< of this frame
  std::vector<SegmentationPtr> masks;  ///< that came since the last step, of this or earlier frames
};

struct TrackedObject {
  ObjectId id = kNoObject;
  int class_id = kUnknownClass;
  int age_frames = 0;      ///< since it was first seen
  int missing_frames = 0;  ///< since a mask showed it or it was seen to move
  bool resting = false;    ///< demonstrably stands still
  int points = 0;          ///< features on it now
  PixelBox box_px;         ///< where it is seen in the image; empty while out of sight
  // In the odometry frame as step() returns them; whoever shows them to a user moves them to the
  // world.
  Vec3 centre_world = Vec3::Zero();  ///< median of its visible surface, or where its motion puts it
  Vec3 velocity_world_mps = Vec3::Zero();
  Vec3 min_world = Vec3::Zero();  ///< box about 90 % of its visible surface, along the axes
  Vec3 max_world = Vec3::Zero();
};

class ObjectTracker {
 public:
  /// @param camera must outlive it.
  ObjectTracker(ObjectConfig config, const Camera& camera)
      : config_(std::move(config)), camera_(camera) {}

  /// @return the objects known after this frame, oldest first; not those that too little confirms
  /// yet.
  std::vector<TrackedObject> step(ObjectInput input);

  /// Per point of the last step 1 where it lies on an object that demonstrably stands still.
  [[nodiscard]] std::vector<std::uint8_t> resting_points() const;
  /// The last step's points can no longer be followed; objects wait to be seen again.
  void lose_points() { views_.clear(); }
  void clear();

 private:
  using Members = std::vector<std::uint32_t>;  // points of one thing
  struct Place {
    PixelBox box;  // may reach beyond the image
    Vec3 centre_odom = Vec3::Zero();
  };
  // A frame, kept until its mask has come.
  struct View {
    ObjectInput in;
    std::vector<int> track_of;   // per point, key of tracks_, -1 = none
    std::map<int, Place> place;  // of every track known then
  };
  struct Move {
    double dt_s = 0;
    Vec3 moved_m = Vec3::Zero();
  };
  struct Track {
    TrackedObject object;
    Place place;
    Vec3 low_m = Vec3::Zero(), high_m = Vec3::Zero();  // of the box, from the centre
    Look look;
    Timestamp seen;             // when a mask showed it or it was seen to move
    double evidence = 0;        // masks by their scores, or frames of motion
    Vec3 way_m = Vec3::Zero();  // that its points came since its birth
    double path_m = 0;          // the same, without regard to direction
    int judged_frames = 0;
    double moving_share = 1;  // of its judged points, mean over about half a second
    std::deque<Move> moves;
  };

  [[nodiscard]] bool is_known(int key) const {
    return tracks_.at(key).object.class_id != kUnknownClass;
  }
  /// It may turn out to be one that was out of sight.
  [[nodiscard]] static bool is_young(const Track& track) { return track.object.age_frames < 30; }
  void carry(const View& from, View& to) const;
  [[nodiscard]] Place carried(int key, const Place& place, const View& from, const View& to,
                              std::span<const std::uint32_t> members) const;
  void take_mask(const Segmentation& masks);
  [[nodiscard]] std::vector<int> match(std::span<const InstanceView> seen,
                                       const std::vector<Members>& members, const View& view);
  void match_near(std::span<const InstanceView> seen, const std::vector<Members>& members,
                  const View& view, std::vector<int>& key_of) const;
  [[nodiscard]] double way(const InstanceView& seen, const Place& place, const Track& track,
                           Timestamp stamp) const;
  void match_lost(std::span<const InstanceView> seen, const View& view,
                  std::vector<int>& key_of) const;
  void update(const InstanceView& seen, const View& view, Place& place, Track& track) const;
  int add_track(int class_id, Timestamp stamp);
  void take_movers(View& now);
  [[nodiscard]] bool is_on_known(const ObjectPoint& point, const View& now) const;
  void update_tracks(View& now, double dt_s);
  void update_motion(const View& now, const Members& members, double dt_s, Track& track) const;
  void update_rest(const View& now, const Members& members, Track& track) const;
  void set_box(const View& now, Track& track) const;
  [[nodiscard]] bool is_present(const View& now, const Track& track) const;
  [[nodiscard]] bool is_confirmed(const Track& track) const;
  void forget(Timestamp now);
  void drop_erased();

  ObjectConfig config_;
  const Camera& camera_;
  std::deque<View> views_;       // newest last
  std::map<int, Track> tracks_;  // by a key that only grows; numbers are given when confirmed
  FrameId newest_mask_ = kNoFrame;
  Timestamp mask_stamp_;  // its frame's
  std::optional<Timestamp> stamp_;
  int next_key_ = 0;
  std::uint32_t next_id_ = 0;
};

}  // namespace ygslam
