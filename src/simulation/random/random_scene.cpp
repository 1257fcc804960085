#include "simulation/random/random_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "simulation/random/clutter.hpp"
#include "simulation/random/random_body.hpp"
#include "simulation/random/random_pose.hpp"
#include "simulation/world/camera_paths.hpp"
#include "simulation/world/furniture.hpp"
#include "simulation/world/mover_motions.hpp"
#include "simulation/world/rooms.hpp"

namespace ygslam::sim {

namespace {

constexpr double kRad = std::numbers::pi / 180;

template <std::size_t N>
const std::string& one_of(const std::array<std::string, N>& names, Rng& rng) {
  return names[rng.below(static_cast<std::uint32_t>(N))];
}

/// Draws everything that stands still, and remembers where the floor is taken.
class Decorator {
 public:
  Decorator(RandomScene& out, const BodyModel& baked, const std::vector<ColourImage>& album,
            Rng& rng)
      : scene_(out.scene), baked_(baked), album_(album), rng_(rng) {}

  void add_walls() {
    static const std::array<std::string, 5> walls = {"plaster", "brick", "concrete", "board",
                                                     "wood"};
    static const std::array<std::string, 4> floors = {"carpet", "tiles", "parquet", "concrete"};
    RoomPlan& r = room_;
    const Vec2 half(uniform(1.4, 4.5), uniform(1.4, 4.5));
    r.low = -half;
    r.high = half;
    r.height_m = uniform(2.2, 3.6);
    r.wall = one_of(walls, rng_);
    r.floor = one_of(floors, rng_);
    r.variant = variant();
    r.lamps_x = 1 + static_cast<int>(rng_.below(3));
    r.lamps_y = 1 + static_cast<int>(rng_.below(2));
    r.brightness = uniform(0.4, 1.6);
    scene_.ambient = static_cast<float>(uniform(0.12, 0.5));
    add_room(scene_, r);
  }

  void furnish() {
    const double crowded = uniform(0.2, 1.6);
    const auto along_walls = static_cast<int>(crowded * (room_.high - room_.low).sum() * 0.9);
    for (int i = 0; i < along_walls; ++i) add_at_wall();
    const int inside = static_cast<int>(crowded * uniform(0, 7));
    for (int i = 0; i < inside; ++i) add_inside();
    const int junk = static_cast<int>(crowded * uniform(0, 8));
    for (int i = 0; i < junk; ++i) add_shape();
    const int cluttered = 1 + static_cast<int>(crowded * uniform(0, 5));
    for (int i = 0; i < cluttered; ++i) add_cluttered();
    const int coats = rng_.uniform() < 0.35 ? 1 + static_cast<int>(rng_.below(4)) : 0;
    for (int i = 0; i < coats; ++i) add_coat();
    for (const ColourImage& picture : album_) {
      if (rng_.uniform() < 0.4) add_picture_of_people(picture);
    }
  }

  /// A place on the floor that is free within a radius.
  [[nodiscard]] bool is_free(const Vec2& at, double radius_m) const {
    if (((at - room_.low).array() < radius_m).any() || ((room_.high - at).array() < radius_m).any())
      return false;
    return std::none_of(taken_.begin(), taken_.end(), [&](const auto& disc) {
      return (disc.first - at).norm() < disc.second + radius_m;
    });
  }
  [[nodiscard]] Vec2 somewhere() {
    return {uniform(room_.low.x(), room_.high.x()), uniform(room_.low.y(), room_.high.y())};
  }
  [[nodiscard]] const RoomPlan& room() const { return room_; }
  /// Middles of what is cluttered; at least one.
  [[nodiscard]] const std::vector<Vec3>& cluttered_world() const { return cluttered_world_; }

  void put(const std::string& kind, const Vec3& at, double yaw_deg,
           const std::optional<Vec3f>& size_m = {}) {
    const auto mesh = make_furniture(kind, variant(), size_m, scene_.materials);
    append(scene_.fixed, *mesh, placed(at, yaw_deg));
  }

