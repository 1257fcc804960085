#include "simulation/people/timeline.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulation/world/mover_motions.hpp"

namespace ygslam::sim {

namespace {

constexpr double kSitting_s = 1.4;     // to sit down, and to rise
constexpr double kEase_s = 0.6;        // to begin and to end a gesture
constexpr double kAcceleration = 1.6;  // [m/s^2]
constexpr double kPi = std::numbers::pi;

Vec2 catmull_rom(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d, double t) {
  return 0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t * t +
                (3 * b - a - 3 * c + d) * t * t * t);
}

/// Way covered after a time with steady acceleration up to a speed, and down again before the end.
double way_at(double t_s, double length_m, double speed_mps) {
  double ramp_s = speed_mps / kAcceleration;
  if (length_m < speed_mps * ramp_s) {  // too short to get up to speed
    ramp_s = std::sqrt(length_m / kAcceleration);
    speed_mps = kAcceleration * ramp_s;
  }
  const double total_s = length_m / speed_mps + ramp_s;
  t_s = std::clamp(t_s, 0.0, total_s);
  if (t_s < ramp_s) return 0.5 * kAcceleration * t_s * t_s;
  if (t_s > total_s - ramp_s)
    return length_m - 0.5 * kAcceleration * (total_s - t_s) * (total_s - t_s);
  return speed_mps * (t_s - 0.5 * ramp_s);
}

double walk_duration(double length_m, double speed_mps) {
  const double ramp_s = speed_mps / kAcceleration;
  if (length_m < speed_mps * ramp_s) return 2 * std::sqrt(length_m / kAcceleration);
  return length_m / speed_mps + ramp_s;
}

}  // namespace

double wrapped_angle(double rad) { return std::remainder(rad, 2 * kPi); }

Timeline::Timeline(const PersonPlan& plan, double seat_distance_m)
    : delay_s_(plan.delay_s), repeat_(plan.repeat) {
  now_ = {plan.start, plan.yaw_deg * kPi / 180};
  const bool seated_first = !plan.actions.empty() && plan.actions.front().kind == ActionKind::kSit;
  if (seated_first) {
    const PersonAction& sit = plan.actions.front();
    now_.yaw_rad = sit.yaw_deg * kPi / 180;
    now_.at = sit.seat + seat_distance_m * Vec2(std::cos(now_.yaw_rad), std::sin(now_.yaw_rad));
  }
  const Ground start = now_;
  const bool only_sits = plan.actions.size() == 1 && seated_first;
  for (std::size_t i = 0; i < plan.actions.size(); ++i) {
    const PersonAction& action = plan.actions[i];
    switch (action.kind) {
      case ActionKind::kWalk:
        add_walk(action.via, action.speed_mps);
        break;
      case ActionKind::kStand:
        add_turn(action.yaw_deg * kPi / 180);
        add_stand(action);
        break;
      case ActionKind::kSit:
        add_sit(action, seat_distance_m, i == 0, only_sits);
        break;
    }
  }
  if (repeat_ && !only_sits) {
    if ((start.at - now_.at).norm() > 0.02) add_walk({start.at}, 1.0);
    add_turn(start.yaw_rad);
    if (seated_first) {
      PersonAction down = plan.actions.front();
      down.seconds = 0;
      add_sit(down, seat_distance_m, false, true);
    }
  }
  if (phases_.empty()) {
    PersonAction idle;
    idle.seconds = 10;
    add_stand(idle);
  }
  join_stepping();
}

void Timeline::add_turn(double yaw_rad) {
  const double angle = wrapped_angle(yaw_rad - now_.yaw_rad);
  if (std::abs(angle) < 0.05) return;
  Phase phase;
  phase.kind = Phase::Kind::kTurn;
  phase.from_s = end_s_;
  phase.until_s = end_s_ + 0.35 + std::abs(angle) / 2.4;
  phase.from = now_;
  now_.yaw_rad += angle;
  phase.until = now_;
  end_s_ = phase.until_s;
  stepping_.push_back({phase.from_s, phase.until_s});
  phases_.push_back(std::move(phase));
}

void Timeline::add_walk(const std::vector<Vec2>& via, double speed_mps) {
  std::vector<Vec2> points = {now_.at};
  for (const Vec2& p : via) {
    if ((p - points.back()).norm() > 1e-3) points.push_back(p);
  }
  if (points.size() < 2) return;
  Phase phase;
  phase.kind = Phase::Kind::kWalk;
  const auto at = [&](std::size_t i, int offset) {
    const auto k = static_cast<long>(i) + offset;
    return points[static_cast<std::size_t>(
        std::clamp(k, 0L, static_cast<long>(points.size()) - 1))];
  };
  constexpr int kSamples = 48;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    for (int k = 0; k < kSamples; ++k) {
      phase.curve.push_back(
          catmull_rom(at(i, -1), at(i, 0), at(i, 1), at(i, 2), static_cast<double>(k) / kSamples));
    }
  }
  phase.curve.push_back(points.back());
  phase.arc_m.push_back(0);
  for (std::size_t i = 1; i < phase.curve.size(); ++i) {
    phase.arc_m.push_back(phase.arc_m.back() + (phase.curve[i] - phase.curve[i - 1]).norm());
  }
  const Vec2 first = phase.curve[1] - phase.curve[0];
  add_turn(std::atan2(first.y(), first.x()));
  phase.from = now_;
  phase.speed_mps = speed_mps;
  phase.from_s = end_s_;
  phase.until_s = end_s_ + walk_duration(phase.arc_m.back(), speed_mps);
  const Vec2 last = phase.curve.back() - phase.curve[phase.curve.size() - 2];
  now_ = {points.back(), std::atan2(last.y(), last.x())};
  phase.until = now_;
  end_s_ = phase.until_s;
  stepping_.push_back({phase.from_s, phase.until_s});
  phases_.push_back(std::move(phase));
}

