// YG-SLAM as a library: one RGB-D frame in, one result out.
//
//   ygslam::api::Settings settings;
//   settings.camera = {.fx = 535.4, .fy = 539.2, .cx = 320.1, .cy = 247.6};
//   auto slam = ygslam::api::Slam::open(settings);  // throws ygslam::api::Error
//   ygslam::api::Result r = slam.process({t_ns, rgb, depth_m});
//
// A robot asks on: r.covariance, r.events; slam.room() for free space, mesh and objects while it
// runs; slam.push() where it must not wait.
//
// This header needs the standard library only. Objects may be used from one thread at a time;
// several may live side by side. A child made by fork() cannot use its parent's objects (Error, 2);
// to destroy one there does nothing.
//
// What it does to the program it lives in: it starts no process, writes no file and nothing to
// standard output, sets no signal handler and changes no global setting. Every failure is an Error,
// bugs and want of memory included. Threads: unless deterministic, each object has one that maps,
// one for the dense map, at times one that adjusts the whole map, with a model one that segments,
// and with push() one that processes; the network runs on `segment.threads` threads (default 1).
// A few image operations are OpenCV's, whose own pool follows the program's cv::setNumThreads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#if defined(_WIN32)
#define YGSLAM_API
#else
#define YGSLAM_API __attribute__((visibility("default")))
#endif

namespace ygslam::api {

/// T_target_source: rotation as unit quaternion (x, y, z, w), translation [m].
struct Pose {
  std::array<double, 3> translation_m{0, 0, 0};
  std::array<double, 4> rotation_xyzw{0, 0, 0, 1};
};

/// Pinhole camera with Brown-Conrady distortion, as in OpenCV; a pixel's centre is an integer.
struct CameraModel {
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< [px]
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  int width = 640, height = 480;  ///< [px]
  // A rolling shutter (docs/camera.md); < 0 = the last row first. All 0: taken as global until the
  // pictures tell otherwise, unless shutter_known says that they need not.
  double colour_readout_ms = 0;  ///< from the first row of the colour image to the last
  double depth_readout_ms = 0;   ///< the same of the depth image
  double depth_delay_ms = 0;     ///< middle of the depth image after that of the colour image
  bool shutter_known = false;    ///< the three times are right even where they are 0
  /// kinect_v1, realsense_d455, ... (docs/camera.md): its times, where they are not given above.
  std::string device{};
  /// Pixels that are not of the world, as the robot itself or text in the image: {x, y, width,
  /// height} each. What is fixed to the camera is found without them, too, once it has moved.
  std::vector<std::array<int, 4>> ignore{};
  /// The same as an image: 8-bit grey PNG of the camera's size, not 0 = ignored; empty = none.
  std::string ignore_image{};
  /// The three times are a guess, from which the estimate starts where they are not 0; then
  /// shutter_known counts as false.
  bool shutter_guessed = false;
  /// A device that it may be: its times are taken once the pictures show that the rows roll.
  std::string likely_device{};
  /// Who told of the times, for messages, as "calibration.txt"; empty: the caller.
  std::string shutter_source{};
};

/// A camera that takes the depth images, where they are not registered to the colour image.
struct DepthCamera {
  CameraModel camera;   ///< of Frame's depth images, size included; no shutter
  Pose T_colour_depth;  ///< from its optical frame to that of the colour camera
};

/// In the world, which is the first camera or that of a loaded map.
struct Floor {
  std::array<double, 3> up_world{0, -1, 0};  ///< 1e-6 to 1e6 long; the first camera's y is down
  double floor_m = 0;                        ///< height of the floor along it
};

/// An IMU that is fixed to the camera (docs/inertial.md). Of the noise the data sheet tells, of its
/// place the camera's maker.
struct YGSLAM_API Imu {
  Pose T_camera_imu;                        ///< from its frame to the colour camera's optical frame
  double rate_hz = 200;                     ///< about
  double gyro_noise_radps_sqrthz = 2.4e-4;  ///< white noise, density
  double accel_noise_mps2_sqrthz = 1.2e-3;
  double gyro_walk_radps2_sqrthz = 2e-5;  ///< random walk of the bias, density
  double accel_walk_mps3_sqrthz = 3e-4;
  /// A stamp of the IMU less the camera's of the same instant; nothing: it is found.
  std::optional<double> time_offset_s{};