 private:
  [[nodiscard]] double uniform(double low, double high) { return rng_.uniform(low, high); }
  [[nodiscard]] int variant() { return static_cast<int>(rng_.below(40)); }
  [[nodiscard]] Vec3f size(double x0, double x1, double y0, double y1, double z0, double z1) {
    const double x = uniform(x0, x1);
    const double y = uniform(y0, y1);
    return Vec3(x, y, uniform(z0, z1)).cast<float>();
  }
  /// A place at a wall for something this deep. @return yaw [deg].
  double wall_place(double off_m, Vec2& at) {
    at = somewhere();
    switch (rng_.below(4)) {
      case 0:
        at.y() = room_.high.y() - off_m;
        return 0;
      case 1:
        at.y() = room_.low.y() + off_m;
        return 180;
      case 2:
        at.x() = room_.low.x() + off_m;
        return 90;
      default:
        at.x() = room_.high.x() - off_m;
        return -90;
    }
  }
  void add_at_wall() {
    Vec2 at;
    const double what = rng_.uniform();
    if (what < 0.25) {
      const Vec3f s = size(0.4, 1.4, 0.01, 0.03, 0.3, 1.3);
      const double yaw = wall_place(0.02, at);
      static const std::array<std::string, 4> flat = {"poster", "whiteboard", "window", "poster"};
      put(one_of(flat, rng_), {at.x(), at.y(), uniform(0.6, 1.7)}, yaw, s);
    } else if (what < 0.32) {
      put("door", {at.x(), at.y(), 0}, wall_place(0.03, at));
    } else if (what < 0.45) {
      const Vec3f s = size(0.4, 1.2, 0.25, 0.4, 0.4, 0.8);  // cupboard on the wall
      const double yaw = wall_place(0.5 * static_cast<double>(s.y()) + 0.01, at);
      put("cabinet", {at.x(), at.y(), uniform(1.2, 1.6)}, yaw, s);
    } else if (what < 0.72) {
      const Vec3f s = size(0.4, 2, 0.35, 0.65, 0.5, 2.2);
      static const std::array<std::string, 3> kinds = {"cabinet", "shelf", "carton"};
      stand(one_of(kinds, rng_), s);
    } else if (what < 0.9) {
      const double yaw = wall_place(0.45, at);
      put("workplace", {at.x(), at.y(), 0}, yaw);
      take(at, 0.75);
    } else {
      const double yaw = wall_place(0.5, at);
      put("sofa", {at.x(), at.y(), 0}, yaw);
      take(at, 0.7);
    }
  }
  void stand(const std::string& kind, const Vec3f& s) {
    Vec2 at;
    const double yaw = wall_place(0.5 * static_cast<double>(s.y()) + 0.01, at);
    put(kind, {at.x(), at.y(), 0}, yaw, s);
    take(at, 0.5 * static_cast<double>(std::max(s.x(), s.y())));
    if (s.z() < 1.3F && rng_.uniform() < 0.7) {
      static const std::array<std::string, 6> small = {"books",  "bottle", "plant",
                                                       "carton", "lamp",   "monitor"};
      put(one_of(small, rng_), {at.x(), at.y(), static_cast<double>(s.z())},
          yaw + uniform(-40, 40));
    }
  }
  void add_inside() {
    static const std::array<std::string, 8> kinds = {"chair",  "office_chair", "desk", "plant",
                                                     "carton", "block",        "bin",  "column"};
    const std::string& kind = one_of(kinds, rng_);
    std::optional<Vec3f> s;
    if (kind == "block" || kind == "carton") s = size(0.2, 0.9, 0.2, 0.9, 0.2, 1.2);
    if (kind == "plant") s = size(0.4, 0.9, 0.4, 0.9, 0.5, 1.9);
    if (kind == "column") s = size(0.15, 0.5, 0.15, 0.5, 1.4, 2.2);
    const Vec2 at = somewhere();
    put(kind, {at.x(), at.y(), 0}, uniform(0, 360), s);
    take(at, kind == "desk" ? 0.7 : 0.3);
  }
  /// A counter, a table or a piece of floor with small things all over it.
  void add_cluttered() {
    Vec2 at = somewhere();
    double yaw_deg = uniform(0, 360);
    Vec3f s = size(0.8, 2, 0.5, 0.9, 0.5, 0.8);
    const double what = rng_.uniform();
    if (what < 0.35) {
      s = size(0.8, 3, 0.45, 0.7, 0.7, 1.05);
      yaw_deg = wall_place(0.5 * static_cast<double>(s.y()) + 0.01, at);
      Mesh counter;
      add_box(counter, {-s.x() / 2, -s.y() / 2, 0}, {s.x() / 2, s.y() / 2, s.z()},
              random_material(scene_.materials, rng_));
      append(scene_.fixed, counter, placed({at.x(), at.y(), 0}, yaw_deg));
    } else if (what < 0.8) {
      put("desk", {at.x(), at.y(), 0}, yaw_deg, s);
    } else {
      s = size(0.3, 1, 0.3, 1, 0, 0);
    }
    append(scene_.fixed, random_clutter(0.9 * s.head<2>().cast<double>(), scene_.materials, rng_),
           placed({at.x(), at.y(), static_cast<double>(s.z())}, yaw_deg));
    take(at, 0.4 * static_cast<double>(s.x()));
    cluttered_world_.emplace_back(at.x(), at.y(), s.z());
  }
  /// Rods, balls and boxes; some as tall and as thick as people.
  void add_shape() {
    const Vec2 at = somewhere();
    const Vec3f foot(static_cast<float>(at.x()), static_cast<float>(at.y()),
                     static_cast<float>(rng_.uniform() < 0.6 ? 0 : uniform(0.2, 1.6)));
    const auto f = [&](double low, double high) { return static_cast<float>(uniform(low, high)); };
    const MaterialId m = random_material(scene_.materials, rng_);
    const double what = rng_.uniform();
    if (what < 0.4) {
      const Vec3f tilt(f(-0.3, 0.3), f(-0.3, 0.3), f(0.2, 1.9));
      add_cylinder(scene_.fixed, foot, foot + tilt, f(0.01, 0.25), f(0.01, 0.25), 14, m);
    } else if (what < 0.6) {
      add_sphere(scene_.fixed, foot + Vec3f(0, 0, 0.2F), f(0.04, 0.35), 10, m);
    } else if (what < 0.8) {
      const Vec3f half = size(0.05, 0.4, 0.05, 0.4, 0.1, 1.0);
      Mesh box;
      add_box(box, -half, half, m);
      const Vec3 turn(uniform(-0.5, 0.5), uniform(-0.5, 0.5), uniform(-3, 3));
      append(scene_.fixed, box, SE3(so3_exp(turn), (foot + Vec3f(0, 0, half.z())).cast<double>()));
    } else {  // like a coat stand or a lamp: a rod with something on it
      const float height = f(1.1, 1.9);
      const Vec3f top = foot + Vec3f(0, 0, height);
      add_cylinder(scene_.fixed, foot, top, 0.02F, 0.02F, 8, m);
      add_cylinder(scene_.fixed, top - Vec3f(0, 0, f(0.1, 0.9)), top, f(0.08, 0.28), f(0.05, 0.25),
                   14, random_material(scene_.materials, rng_));
      if (rng_.uniform() < 0.4) add_sphere(scene_.fixed, top + Vec3f(0, 0, 0.1F), 0.11F, 10, m);
    }
    if (foot.z() == 0) take(at, 0.25);
  }
  void add_coat() {
    const Mesh coat = hung_coat(baked_, scene_.materials, rng_);
    Vec2 at;
    if (rng_.uniform() < 0.7) {
      const double yaw = wall_place(0.01, at);
      append(scene_.fixed, coat, placed({at.x(), at.y(), uniform(1.2, 1.9)}, yaw));
    } else {  // over the back of a chair
      at = somewhere();
      const double yaw = uniform(0, 360);
      put("chair", {at.x(), at.y(), 0}, yaw);
      append(scene_.fixed, coat,
             placed({at.x(), at.y(), 0}, yaw) *
                 SE3(so3_exp(Vec3(0, 0, std::numbers::pi)), Vec3(0, 0.24, 0.95)));
      take(at, 0.4);
    }
  }
  void add_picture_of_people(const ColourImage& picture) {
    Vec2 at;
    const auto width = static_cast<float>(uniform(0.3, 2.2));
    const float height = width * static_cast<float>(uniform(0.6, 1.1));
    const bool screen = rng_.uniform() < 0.4;
    const MaterialId m = scene_.materials.picture(picture, screen ? 0.9F : 0);
    const double yaw = wall_place(screen ? 0.06 : 0.005, at);
    Mesh mesh;
    add_picture(mesh, {-width / 2, 0, 0}, {width, 0, 0}, {0, 0, height}, m);
    append(scene_.fixed, mesh, placed({at.x(), at.y(), uniform(0.2, 1.5)}, yaw));
  }
  void take(const Vec2& at, double radius_m) { taken_.emplace_back(at, radius_m); }

