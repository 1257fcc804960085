// A world as its YAML file describes it, before anything is built.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "geometry/camera.hpp"
#include "simulation/world/camera_paths.hpp"
#include "simulation/world/rooms.hpp"

namespace ygslam::sim {

/// A thing that stands still.
struct FurnitureItem {
  std::string kind;  ///< see furniture_kinds()
  int variant = 0;
  Vec3 at = Vec3::Zero();  ///< [m] of its origin, world
  double yaw_deg = 0;      ///< 0 = front towards -y
  std::optional<Vec3f> size_m;
};

/// One station of a moving thing.
struct Waypoint {
  double t_s = 0;
  Vec3 at = Vec3::Zero();
  double yaw_deg = 0;
};

enum class MotionKind {
  kPath,   ///< from station to station, at rest before the first and after the last
  kRoll,   ///< the same, turning as a ball that rolls
  kHinge,  ///< stays at the first station's place and turns to each station's yaw
  kCarry,  ///< held in front of a person
  kPush,   ///< slid along the floor in front of a person
};

struct MoverPlan {
  std::string name;
  std::string class_name;  ///< default: the furniture kind
  FurnitureItem thing;
  MotionKind motion = MotionKind::kPath;
  std::vector<Waypoint> stations;
  std::string person;  ///< carry, push: by whom
  double from_s = 0;   ///< carry, push: where the thing rests before and after
  double until_s = 1e9;
};

enum class ActionKind { kWalk, kStand, kSit };

struct PersonAction {
  ActionKind kind = ActionKind::kStand;
  std::vector<Vec2> via;     ///< walk: points on the floor [m]
  double speed_mps = 1.1;    ///< walk
  double seconds = 2;        ///< stand, sit: how long
  Vec2 seat = Vec2::Zero();  ///< sit: middle of the seat
  double seat_m = 0.46;      ///< sit: height of the seat
  double yaw_deg = 0;        ///< stand, sit: where the person faces; 0 = +x
  std::string gesture;       ///< stand, sit: "", "talk", "wave", "point", "type", "drink", "phone"
};

inline constexpr int kBodies = 6;  ///< that are baked

struct PersonPlan {
  std::string name;
  int body = 0;                                 ///< 0 to kBodies - 1
  std::string top = "cloth", bottom = "jeans";  ///< materials
  int top_variant = 0, bottom_variant = 0, skin = 0, hair = 0;
  bool short_sleeves = true;
  bool shorts = false;
  Vec2 start = Vec2::Zero();
  double yaw_deg = 0;
  double delay_s = 0;  ///< before the first action
  bool repeat = true;  ///< after the last action walk back to the start and begin again
  std::vector<PersonAction> actions;
};

struct WorldConfig {
  std::string name;
  std::string description;
  double seconds = 10;
  double fps = 30;
  double ambient = 0.38;
  double exposure = 1.3;
  CameraConfig intrinsics{.fx = 535.4, .fy = 539.2, .cx = 320.1, .cy = 247.6};  // TUM fr3
  CameraPathConfig camera;
  std::vector<RoomPlan> rooms;
  std::vector<FurnitureItem> furniture;
  std::vector<MoverPlan> movers;
  std::vector<PersonPlan> people;
};

/// Reads a world from YAML text. @param source what to call it in messages. Layouts it names are
/// taken from the worlds that come with the project.
/// @return kInput with "file:line: ..." for a wrong key or value.
[[nodiscard]] Result<WorldConfig> parse_world(const std::string& yaml, const std::string& source);

/// A world by name or by file (*.yaml, *.yml). @return kUsage listing the known names if there is
/// no such world; kInput if the file cannot be read or is faulty.
[[nodiscard]] Result<WorldConfig> load_world(const std::string& name_or_file);

struct WorldName {
  std::string name;
  std::string description;
};
/// The worlds that come with the project, in alphabetical order.
[[nodiscard]] std::vector<WorldName> known_worlds();

}  // namespace ygslam::sim