  /// An imu.yaml (docs/inertial.md). @throws Error (4) if it cannot be read, (3) for what is in it.
  static Imu read(const std::string& path);
};

/// A robot that carries the camera on wheels, and tells where its odometry has it
/// (docs/inertial.md).
struct YGSLAM_API Wheels {
  Pose T_base_camera;       ///< from the colour camera's optical frame to the base: x ahead, z up
  double way_scale = 1;     ///< true way for a told one: the wheels' radius
  double turn_scale = 1;    ///< true turn for a told one: the distance between the wheels
  double way_noise = 2e-3;  ///< of the way [m/sqrt(m)]
  double turn_noise =
      6e-3;  ///< of the heading [rad/sqrt(m)], and as much for each root of a radian
  double time_offset_s = 0;  ///< a stamp of the wheels less the camera's of the same instant

  /// An odom.yaml (docs/inertial.md). @throws Error (4) if it cannot be read, (3) for what is in
  /// it.
  static Wheels read(const std::string& path);
};

struct Result;

enum class LogLevel { kInfo, kWarning, kError };

struct Settings {
  CameraModel camera;
  /// Segmentation network (.onnx or .xml, docs/models.md); empty = geometry alone. Read in this
  /// process: a file made to crash its reader will.
  std::string model;
  /// model, builtin (the built-in network that knows people), none, masks:DIR (docs/models.md),
  /// frames (Frame::instances); empty: the model, or without one the built-in network.
  std::string segmenter;
  /// off, geometry, semantic, full; empty: the option dynamic.mode, else full where there are
  /// masks, else geometry.
  std::string dynamic;
  /// Map of an earlier run (save_map(), `ygslam run --save-map`) to go on with; empty = none.
  /// Frames are lost until the place is recognised.
  std::string load_map;
  bool localize_only = false;  ///< the loaded map stays as it is
  bool deterministic = false;  ///< one schedule without threads: same input, same result
  /// False: finish() gives no trajectory, and nothing grows with time but the map. It takes 96
  /// bytes a frame.
  bool keep_trajectory = true;
  /// Where a page shows the run (docs/live.md): ADDRESS:PORT, e.g. 127.0.0.1:8765, port 0 = any;
  /// empty = nowhere. Those who look on cannot drive it. One thread more, nothing written.
  std::string view;
  std::map<std::string, std::string> options;  ///< any key of `ygslam config`
  /// Takes the log's lines in place of standard error, which gets warnings and errors only. Called
  /// by the object's threads, too, one line at a time or several; what it throws is ignored.
  std::function<void(LogLevel, const std::string&)> log;
  std::optional<DepthCamera> depth_camera;  ///< none: depth is registered to the colour image
  /// How often at most room() is renewed while frames come; it takes the dense map's thread no more
  /// than a tenth of its time. 0: as often as that allows.
  double room_every_s = 1;
  /// Where the floor of plan() is, where that is known: of a robot whose camera was measured. Else
  /// it is found.
  std::optional<Floor> floor;
  std::optional<Imu> imu;        ///< that push_imu() takes the readings of
  std::optional<Wheels> wheels;  ///< that push_odometry() takes the poses of
  /// Takes the results of push() in place of poll(), in the thread that processes; it may not call
  /// the object, and what it throws is ignored.
  std::function<void(const Result&)> on_result;
};

// --- What comes in ----------------------------------------------------------------------------

enum class ColourOrder { kRgb, kBgr, kMono };  ///< 3, 3, 1 bytes a pixel

/// A person or a thing in an image, found by whoever looked.
struct Instance {
  std::string class_name = "person";  ///< COCO's
  float score = 1;                    ///< 0 to 1
};

/// Images row-major. Pointers are read during the call only.
struct Frame {
  /// Strictly increasing; as depth_t_ns within 146 years of 0. A stamp that goes back is refused
  /// (code 4), until five in a row agree, or reset() was called: then the clock was set back, and
  /// time goes on from the stamps before (Result::clock_shift_ns).
  std::int64_t t_ns = 0;
  const std::uint8_t* rgb = nullptr;  ///< height x width x 3, or as `colour` says
  const float* depth_m =
      nullptr;  ///< height x width, along the optical axis; 0, NaN, negative = none
  /// When the depth image was taken, for a rolling shutter; 0 = with the colour image.
  std::int64_t depth_t_ns = 0;
  ColourOrder colour = ColourOrder::kRgb;
  const std::uint16_t* depth_raw = nullptr;  ///< in place of depth_m; 0 = none
  double depth_scale = 0;                    ///< of depth_raw: units per metre
  /// Bytes from row to row; 0 = rows are contiguous.
  std::size_t colour_stride = 0, depth_stride = 0, instance_stride = 0;
  /// Masks of one's own, with Settings::segmenter "frames": height x width, 0 = none, i =
  /// instances[i - 1]. Null: nobody looked.
  const std::uint8_t* instance_ids = nullptr;
  std::vector<Instance> instances{};  ///< at most 255
  /// Odometry: where this camera is in that of the frame before. A start for the search, no more;
  /// where an IMU or wheels predict the motion, that is taken.
  std::optional<Pose> T_last_camera{};
};

/// In the IMU's own frame.
struct ImuReading {
  std::int64_t t_ns = 0;  ///< of the clock of Frame::t_ns
  std::array<double, 3> angular_velocity_radps{0, 0, 0};
  std::array<double, 3> specific_force_mps2{0, 0, 0};  ///< at rest 9.81 upwards
};

/// Where a robot's odometry has its base.
struct OdometryReading {
  std::int64_t t_ns = 0;  ///< of the clock of Frame::t_ns
  Pose T_odom_base;
};

// --- What is known of a frame ---------------------------------------------------------------

enum class State {
  kWaiting,
  kTracking,
  kWeak,  ///< a pose, but few points agree on it
  kLost,
  kCoasting,  ///< by IMU (8 s at most) or wheels (30 s): no pose is seen, or one that the IMU
              ///< contradicts
};

/// What happened since the result before.
enum class Event {
  kLost,
  kRelocalised,    ///< a place again after being lost
  kKeyframe,       ///< the frame becomes part of the map
  kLoopClosed,     ///< a place was seen again: the map was corrected
  kMapSaved,       ///< by save_map()
  kCameraLearned,  ///< the times of a rolling shutter
};

/// Where somebody is or will be.
struct Forecast {
  std::array<double, 3> position_world_m{0, 0, 0};
  std::array<double, 9> covariance_m2{};  ///< 3 x 3 row-major, axes of the world
};

/// A person or another thing that moves or could, followed over time.
struct YGSLAM_API Object {
  std::uint32_t id = 0;    ///< never given twice
  std::string class_name;  ///< COCO, or "unknown": moves, but no network knows it
  int age_frames = 0;
  int missing_frames = 0;  ///< since it was last confirmed
  bool resting = false;    ///< demonstrably stands still
  bool faded = false;      ///< not confirmed for over a second: a memory of where it was
  std::array<double, 3> centre_world_m{0, 0, 0};
  std::array<double, 3> velocity_world_mps{0, 0, 0};  ///< mean of half a second
  std::array<double, 3> min_world_m{0, 0, 0};         ///< box about what is visible of it
  std::array<double, 3> max_world_m{0, 0, 0};
  /// Filtered: the middle of a person, of other things that of what is seen; its velocity; and of
  /// both the covariance [m, m/s], 6 x 6 row-major. It grows while nobody sees the object.
  std::array<double, 3> body_world_m{0, 0, 0};
  std::array<double, 3> body_velocity_world_mps{0, 0, 0};
  std::array<double, 36> body_covariance{};

