#include <gtest/gtest.h>

#include <cmath>

#include "simulation/embedded_files.hpp"
#include "simulation/people/person.hpp"

namespace ygslam::sim {
namespace {

std::shared_ptr<const BodyModel> bodies() {
  Result<BodyModel> model = parse_bodies(*embedded_file("bodies.bin"));
  CHECK(model.ok());
  return std::make_shared<const BodyModel>(std::move(*model));
}

PersonPlan walker(int body) {
  PersonPlan plan;
  plan.body = body;
  plan.start = Vec2(-2, 0);
  PersonAction walk;
  walk.kind = ActionKind::kWalk;
  walk.via = {Vec2(0, 0.4), Vec2(1.5, -0.3)};
  PersonAction sit;
  sit.kind = ActionKind::kSit;
  sit.seat = Vec2(0.5, 0.8);
  sit.yaw_deg = 200;
  sit.seconds = 2;
  plan.actions = {walk, sit};
  return plan;
}

TEST(Person, FeetOnTheGroundDoNotSlide) {
  const auto model = bodies();
  for (int body = 0; body < static_cast<int>(model->shapes.size()); ++body) {
    MaterialLibrary materials(16);
    const Person person(model, walker(body), 1, {}, materials);
    // Vertices that belong to the toes alone.
    std::vector<std::size_t> toes[2];
    for (std::size_t i = 0; i < model->weights.size(); ++i) {
      if (model->weights[i].share[0] < 250) continue;
      if (model->weights[i].bone[0] == index(Bone::kLeftToes)) toes[0].push_back(i);
      if (model->weights[i].bone[0] == index(Bone::kRightToes)) toes[1].push_back(i);
    }
    ASSERT_FALSE(toes[0].empty() || toes[1].empty());
    std::vector<Vec3f> now, before, normals;
    double worst_m = 0;
    int planted_frames = 0;
    const double step_s = 1.0 / 60;
    person.shape_at(0, before, normals);
    for (double t_s = step_s; t_s < person.timeline().duration_s(); t_s += step_s) {
      person.shape_at(t_s, now, normals);
      for (const int foot : {0, 1}) {
        const int side = foot == 0 ? 1 : -1;
        const FootState a = person.footsteps().foot(side, t_s - step_s);
        const FootState b = person.footsteps().foot(side, t_s);
        if (!a.planted || !b.planted) continue;
        ++planted_frames;
        for (const std::size_t i : toes[foot])
          worst_m = std::max(worst_m, static_cast<double>((now[i] - before[i]).norm()));
      }
      now.swap(before);
    }
    EXPECT_GT(planted_frames, 300);
    EXPECT_LT(worst_m, 1e-3) << model->shapes[static_cast<std::size_t>(body)].name;
  }
}

TEST(Person, MovesWithoutJumpsOverAWholeCycleAndIntoTheNext) {
  const auto model = bodies();
  MaterialLibrary materials(16);
  const Person person(model, walker(0), 1, {}, materials);
  std::vector<Vec3f> now, before, normals;
  person.shape_at(0, before, normals);
  const double step_s = 1.0 / 60;
  for (double t_s = step_s; t_s < person.timeline().duration_s() + 1; t_s += step_s) {
    person.shape_at(t_s, now, normals);
    float worst_m = 0;
    for (std::size_t i = 0; i < now.size(); i += 7)
      worst_m = std::max(worst_m, (now[i] - before[i]).norm());
    ASSERT_LT(worst_m, 0.16F) << "at " << t_s;  // a swinging foot makes 6 m/s at most
    now.swap(before);
  }
}

TEST(Person, SitsOnTheSeatAndStandsUpright) {
  const auto model = bodies();
  MaterialLibrary materials(16);
  const Person person(model, walker(1), 1, {}, materials);
  double lowest_m = 10;
  for (double t_s = 0; t_s < person.timeline().duration_s(); t_s += 0.1) {
    lowest_m = std::min(lowest_m, person.T_world_root(t_s).t().z());
  }
  EXPECT_GT(person.T_world_root(0).t().z(), 0.8);
  EXPECT_GT(lowest_m, 0.46);
  EXPECT_LT(lowest_m, 0.70);
}

TEST(Person, StaysOnTheGround) {
  const auto model = bodies();
  MaterialLibrary materials(16);
  const Person person(model, walker(3), 1, {}, materials);
  std::vector<Vec3f> points, normals;
  for (double t_s = 0; t_s < person.timeline().duration_s(); t_s += 0.13) {
    person.shape_at(t_s, points, normals);
    float lowest = 10;
    for (const Triangle& triangle : person.topology().triangles) {
      for (const std::uint32_t corner : triangle.corner)
        lowest = std::min(lowest, points[corner].z());
    }
    EXPECT_GT(lowest, -0.03F) << t_s;
    EXPECT_LT(lowest, 0.03F) << t_s;
  }
}

TEST(BodyAsset, DamagedBytesAreRefused) {
  const std::string whole(*embedded_file("bodies.bin"));
  ASSERT_TRUE(parse_bodies(whole).ok());
  for (const double share : {0.0, 0.00001, 0.001, 0.3, 0.99}) {
    EXPECT_FALSE(
        parse_bodies(std::string_view(whole).substr(
                         0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))))
            .ok());
  }
  EXPECT_FALSE(parse_bodies(whole + "x").ok());
}

}  // namespace
}  // namespace ygslam::sim
