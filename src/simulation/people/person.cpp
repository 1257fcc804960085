#include "simulation/people/person.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/rng.hpp"
#include "simulation/people/clothes.hpp"
#include "simulation/world/mover_motions.hpp"

namespace ygslam::sim {

namespace {

double seat_distance(const BodyShape& shape) {
  return 0.92 *
         (shape.joints[index(Bone::kLeftShin)] - shape.joints[index(Bone::kLeftThigh)]).norm();
}

FootShape foot_shape(const BodyShape& shape) {
  const Vec3& ankle = shape.joints[index(Bone::kLeftFoot)];
  const Vec3& ball = shape.joints[index(Bone::kLeftToes)];
  return {std::abs(ankle.y()), ankle.z(), Vec3(ball.x() - ankle.x(), 0, ball.z() - ankle.z())};
}

Mat3 about_x(double rad) { return so3_exp(Vec3(rad, 0, 0)); }
Mat3 about_y(double rad) { return so3_exp(Vec3(0, rad, 0)); }
Mat3 about_z(double rad) { return so3_exp(Vec3(0, 0, rad)); }

}  // namespace

Person::Person(std::shared_ptr<const BodyModel> model, const PersonPlan& plan, std::uint64_t seed,
               std::vector<HoldingTime> holding, MaterialLibrary& materials)
    : model_(std::move(model)),
      shape_(static_cast<std::size_t>(plan.body)),
      timeline_(plan, seat_distance(shape())),
      footsteps_(timeline_, foot_shape(shape())),
      holding_(std::move(holding)),
      phase_(Rng(seed).uniform(0, 50)),
      mesh_(dressed(*model_, plan, materials)) {}

SE3 Person::T_world_body(double t_s) const {
  const Ground ground = timeline_.ground(timeline_.local_time(t_s));
  return {about_z(ground.yaw_rad), Vec3(ground.at.x(), ground.at.y(), 0)};
}

SE3 Person::T_world_root(double t_s) const {
  const BodyPose pose = pose_at(t_s);
  return pose.T_world_body * SE3(pose.R[0], pose.joints[0]);
}

void Person::place_trunk(PoseBuilder& pose, const SE3& T_world_body, double t_s,
                         const SitState& sit, const FootState& left, const FootState& right) const {
  const SE3 T_body_world = T_world_body.inverse();
  const Vec3 p_left = T_body_world * left.p_ankle_world;
  const Vec3 p_right = T_body_world * right.p_ankle_world;
  const double stride_m = p_left.x() - p_right.x();
  const double rhythm = t_s + phase_;
  const Vec3 rest = shape().joints[0];
  const double breath = 0.012 * std::sin(1.5 * rhythm);

  Vec3 hips = rest;
  hips.x() = 0;
  // Weight over the foot that stands.
  hips.y() =
      0.25 * (right.p_ankle_world.z() - left.p_ankle_world.z()) + 0.008 * std::sin(0.7 * rhythm);
  hips.z() -= 0.012;
  const double reach_m = 0.997 * (pose.length(Bone::kLeftThigh, Bone::kLeftShin) +
                                  pose.length(Bone::kLeftShin, Bone::kLeftFoot));
  for (const auto& [ankle, thigh] :
       {std::pair{p_left, Bone::kLeftThigh}, std::pair{p_right, Bone::kRightThigh}}) {
    const Vec3 hip = hips + shape().joints[index(thigh)] - rest;
    const double flat2 = (ankle - hip).head<2>().squaredNorm();
    const double highest = ankle.z() + std::sqrt(std::max(0.01, reach_m * reach_m - flat2));
    hips.z() -= std::max(0.0, hip.z() - highest);
  }
  double lean = 0.03 + 0.05 * std::min(1.0, std::abs(stride_m));
  if (sit.share > 0) {
    const Vec3 seat_body = T_body_world * Vec3(sit.seat.x(), sit.seat.y(), 0);
    const double above = 0.095 + rest.z() - shape().joints[index(Bone::kLeftThigh)].z();
    const Vec3 seated(seat_body.x(), seat_body.y(), sit.seat_m + above);
    hips += sit.share * (seated - hips);
    lean += 0.75 * std::sin(std::numbers::pi * sit.share) - 0.06 * sit.share;
  }
  const double pelvis_yaw = std::clamp(-0.16 * stride_m, -0.2, 0.2);
  pose.set_hips(hips, about_z(pelvis_yaw) * about_y(0.5 * lean));
  const double slow = 0.03 * std::sin(0.31 * rhythm) * (1 + sit.share);
  pose.turn(Bone::kLowerBack, about_z(-0.6 * pelvis_yaw + slow) * about_y(0.25 * lean));
  pose.turn(Bone::kSpine, about_z(-0.8 * pelvis_yaw) * about_y(0.25 * lean + breath));
  pose.turn(Bone::kChest,
            about_z(-0.6 * pelvis_yaw + slow) * about_x(0.02 * std::sin(0.53 * rhythm)));
  const double look = 0.28 * std::sin(0.37 * rhythm) + 0.22 * std::sin(0.83 * rhythm + 1);
  const double nod = -0.6 * lean + 0.06 * std::sin(1.1 * rhythm);
  pose.turn(Bone::kNeck, about_z(0.4 * look) * about_y(0.4 * nod));
  pose.turn(Bone::kHead, about_z(0.6 * look) * about_y(0.6 * nod));
}

void Person::place_feet(PoseBuilder& pose, const SE3& T_world_body, const FootState& left,
                        const FootState& right) const {
  const SE3 T_body_world = T_world_body.inverse();
  for (const auto& [foot, thigh, bone, toes] :
       {std::tuple{left, Bone::kLeftThigh, Bone::kLeftFoot, Bone::kLeftToes},
        std::tuple{right, Bone::kRightThigh, Bone::kRightFoot, Bone::kRightToes}}) {
    const Mat3 R_yaw = T_body_world.R() * about_z(foot.yaw_rad);
    const double outwards = thigh == Bone::kLeftThigh ? 0.12 : -0.12;
    pose.reach(thigh, T_body_world * foot.p_ankle_world, R_yaw * Vec3(1, outwards, 0.15));
    pose.orient(bone, R_yaw * about_y(foot.pitch_rad));
    pose.orient(toes, foot.planted ? R_yaw : Mat3(R_yaw * about_y(foot.pitch_rad)));
  }
}

Vec3 Person::hand_target(int side, const std::string& gesture, double t_s) const {
  // x forward, y outwards, z up, from the shoulder, in arm lengths.
  const double t = t_s + phase_;
  const bool right = side < 0;
  if (gesture == "talk") {
    const double other = right ? 0 : 1.7;
    return {0.50 + 0.12 * std::sin(2.3 * t + other), 0.02 + 0.14 * std::sin(1.7 * t + other),
            -0.38 + 0.16 * std::sin(2.9 * t + other) * std::sin(0.6 * t)};
  }
  if (gesture == "type") {
    return {0.66 + 0.015 * std::sin(9 * t + side), -0.10 + 0.03 * std::sin(0.9 * t),
            -0.36 + 0.02 * std::sin(11 * t + 2 * side)};
  }
  if (gesture == "carry") return {0.66, -0.04, -0.36};
  if (gesture == "push") return {0.74, -0.02, -0.46};
  if (right) {
    if (gesture == "wave") return {0.30, 0.38 + 0.22 * std::sin(7 * t), 0.48};
    if (gesture == "point")
      return {0.93, 0.10 + 0.06 * std::sin(0.8 * t), 0.05 + 0.05 * std::sin(1.1 * t)};
    if (gesture == "phone") return {0.10, -0.06, 0.28};
    if (gesture == "drink") {
      const double up = ease(0.5 + 0.9 * std::sin(1.0 * t));
      return Vec3(0.55, -0.10, -0.45) + up * Vec3(-0.22, -0.16, 0.62);
    }
  }
  return {0.45, -0.08, -0.55};
}

void Person::place_arms(PoseBuilder& pose, double t_s, double local_s, const SitState& sit,
                        double stride_m) const {
  GestureState gesture = timeline_.gesture(local_s);
  for (const HoldingTime& hold : holding_) {
    if (t_s < hold.from_s - 0.5 || t_s > hold.until_s + 0.5) continue;
    gesture.name = hold.pushes ? "push" : "carry";
    gesture.strength =
        std::min(ease((t_s - hold.from_s + 0.5) / 0.5), ease((hold.until_s + 0.5 - t_s) / 0.5));
  }
  const Mat3 R_chest = pose.rotation(Bone::kChest);
  const double arm_m = pose.length(Bone::kLeftArm, Bone::kLeftForeArm) +
                       pose.length(Bone::kLeftForeArm, Bone::kLeftHand);
  for (const int side : {1, -1}) {
    const Bone arm = side > 0 ? Bone::kLeftArm : Bone::kRightArm;
    const double swing = std::clamp(-0.42 * side * stride_m, -0.4, 0.4);
    const Vec3 hanging(0.08 + swing, 0.17,
                       -0.94 + 0.35 * swing * swing + (swing > 0 ? 0.06 * swing : 0));
    const Vec3 on_thigh(0.62, -0.06, -0.62);
    Vec3 target = hanging + sit.share * (on_thigh - hanging);
    target += gesture.strength * (hand_target(side, gesture.name, t_s) - target);
    // A straight way between two postures may lead through the shoulder; keep it outside.
    const double distance = target.norm();
    if (distance < 0.3) target *= 0.3 / std::max(1e-3, distance);
    const Vec3 outwards(target.x(), side * target.y(), target.z());
    const Vec3 pole(-0.7, side * (0.25 + 0.5 * gesture.strength), -0.6);
    pose.reach(arm, pose.joint(arm) + R_chest * (arm_m * outwards), R_chest * pole);
    const auto fingers = static_cast<Bone>(index(arm) + 3);
    const Mat3 curl = about_x(-side * 0.35);
    pose.turn(fingers, curl);
    pose.turn(static_cast<Bone>(index(arm) + 4), curl);
  }
}

BodyPose Person::pose_at(double t_s) const {
  const double local_s = timeline_.local_time(t_s);
  const SE3 T_body = T_world_body(t_s);
  const FootState left = footsteps_.foot(1, local_s);
  const FootState right = footsteps_.foot(-1, local_s);
  const SitState sit = timeline_.sitting(local_s);
  PoseBuilder pose(*model_, shape());
  place_trunk(pose, T_body, t_s, sit, left, right);
  place_feet(pose, T_body, left, right);
  const SE3 T_body_world = T_body.inverse();
  const double stride_m =
      (T_body_world * left.p_ankle_world - T_body_world * right.p_ankle_world).x();
  place_arms(pose, t_s, local_s, sit, stride_m);
  return pose.finish(T_body);
}

void Person::shape_at(double t_s, std::vector<Vec3f>& p_world, std::vector<Vec3f>& normals) const {
  skin(*model_, shape(), pose_at(t_s), p_world);
  smooth_normals(mesh_.triangles, model_->twin, p_world, normals);
}

}  // namespace ygslam::sim