  /// Where it will be: people go on, turn and stop (docs/moving-things.md). 0 = now; a few seconds
  /// ahead it says little. Negative or not finite: Error.
  [[nodiscard]] Forecast after(double seconds) const;
};

/// What a frame took [ms], of the wall clock.
struct StageTimes {
  double masks = 0;     ///< the network, or waiting for it
  double features = 0;  ///< finding corners
  double motion = 0;    ///< what of them moves
  double pose = 0;      ///< the camera's, and the objects'
  double all = 0;       ///< from the copied frame to the result
};

struct Result {
  State state = State::kWaiting;
  Pose T_world_camera;  ///< world = first tracked camera, or that of the loaded map; meaningful
                        ///< while tracking, weak or coasting
  /// The same in a frame that drifts but never jumps (odom of ROS REP 105): corrections of the map
  /// and relocalisation change T_world_odom instead. While lost it stays where it was.
  Pose T_odom_camera;
  /// The pose was found by what the camera sees alone, far from where odometry left it (after being
  /// lost, or in a loaded map): another room may look the same. Until it has gone 8 m from there.
  bool provisional = false;
  Pose T_world_odom;  ///< T_world_camera = T_world_odom * T_odom_camera, unless lost
  /// Of T_odom_camera, 6 x 6 row-major: x, y, z [m2], then rotations about the axes of odom [rad2],
  /// with what odom has drifted since the run began. 0 of the first frame; wider while weak or
  /// coasting; 1e6 on the diagonal while lost or unknown.
  std::array<double, 36> covariance{};
  /// The same of T_world_camera, in axes of the world: with what the map has drifted to where the
  /// camera is. Smaller again once it sees ground that was mapped earlier.
  std::array<double, 36> map_covariance{};
  /// As covariance, against the ground that the frame shows alone, while coasting against where
  /// that began: of the motion between two frames soon after each other it is the sum of both.
  std::array<double, 36> seen_covariance{};
  std::vector<Event> events;
  StageTimes times_ms;
  std::int64_t t_ns = 0;   ///< the frame's, as it came
  int dropped_frames = 0;  ///< by push(), so far
  int static_points = 0, dynamic_points = 0, unknown_points = 0;
  int inliers = 0;           ///< points that agree with the pose
  int mask_age_frames = -1;  ///< of the newest mask used; -1 = none
  std::vector<Object> objects;
  std::int64_t clock_shift_ns = 0;  ///< added to stamps since the clock was set back
};

struct StampedPose {
  std::int64_t t_ns = 0;  ///< with Result::clock_shift_ns
  Pose T_world_camera;
};

struct MapPoint {
  float x_m, y_m, z_m;
  std::uint8_t r, g, b;
};

struct Outcome {
  std::vector<StampedPose> trajectory;  ///< corrected by what the map learned later; if kept
  std::vector<MapPoint> static_map;
};

// --- The map while it runs -------------------------------------------------------------------

/// A list that nobody changes any more: copies share it.
template <typename T>
class SharedList {
 public:
  SharedList() : SharedList(std::vector<T>()) {}
  explicit SharedList(std::vector<T> list)
      : list_(std::make_shared<const std::vector<T>>(std::move(list))) {}
  operator const std::vector<T>&() const { return *list_; }  // NOLINT: it is one
  const T& operator[](std::size_t i) const { return (*list_)[i]; }
  [[nodiscard]] std::size_t size() const { return list_->size(); }
  [[nodiscard]] bool empty() const { return list_->empty(); }
  [[nodiscard]] const T* data() const { return list_->data(); }
  [[nodiscard]] auto begin() const { return list_->begin(); }
  [[nodiscard]] auto end() const { return list_->end(); }

