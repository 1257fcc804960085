#include "simulation/people/footsteps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "simulation/world/mover_motions.hpp"

namespace ygslam::sim {

namespace {
constexpr double kStep_s = 0.54;      // from one foot's landing to the other's
constexpr double kSwingShare = 0.80;  // of a step in which the foot is in the air
constexpr double kRollOff_s = 0.16;   // the heel rises before the foot leaves
constexpr double kRollOff_rad = 0.55;
}  // namespace

Footsteps::Footsteps(const Timeline& timeline, const FootShape& shape) : shape_(shape) {
  plan(timeline, 1);
  plan(timeline, -1);
}

void Footsteps::plan(const Timeline& timeline, int side) {
  std::vector<Stance>& stances = side > 0 ? left_ : right_;
  const auto home = [&](double t_s) {
    const Ground ground = timeline.ground(t_s);
    const Vec2 out(-std::sin(ground.yaw_rad), std::cos(ground.yaw_rad));
    return Stance{0, 0, ground.at + side * shape_.side_m * out, ground.yaw_rad, false};
  };
  Stance now = home(0);
  now.from_s = -std::numeric_limits<double>::infinity();
  for (const SteppingTime& time : timeline.stepping()) {
    // An even number of steps, so that each foot takes the same number; two more than needed to
    // end side by side.
    const double length_s = time.until_s - time.from_s;
    const int steps = 2 * std::max(1, static_cast<int>(std::lround(length_s / kStep_s / 2)));
    const double step_s = length_s / steps;
    for (int k = side > 0 ? 0 : 1; k < steps; k += 2) {
      const double begin_s = time.from_s + k * step_s + 0.5 * (1 - kSwingShare) * step_s;
      const double land_s = begin_s + kSwingShare * step_s;
      now.until_s = begin_s;
      now.rolls_off = true;
      stances.push_back(now);
      // The foot lands where it will carry the body in the middle of its stance.
      const bool last = k + 2 >= steps;
      const double middle_s = last ? time.until_s : land_s + 0.5 * (2 - kSwingShare) * step_s;
      now = home(std::min(middle_s, time.until_s - 1e-6));
      now.from_s = land_s;
    }
  }
  now.until_s = std::numeric_limits<double>::infinity();
  stances.push_back(now);
}

FootState Footsteps::planted(const Stance& stance, double local_s) const {
  FootState state;
  state.yaw_rad = stance.yaw_rad;
  if (stance.rolls_off) {
    state.pitch_rad = kRollOff_rad * ease((local_s - (stance.until_s - kRollOff_s)) / kRollOff_s);
  }
  const Mat3 R_yaw = so3_exp(Vec3(0, 0, stance.yaw_rad));
  const Vec3 p_flat(stance.at.x(), stance.at.y(), shape_.ankle_m);
  const Vec3 p_ball = p_flat + R_yaw * shape_.ball;
  state.p_ankle_world = p_ball - R_yaw * so3_exp(Vec3(0, state.pitch_rad, 0)) * shape_.ball;
  return state;
}

FootState Footsteps::foot(int side, double local_s) const {
  const std::vector<Stance>& stances = side > 0 ? left_ : right_;
  const auto next = std::find_if(stances.begin(), stances.end(),
                                 [&](const Stance& s) { return local_s < s.until_s; });
  const Stance& to = next == stances.end() ? stances.back() : *next;
  if (local_s >= to.from_s || next == stances.begin()) return planted(to, local_s);
  const Stance& from = *(next - 1);
  const FootState a = planted(from, from.until_s);
  const FootState b = planted(to, to.from_s);
  const double linear = (local_s - from.until_s) / (to.from_s - from.until_s);
  const double share = ease(linear);
  FootState state;
  state.planted = false;
  state.yaw_rad = a.yaw_rad + share * wrapped_angle(b.yaw_rad - a.yaw_rad);
  // Toes down at first, then up, then flat.
  state.pitch_rad = (1 - share) * a.pitch_rad - 0.22 * std::sin(std::numbers::pi * linear) * linear;
  state.p_ankle_world = a.p_ankle_world + share * (b.p_ankle_world - a.p_ankle_world);
  const double way_m = (b.p_ankle_world - a.p_ankle_world).head<2>().norm();
  state.p_ankle_world.z() +=
      (0.02 + 0.05 * std::min(1.0, way_m)) * std::sin(std::numbers::pi * linear);
  return state;
}

}  // namespace ygslam::sim
