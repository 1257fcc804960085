// What a person does when: walks along curves, turns, stands, sits. Everything is a pure function
// of time, made once from the person's plan.
#pragma once

#include <string>
#include <vector>

#include "simulation/world/world_config.hpp"

namespace ygslam::sim {

/// Where the body is on the floor and where it faces.
struct Ground {
  Vec2 at = Vec2::Zero();  ///< [m], world
  double yaw_rad = 0;      ///< 0 = facing +x
};

/// A time in which the feet take steps.
struct SteppingTime {
  double from_s, until_s;
};

struct SitState {
  double share = 0;  ///< 0 stands .. 1 sits
  Vec2 seat = Vec2::Zero();
  double seat_m = 0.46;
};

struct GestureState {
  std::string name;
  double strength = 0;  ///< 0..1, eased
};

class Timeline {
 public:
  /// @param seat_distance_m from the middle of a seat to where the feet of a sitter stand.
  Timeline(const PersonPlan& plan, double seat_distance_m);

  /// Time within the plan: repeats if the plan does. Everything below takes such a time.
  [[nodiscard]] double local_time(double t_s) const;
  [[nodiscard]] Ground ground(double local_s) const;
  [[nodiscard]] SitState sitting(double local_s) const;
  [[nodiscard]] GestureState gesture(double local_s) const;
  [[nodiscard]] const std::vector<SteppingTime>& stepping() const { return stepping_; }
  [[nodiscard]] double duration_s() const { return end_s_; }

 private:
  struct Phase {
    enum class Kind { kWalk, kTurn, kStand, kSit } kind = Kind::kStand;
    double from_s = 0, until_s = 0;
    Ground from, until;
    std::vector<Vec2> curve;    // walk
    std::vector<double> arc_m;  // walk: length up to each sample
    double speed_mps = 1;       // walk
    PersonAction action;        // stand, sit
    bool begins_seated = false, ends_seated = false;
  };
  void add_walk(const std::vector<Vec2>& via, double speed_mps);
  void add_turn(double yaw_rad);
  void add_stand(const PersonAction& action);
  void add_sit(const PersonAction& action, double seat_distance_m, bool begins_seated,
               bool ends_seated);
  void join_stepping();
  [[nodiscard]] const Phase& phase_at(double local_s) const;

  std::vector<Phase> phases_;
  std::vector<SteppingTime> stepping_;
  Ground now_;  // while the plan is compiled
  double end_s_ = 0;
  double delay_s_ = 0;
  bool repeat_ = true;
};

/// The angle in (-pi, pi].
[[nodiscard]] double wrapped_angle(double rad);

}  // namespace ygslam::sim