 private:
  std::shared_ptr<const std::vector<T>> list_;
};

/// The map as it is in the middle of a run.
struct MapSnapshot {
  SharedList<StampedPose> keyframes;
  SharedList<std::array<float, 3>> landmarks_world_m;  ///< in no particular order
  SharedList<MapPoint> static_map;                     ///< Room::mesh()'s vertices
};

/// Triangles' corners turn counter-clockwise, seen from outside.
struct Mesh {
  SharedList<MapPoint> vertices;
  SharedList<std::array<float, 3>> normals;  ///< of the vertices, unit length, in the world
  SharedList<std::array<std::uint32_t, 3>> triangles;
};

/// An object that stands in the room.
struct StaticObject {
  int id = 0;
  std::string class_name;  ///< COCO, or "unknown"
  double probability = 0;  ///< of the class
  std::string state;       ///< candidate, static, moving, settled, absent, unobserved
  Pose T_world_box;        ///< the middle of its box, whose z axis is up
  std::array<double, 3> size_m{0, 0, 0};
  int views = 0;  ///< keyframes that showed it
  std::int64_t first_seen_ns = 0, last_seen_ns = 0;
};

/// A ground plan in the floor's frame (z up, floor at 0), as nav_msgs/OccupancyGrid.
struct OccupancyGrid {
  int width = 0, height = 0;
  double resolution_m = 0;
  std::array<double, 2> origin_m{0, 0};  ///< lower left corner of the first cell
  std::vector<std::int8_t> cells;        ///< row 0 has the smallest y; -1 unknown, 0 free, 100 not
  Pose T_world_floor;
  std::int64_t t_ns = 0;  ///< newest image in it; 0 = none
};

enum class Space { kUnknown, kFree, kOccupied };

struct RayHit {
  Space what = Space::kFree;  ///< kFree: nothing in its way
  double distance_m = 0;      ///< to the cell in its way, else the whole length
};

/// The static room as it was at one time, people left out; nobody changes it any more. Copies share
/// it, any thread may use it. Points are in the world [m].
class YGSLAM_API Room {
 public:
  Room();                                   ///< nothing known
  [[nodiscard]] std::int64_t t_ns() const;  ///< newest image in it; 0 = none
  [[nodiscard]] const Mesh& mesh() const;
  [[nodiscard]] const std::vector<StaticObject>& objects() const;
  [[nodiscard]] std::array<double, 3> up_world() const;  ///< unit length
  [[nodiscard]] double floor_m() const;                  ///< height of the floor along it
  [[nodiscard]] Pose T_world_floor() const;
  [[nodiscard]] double cell_m() const;  ///< of at(), box(), ray()

