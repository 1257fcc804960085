#include "simulation/random/random_pose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace ygslam::sim {

namespace {

Mat3 turned(double x_rad, double y_rad, double z_rad) {
  return so3_exp(Vec3(0, 0, z_rad)) * so3_exp(Vec3(0, y_rad, 0)) * so3_exp(Vec3(x_rad, 0, 0));
}

/// Where hips and ankles are, body frame [m], and how far the trunk leans forward.
struct Stance {
  Vec3 hips;
  std::array<Vec3, 2> ankle;  // left, right
  std::array<Vec3, 2> knee;   // where it points to
  double lean_rad = 0;
};

Stance stance_of(const BodyShape& shape, Posture posture, double seat_m, Rng& rng) {
  const Vec3& rest = shape.joints[index(Bone::kHips)];
  const Vec3& thigh = shape.joints[index(Bone::kLeftThigh)];
  const Vec3& shin = shape.joints[index(Bone::kLeftShin)];
  const Vec3& foot = shape.joints[index(Bone::kLeftFoot)];
  const double size = rest.z();  // of this body: 0.95 m for a grown-up
  const double thigh_m = (shin - thigh).norm();
  const double leg_m = thigh_m + (foot - shin).norm();
  Stance s;
  s.hips = {0, rng.normal(0, 0.02 * size), rest.z() - 0.015 * size};
  for (int side = 0; side < 2; ++side) {
    const double outwards = side == 0 ? 1 : -1;
    s.ankle[side] = {rng.normal(0, 0.05 * size),
                     outwards * (std::abs(foot.y()) + rng.uniform(-0.03, 0.12) * size), foot.z()};
    s.knee[side] = {1, outwards * rng.uniform(0, 0.4), 0.15};
  }
  s.lean_rad = rng.normal(0.04, 0.08);
  const int front = static_cast<int>(rng.below(2));
  Vec3& first = s.ankle[front];
  Vec3& second = s.ankle[1 - front];
  switch (posture) {
    case Posture::kStand:
      break;
    case Posture::kWalk: {
      const double stride_m = rng.uniform(0.2, 0.95) * size;
      first.x() += stride_m / 2;
      second.x() -= stride_m / 2;
      second.z() += rng.uniform(0, 0.2) * size;
      break;
    }
    case Posture::kSit:
      s.hips = {0, 0, seat_m + 0.1 * size};
      for (Vec3& ankle : s.ankle) ankle.x() = thigh_m * rng.uniform(0.55, 1.5);
      s.lean_rad = rng.normal(0.05, 0.25);
      break;
    case Posture::kKneel:
      s.hips.z() = rng.uniform(0.45, 0.58) * size;
      first.x() = rng.uniform(0.25, 0.5) * size;
      second = {-rng.uniform(0.25, 0.45) * size, second.y(), 0.08 * size};
      s.lean_rad = rng.normal(0.3, 0.3);
      break;
    case Posture::kSquat:
      s.hips = {-0.12 * size, 0, rng.uniform(0.25, 0.6) * size};
      for (Vec3& knee : s.knee) knee = {1, 2 * knee.y(), 0.4};
      s.lean_rad = rng.normal(0.45, 0.25);
      break;
    case Posture::kBend:
      s.hips.x() = -0.12 * size;
      s.hips.z() -= rng.uniform(0, 0.2) * size;
      s.lean_rad = rng.uniform(0.5, 1.7);
      break;
    case Posture::kLie:
      for (Vec3& ankle : s.ankle) {
        ankle.x() = rng.uniform(-0.1, 0.4) * size;
        ankle.z() += rng.uniform(0, 0.5) * size;
      }
      s.lean_rad = rng.normal(0.1, 0.3);
      break;
  }
  // Both ankles within reach.
  for (int side = 0; side < 2 && posture != Posture::kLie; ++side) {
    const Vec3 hip = s.hips + Vec3(0, side == 0 ? thigh.y() : -thigh.y(), thigh.z() - rest.z());
    const double flat2 = (s.ankle[side] - hip).head<2>().squaredNorm();
    const double highest =
        s.ankle[side].z() + std::sqrt(std::max(0.01, 0.99 * leg_m * leg_m - flat2));
    s.hips.z() -= std::max(0.0, hip.z() - highest);
  }
  return s;
}

void place_trunk(PoseBuilder& pose, const Stance& stance, Rng& rng) {
  const double lean = stance.lean_rad;
  const double hips_yaw = rng.normal(0, 0.12);
  pose.set_hips(stance.hips, turned(rng.normal(0, 0.06), 0.45 * lean, hips_yaw));
  const auto turn = [&](Bone bone, double pitch, const Vec3& sigma) {
    const double yaw = rng.normal(0, sigma.z());
    const double nod = rng.normal(0, sigma.y());
    pose.turn(bone, turned(rng.normal(0, sigma.x()), pitch + nod, yaw));
  };
  turn(Bone::kLowerBack, 0.2 * lean, {0.06, 0.05, 0.1});
  turn(Bone::kSpine, 0.2 * lean, {0.06, 0.05, 0.1});
  turn(Bone::kChest, 0.15 * lean, {0.06, 0.05, 0.1});
  turn(Bone::kNeck, -0.2 * lean, {0.1, 0.15, 0.25});
  turn(Bone::kHead, -0.2 * lean, {0.12, 0.2, 0.35});
}

void place_legs(PoseBuilder& pose, const Stance& stance, Rng& rng) {
  const std::array thighs = {Bone::kLeftThigh, Bone::kRightThigh};
  for (int side = 0; side < 2; ++side) {
    const Bone thigh = thighs[side];
    pose.reach(thigh, stance.ankle[side], stance.knee[side]);
    const double outwards = rng.uniform(-0.1, 0.5);
    const Mat3 R_foot = turned(0, rng.uniform(-0.1, 0.25), (side == 0 ? 1 : -1) * outwards);
    pose.orient(static_cast<Bone>(index(thigh) + 2), R_foot);
    pose.orient(static_cast<Bone>(index(thigh) + 3), R_foot);
  }
}

/// Where a hand is: x forward, y outwards, z up from the shoulder, in arm lengths.
Vec3 random_hand(Rng& rng) {
  const double what = rng.uniform();
  if (what < 0.35) return {rng.normal(0.08, 0.12), rng.uniform(0.08, 0.35), -0.93};  // hangs
  if (what < 0.50) return {rng.uniform(0.4, 0.75), rng.uniform(-0.4, 0), rng.uniform(-0.6, -0.2)};
  if (what < 0.58) return {rng.uniform(0, 0.2), rng.uniform(0.2, 0.4), -0.6};      // on the hip
  if (what < 0.66) return {rng.uniform(0.1, 0.35), rng.uniform(-0.3, 0.1), 0.25};  // at the head
  if (what < 0.74)
    return {rng.uniform(-0.1, 0.5), rng.uniform(0, 0.5), rng.uniform(0.5, 0.9)};  // up
  return {rng.uniform(-0.2, 0.95), rng.uniform(-0.2, 0.9), rng.uniform(-0.9, 0.6)};
}

void place_arms(PoseBuilder& pose, Rng& rng) {
  const Mat3 R_chest = pose.rotation(Bone::kChest);
  const double arm_m = pose.length(Bone::kLeftArm, Bone::kLeftForeArm) +
                       pose.length(Bone::kLeftForeArm, Bone::kLeftHand);
  const bool both_alike = rng.uniform() < 0.3;
  Vec3 target = random_hand(rng);
  for (const int side : {1, -1}) {
    const Bone arm = side > 0 ? Bone::kLeftArm : Bone::kRightArm;
    if (side < 0 && !both_alike) target = random_hand(rng);
    const double far = target.norm();
    const Vec3 held = target * (std::clamp(far, 0.3, 0.98) / std::max(far, 1e-3));
    const Vec3 outwards(held.x(), side * held.y(), held.z());
    const Vec3 elbow(-0.7, side * rng.uniform(0.2, 0.9), -0.6);
    pose.reach(arm, pose.joint(arm) + R_chest * (arm_m * outwards), R_chest * elbow);
    const Mat3 curl = turned(-side * rng.uniform(0, 0.8), 0, 0);
    pose.turn(static_cast<Bone>(index(arm) + 3), curl);
    pose.turn(static_cast<Bone>(index(arm) + 4), curl);
  }
}

}  // namespace

