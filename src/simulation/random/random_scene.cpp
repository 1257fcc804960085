#include "simulation/random/random_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "geometry/random_vector.hpp"
#include "simulation/random/random_body.hpp"
#include "simulation/random/random_pose.hpp"
#include "simulation/random/random_room.hpp"
#include "simulation/world/camera_paths.hpp"
#include "simulation/world/furniture.hpp"
#include "simulation/world/mover_motions.hpp"

namespace ygslam::sim {

namespace {

constexpr double kRad = std::numbers::pi / 180;

/// The camera of a shot: mostly held as a robot or a hand holds it, sometimes askew.
Shot draw_camera(RandomRoom& place, Rng& rng) {
  Shot shot;
  Vec2 at = place.somewhere();
  for (int i = 0; i < 30 && !place.is_free(at, 0.35); ++i) at = place.somewhere();
  const double ceiling_m = place.room().height_m - 0.2;
  double height_m =
      std::min(ceiling_m, rng.uniform() < 0.3 ? rng.uniform(0.25, 0.8) : rng.uniform(0.8, 2.1));
  // Towards the inside of the room more often than at the wall beside.
  const Vec2 middle = 0.6 * place.somewhere() - at;
  double yaw = std::atan2(middle.y(), middle.x()) + rng.normal(0, 0.5);
  double pitch = std::clamp(rng.normal(-0.12, 0.28), -0.8, 0.7);
  if (rng.uniform() < 0.3) {  // at what lies on a table, as by somebody who stands or sits there
    const auto& all = place.cluttered_world();
    const Vec3& target = all[rng.below(static_cast<std::uint32_t>(all.size()))];
    const double away_m = rng.uniform(0.4, 1.8);
    const Vec2 back = away_m * (at - target.head<2>()).normalized();
    at = (target.head<2>() + back).cwiseMax(place.room().low).cwiseMin(place.room().high);
    height_m = std::min(ceiling_m, target.z() + rng.uniform(0.3, 1.1));
    const Vec2 ahead = target.head<2>() - at;
    yaw = std::atan2(ahead.y(), ahead.x()) + rng.normal(0, 0.3);
    pitch = std::atan2(target.z() - height_m, away_m) + rng.uniform(-0.1, 0.7);
  }
  const double roll = rng.uniform() < 0.6 ? rng.normal(0, 0.07) : rng.uniform(-60, 60) * kRad;
  const Vec3 eye(at.x(), at.y(), height_m);
  const Vec3 gaze(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch),
                  std::sin(pitch));
  shot.T_world_camera =
      look_at_pose(eye, eye + gaze) * SE3(so3_exp(Vec3(0, 0, roll)), Vec3(0, 0, 0));
  const double fast = rng.uniform() < 0.4 ? rng.uniform(0, 0.09) : 0.004;
  const Vec3 turn = random_normals<3>(rng, fast);
  const Vec3 step = random_normals<3>(rng, 0.3 * fast);
  shot.T_world_before = shot.T_world_camera * SE3(so3_exp(turn), step);
  shot.exposure = rng.uniform(0.6, 2);
  return shot;
}

/// Behind a table and what lies on it, as seen from the camera, or before it, and mostly turned
/// towards it.
SE3 at_clutter(const Shot& shot, const RandomRoom& place, double behind_m, double lift_m,
               Rng& rng) {
  const auto& all = place.cluttered_world();
  const Vec2 table = all[rng.below(static_cast<std::uint32_t>(all.size()))].head<2>();
  const Vec2 ahead = (table - shot.T_world_camera.t().head<2>()).normalized();
  const Vec2 aside(-ahead.y(), ahead.x());
  const Vec2 at = table + behind_m * ahead + rng.normal(0, 0.4) * aside;
  const Vec2 inside =
      at.cwiseMax(place.room().low + Vec2(0.2, 0.2)).cwiseMin(place.room().high - Vec2(0.2, 0.2));
  const Vec2 towards = behind_m > 0 ? Vec2(-ahead) : ahead;
  const double yaw = std::atan2(towards.y(), towards.x()) + rng.normal(0, 0.9);
  return {so3_exp(Vec3(0, 0, yaw)), Vec3(inside.x(), inside.y(), lift_m)};
}

/// Where a person is in a shot: mostly in the view, near ones often.
SE3 draw_place(const Shot& shot, RandomRoom& place, double radius_m, double lift_m, Rng& rng) {
  const double what = rng.uniform();
  if (what < 0.3) return at_clutter(shot, place, rng.uniform(0.3, 1.2), lift_m, rng);
  if (what < 0.42) return at_clutter(shot, place, rng.uniform(-0.8, -0.25), lift_m, rng);
  const bool close = what < 0.52;  // so near that depth has holes where they are
  if (what < 0.65) radius_m = 0;   // leaning on things and walls
  const Vec3& eye = shot.T_world_camera.t();
  const Vec3 gaze = shot.T_world_camera.R().col(2);
  const double ahead = std::atan2(gaze.y(), gaze.x());
  Vec2 at = place.somewhere();
  for (int i = 0; i < 25; ++i) {
    const double azimuth = ahead + rng.uniform(-38, 38) * kRad;
    const double distance_m =
        close ? rng.uniform(0.25, 0.7) : std::exp(rng.uniform(std::log(0.6), std::log(7)));
    at = eye.head<2>() + distance_m * Vec2(std::cos(azimuth), std::sin(azimuth));
    if (place.is_free(at, i < 12 ? radius_m : 0.5 * radius_m)) break;
    at = place.somewhere();
  }
  const double yaw = rng.uniform(-std::numbers::pi, std::numbers::pi);
  return {so3_exp(Vec3(0, 0, yaw)), Vec3(at.x(), at.y(), lift_m)};
}

int number_of_people(Rng& rng) {
  const double what = rng.uniform();
  if (what < 0.18) return 0;
  if (what < 0.53) return 1;
  if (what < 0.80) return 2;
  return 3 + static_cast<int>(rng.below(4));
}

constexpr double kOutOfSight_m = -60;

/// An empty chair that hides a part of somebody.
SE3 chair_before(const Shot& shot, const SE3& T_world_floor, Rng& rng) {
  const Vec2 at = T_world_floor.t().head<2>();
  const Vec2 nearer = (shot.T_world_camera.t().head<2>() - at).normalized();
  const Vec2 aside(-nearer.y(), nearer.x());
  const double beside_m = rng.normal(0, 0.25);
  const Vec2 chair = at + rng.uniform(0.35, 0.8) * nearer + beside_m * aside;
  return placed({chair.x(), chair.y(), 0}, rng.uniform(0, 360));
}

/// One person in all shots, and the chair below where there is one.
struct Part {
  std::vector<BodyPose> poses;
  std::vector<SE3> T_world_chair;
};

/// @param present in which shots.
Part draw_part(const RandomFigure& figure, const std::vector<Shot>& shots,
               const std::vector<bool>& present, RandomRoom& place, Rng& rng) {
  const BodyShape& shape = figure.model.shapes[0];
  const double small = std::min(1.0, 0.3 + 0.7 * figure.height_m / 1.7);
  Part part;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const Posture posture = random_posture(rng);
    const bool chair = posture == Posture::kSit && small > 0.9 && rng.uniform() < 0.6;
    const double seat_m = chair ? 0.46 : small * rng.uniform(0.3, 0.62);
    const bool raised = posture == Posture::kLie && rng.uniform() < 0.6;
    SE3 T_world_floor = draw_place(shots[i], place, 0.22, raised ? rng.uniform(0.3, 0.8) : 0, rng);
    const SE3 nowhere(Mat3::Identity(), Vec3(0, 0, kOutOfSight_m));
    if (!present[i]) T_world_floor = nowhere;
    part.poses.push_back(random_pose(figure.model, shape, posture, T_world_floor, seat_m, rng));
    const SE3 T_floor_chair = placed(Vec3::Zero(), 90);  // furniture faces -y, people face +x
    const bool empty = !chair && present[i] && rng.uniform() < 0.3;
    if (empty) {
      part.T_world_chair.push_back(chair_before(shots[i], T_world_floor, rng));
    } else {
      part.T_world_chair.push_back(chair ? T_world_floor * T_floor_chair : nowhere);
    }
  }
  return part;
}