  /// Occupied: something stands between these heights above the floor; free: the floor or the air
  /// just above it was seen, and nothing stands there. For .1 to 1.5 m at once, else tens of
  /// milliseconds once. @throws Error (4): heights not finite or not ascending, plan too large.
  [[nodiscard]] OccupancyGrid occupancy(double min_m = 0.10, double max_m = 1.50) const;
  /// @throws Error (4), as the two below: not finite, a box of negative size or more than 10^8
  /// cells, no direction, more than 1 km.
  [[nodiscard]] Space at(const std::array<double, 3>& p_world) const;
  /// Occupied if anything in it is, else unknown if anything is.
  [[nodiscard]] Space box(const std::array<double, 3>& min_world,
                          const std::array<double, 3>& max_world) const;
  /// To the first cell that is occupied or, unless past_unknown, unknown.
  [[nodiscard]] RayHit ray(const std::array<double, 3>& from_world,
                           const std::array<double, 3>& direction_world, double max_m = 10,
                           bool past_unknown = false) const;

  struct Impl;
  explicit Room(std::shared_ptr<const Impl> impl);

 private:
  std::shared_ptr<const Impl> impl_;
};

/// What went wrong in one line; `code` as the exit codes of the command line: 1 a bug or out of
/// memory (the object is of no further use), 2 used after finish() or moved from, 3 settings or
/// camera (all faults of the settings at once), 4 input, 5 model, 6 map file, 9 not written.
class YGSLAM_API Error : public std::runtime_error {
 public:
  Error(int error_code, const std::string& message)
      : std::runtime_error(message), code(error_code) {}
  int code;
};

class YGSLAM_API Slam {
 public:
  /// @throws Error (3, 5, 6, 1; 2 where nothing can listen at Settings::view)
  static Slam open(const Settings& settings);
  Slam(Slam&&) noexcept;
  Slam& operator=(Slam&&) noexcept;
  ~Slam();