Posture random_posture(Rng& rng) {
  const double what = rng.uniform();
  if (what < 0.28) return Posture::kStand;
  if (what < 0.48) return Posture::kWalk;
  if (what < 0.74) return Posture::kSit;
  if (what < 0.79) return Posture::kKneel;
  if (what < 0.84) return Posture::kSquat;
  if (what < 0.94) return Posture::kBend;
  return Posture::kLie;
}

BodyPose random_pose(const BodyModel& model, const BodyShape& shape, Posture posture,
                     const SE3& T_world_floor, double seat_m, Rng& rng) {
  const Stance stance = stance_of(shape, posture, seat_m, rng);
  PoseBuilder pose(model, shape);
  place_trunk(pose, stance, rng);
  place_legs(pose, stance, rng);
  place_arms(pose, rng);
  if (posture != Posture::kLie) return pose.finish(T_world_floor);
  // Laid down backwards, then rolled about the long axis: on the back, a side, the belly.
  const Mat3 R_lying = turned(0, -std::numbers::pi / 2, 0) *
                       turned(0, 0, 0.5 * std::numbers::pi * static_cast<double>(rng.below(4)));
  const double half_m = 0.14 * shape.joints[index(Bone::kHips)].z();
  return pose.finish(T_world_floor * SE3(R_lying, Vec3(0, 0, half_m)));
}

}  // namespace ygslam::sim