  Scene& scene_;
  const BodyModel& baked_;
  const std::vector<ColourImage>& album_;
  Rng& rng_;
  RoomPlan room_;
  std::vector<std::pair<Vec2, double>> taken_;
  std::vector<Vec3> cluttered_world_;
};

/// The camera of a shot: mostly held as a robot or a hand holds it, sometimes askew.
Shot draw_camera(Decorator& place, Rng& rng) {
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
  const Vec3 turn(rng.normal(0, fast), rng.normal(0, fast), rng.normal(0, fast));
  const Vec3 step(rng.normal(0, 0.3 * fast), rng.normal(0, 0.3 * fast), rng.normal(0, 0.3 * fast));
  shot.T_world_before = shot.T_world_camera * SE3(so3_exp(turn), step);
  shot.exposure = rng.uniform(0.6, 2);
  return shot;
}

/// Behind a table and what lies on it, as seen from the camera, and mostly turned towards it.
SE3 behind_clutter(const Shot& shot, const Decorator& place, double lift_m, Rng& rng) {
  const auto& all = place.cluttered_world();
  const Vec2 table = all[rng.below(static_cast<std::uint32_t>(all.size()))].head<2>();
  const Vec2 ahead = (table - shot.T_world_camera.t().head<2>()).normalized();
  const Vec2 aside(-ahead.y(), ahead.x());
  const Vec2 at = table + rng.uniform(0.3, 1.2) * ahead + rng.normal(0, 0.4) * aside;
  const Vec2 inside =
      at.cwiseMax(place.room().low + Vec2(0.2, 0.2)).cwiseMin(place.room().high - Vec2(0.2, 0.2));
  const double yaw = std::atan2(-ahead.y(), -ahead.x()) + rng.normal(0, 0.9);
  return {so3_exp(Vec3(0, 0, yaw)), Vec3(inside.x(), inside.y(), lift_m)};
}

/// Where a person is in a shot: mostly in the view, near ones often.
SE3 draw_place(const Shot& shot, Decorator& place, double radius_m, double lift_m, Rng& rng) {
  if (rng.uniform() < 0.3) return behind_clutter(shot, place, lift_m, rng);
  const Vec3& eye = shot.T_world_camera.t();
  const Vec3 gaze = shot.T_world_camera.R().col(2);
  const double ahead = std::atan2(gaze.y(), gaze.x());
  Vec2 at = place.somewhere();
  for (int i = 0; i < 25; ++i) {
    const double azimuth = ahead + rng.uniform(-38, 38) * kRad;
    const double distance_m = std::exp(rng.uniform(std::log(0.6), std::log(7)));
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

/// One person in all shots, and the chair below where there is one.
struct Part {
  std::vector<BodyPose> poses;
  std::vector<SE3> T_world_chair;
};

/// @param present in which shots.
Part draw_part(const RandomFigure& figure, const std::vector<Shot>& shots,
               const std::vector<bool>& present, Decorator& place, Rng& rng) {
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
    part.T_world_chair.push_back(chair ? T_world_floor * T_floor_chair : nowhere);
  }
  return part;
}

Mover chair_of(const std::vector<SE3>& T_world_chair, std::size_t person, Scene& scene, Rng& rng) {
  Mover chair;
  chair.name = "chair" + std::to_string(person);
  chair.class_name = "chair";
  chair.instance_id = static_cast<std::uint8_t>(kFirstThing + person);
  chair.mesh = *make_furniture(rng.uniform() < 0.5 ? "chair" : "office_chair",
                               static_cast<int>(rng.below(40)), {}, scene.materials);
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
  Decorator place(*out, baked, album, rng);
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