  /// @throws Error (4) if a pointer is null, the stamp does not increase or is too far from 0 (the
  /// frame is left out), (2) after finish(), (1) also for what failed in another thread since.
  Result process(const Frame& frame);
  /// The same without waiting: the frame is copied, and processed by a thread of its own. While
  /// that is busy one frame waits, and a newer one takes its place (Result::dropped_frames). No
  /// more process() then. @throws Error as process(); (1) also for what failed in that thread.
  void push(const Frame& frame);
  /// A reading of Settings::imu, in order of time, best before the frame that is as old: a frame
  /// does not wait for them. Any thread may call it, at any time between open() and the end; it
  /// waits for nothing that is slow. @throws Error (4) if it is not finite or its stamp too far
  /// from 0, (2) without Settings::imu
  void push_imu(const ImuReading& reading);
  /// The same of Settings::wheels. @throws Error (4) for what is no pose or too far from 0, (2)
  /// without Settings::wheels
  void push_odometry(const OdometryReading& reading);
  /// The next result of what was pushed, oldest first, if there is one; the last 64 are kept.
  /// @throws Error (1, 2)
  std::optional<Result> poll();
  /// Where in the map the frame was taken, by what it shows alone; nothing else changes. Takes
  /// its time: the map is copied. Masks are not looked at. @return T_world_camera; nothing where no
  /// place is recognised. @throws Error (4, 1, 2)
  std::optional<Pose> localise_now(const Frame& frame);
  /// Of the page, with the token that other machines need; empty = none. @throws Error (2)
  [[nodiscard]] std::string view_url() const;
  /// The map as it was published last, at once; its static_map is room()'s. @throws Error (1, 2)
  MapSnapshot map();
  /// The static room as it was published last, at once. If deterministic, and after finish(), it is
  /// that of now, which takes its time once a frame. @throws Error (1, 2)
  Room room();
  /// The ground plan for a robot that drives now, as it was published last, at once: made anew with
  /// each keyframe, with masks also twice a second where the camera stands. Occupied: something
  /// stands between the options dense.plan_low_m and dense.plan_high_m above the floor. Free: the
  /// floor or the air just above it was seen, and of the heights between them no 5 cm are unseen.
  /// People are left out, and what the last views saw through is free, however long it stood there;
  /// what a view shows that a correction moves stands until it is seen through again. Empty as long
  /// as no floor is known. t_ns is with Result::clock_shift_ns. Never to be changed. If
  /// deterministic, and after finish(), that of now. @throws Error (1, 2)
  std::shared_ptr<const OccupancyGrid> plan();
  /// Writes the map as it is now to a file, whole or not at all. @throws Error (9, 1, 2)
  void save_map(const std::string& path);
  /// Forgets everything but settings and network; the next frame starts a new world, or is placed
  /// in the loaded map. Stamps go on increasing. @throws Error (1, 2)
  void reset();
  /// Ends the run. May be called again: the outcome is the same. @throws Error (1, 2)
  Outcome finish();

 private:
  struct Impl;
  explicit Slam(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace ygslam::api