Mover chair_of(const std::vector<SE3>& T_world_chair, std::size_t person, Scene& scene, Rng& rng) {
  Mover chair;
  chair.name = "chair" + std::to_string(person);
  chair.class_name = "chair";
  chair.instance_id = static_cast<std::uint8_t>(kFirstThing + person);
  const auto variant = static_cast<int>(rng.below(40));
  chair.mesh =
      *make_furniture(rng.uniform() < 0.5 ? "chair" : "office_chair", variant, {}, scene.materials);
  chair.T_world_object = [T_world_chair](double t_s) {
    const auto shot = static_cast<std::size_t>(std::max(0.0, t_s));
    return T_world_chair[std::min(shot, T_world_chair.size() - 1)];
  };
  return chair;
}

}  // namespace

std::unique_ptr<RandomScene> draw_scene(const BodyModel& baked, int shots,
                                        const std::vector<ColourImage>& album, int texture_size,
                                        int threads, Rng& rng) {
  auto out = std::make_unique<RandomScene>();
  out->scene.materials = MaterialLibrary(texture_size);
  RandomRoom place(out->scene, baked, album, rng);
  place.add_walls();
  place.furnish();
  std::vector<int> people;
  for (int i = 0; i < shots; ++i) {
    out->shots.push_back(draw_camera(place, rng));
    people.push_back(number_of_people(rng));
  }
  const int most = *std::max_element(people.begin(), people.end());
  for (int p = 0; p < most; ++p) {
    std::vector<bool> present;
    for (const int n : people) present.push_back(p < n);
    auto figure =
        std::make_shared<const RandomFigure>(random_figure(baked, out->scene.materials, rng));
    const Part part = draw_part(*figure, out->shots, present, place, rng);
    Mover mover;
    mover.name = "person" + std::to_string(p + 1);
    mover.class_name = "person";
    mover.instance_id = static_cast<std::uint8_t>(p + 1);
    mover.body = std::make_shared<const RandomBody>(figure, part.poses);
    out->scene.movers.push_back(std::move(mover));
    out->scene.movers.push_back(
        chair_of(part.T_world_chair, static_cast<std::size_t>(p), out->scene, rng));
  }
  out->scene.materials.paint(threads);
  return out;
}

}  // namespace ygslam::sim