void Timeline::add_stand(const PersonAction& action) {
  Phase phase;
  phase.kind = Phase::Kind::kStand;
  phase.from_s = end_s_;
  phase.until_s = end_s_ + std::max(0.1, action.seconds);
  phase.from = phase.until = now_;
  phase.action = action;
  end_s_ = phase.until_s;
  phases_.push_back(std::move(phase));
}

void Timeline::add_sit(const PersonAction& action, double seat_distance_m, bool begins_seated,
                       bool ends_seated) {
  const double yaw = action.yaw_deg * kPi / 180;
  const Vec2 feet = action.seat + seat_distance_m * Vec2(std::cos(yaw), std::sin(yaw));
  if ((feet - now_.at).norm() > 0.03) add_walk({feet}, 0.8);
  add_turn(yaw);
  Phase phase;
  phase.kind = Phase::Kind::kSit;
  phase.from_s = end_s_;
  phase.until_s = end_s_ + std::max(0.1, action.seconds) + (begins_seated ? 0 : kSitting_s) +
                  (ends_seated ? 0 : kSitting_s);
  phase.from = phase.until = now_;
  phase.action = action;
  phase.begins_seated = begins_seated;
  phase.ends_seated = ends_seated;
  end_s_ = phase.until_s;
  phases_.push_back(std::move(phase));
}

void Timeline::join_stepping() {
  // A turn that leads into a walk is one stretch of steps.
  std::vector<SteppingTime> joined;
  for (const SteppingTime& time : stepping_) {
    if (!joined.empty() && time.from_s - joined.back().until_s < 1e-9) {
      joined.back().until_s = time.until_s;
    } else {
      joined.push_back(time);
    }
  }
  stepping_ = std::move(joined);
}

double Timeline::local_time(double t_s) const {
  t_s -= delay_s_;
  if (t_s <= 0) return 0;
  return repeat_ ? std::fmod(t_s, end_s_) : std::min(t_s, end_s_);
}

const Timeline::Phase& Timeline::phase_at(double local_s) const {
  for (const Phase& phase : phases_) {
    if (local_s < phase.until_s) return phase;
  }
  return phases_.back();
}

Ground Timeline::ground(double local_s) const {
  const Phase& phase = phase_at(local_s);
  if (phase.kind == Phase::Kind::kTurn) {
    const double share = ease((local_s - phase.from_s) / (phase.until_s - phase.from_s));
    return {phase.from.at, phase.from.yaw_rad + share * (phase.until.yaw_rad - phase.from.yaw_rad)};
  }
  if (phase.kind != Phase::Kind::kWalk) return phase.from;
  const double s_m = way_at(local_s - phase.from_s, phase.arc_m.back(), phase.speed_mps);
  const auto point = [&](double m) -> Vec2 {
    m = std::clamp(m, 0.0, phase.arc_m.back());
    const auto next = std::upper_bound(phase.arc_m.begin(), phase.arc_m.end() - 1, m);
    const auto i = static_cast<std::size_t>(next - phase.arc_m.begin());
    const double k = (m - phase.arc_m[i - 1]) / std::max(1e-9, phase.arc_m[i] - phase.arc_m[i - 1]);
    return (1 - k) * phase.curve[i - 1] + k * phase.curve[i];
  };
  const Vec2 along = point(s_m + 0.06) - point(s_m - 0.06);
  return {point(s_m), std::atan2(along.y(), along.x())};
}

SitState Timeline::sitting(double local_s) const {
  const Phase& phase = phase_at(local_s);
  SitState state;
  if (phase.kind != Phase::Kind::kSit) return state;
  state.seat = phase.action.seat;
  state.seat_m = phase.action.seat_m;
  const double down = phase.begins_seated ? 1 : (local_s - phase.from_s) / kSitting_s;
  const double up = phase.ends_seated ? 1 : (phase.until_s - local_s) / kSitting_s;
  state.share = ease(std::min(down, up));
  return state;
}

GestureState Timeline::gesture(double local_s) const {
  const Phase& phase = phase_at(local_s);
  GestureState state;
  if (phase.kind != Phase::Kind::kSit && phase.kind != Phase::Kind::kStand) return state;
  if (phase.action.gesture.empty()) return state;
  state.name = phase.action.gesture;
  const bool sits = phase.kind == Phase::Kind::kSit;
  const double from_s = phase.from_s + (sits && !phase.begins_seated ? kSitting_s : 0);
  const double until_s = phase.until_s - (sits && !phase.ends_seated ? kSitting_s : 0);
  const bool always = phases_.size() == 1;
  state.strength =
      always ? 1
             : std::min(ease((local_s - from_s) / kEase_s), ease((until_s - local_s) / kEase_s));
  return state;
}

}  // namespace ygslam::sim
