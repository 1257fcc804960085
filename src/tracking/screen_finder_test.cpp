// A room with a screen in it, as points and depth: what is on the screen moves in its plane while
// the camera moves otherwise, or stands.
#include "tracking/screen_finder.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"
#include "geometry/geometry_testing.hpp"

namespace ygslam {
namespace {

constexpr double kScreenAway_m = 1.5;  // away, 1.2 x 0.7 m
constexpr double kBackWall_m = 3.5;    // with a pillar that stands 0.5 m out of it

bool is_on_screen(const Vec3& p_world) {
  return std::abs(p_world.x()) < 0.6 && std::abs(p_world.y()) < 0.35;
}

/// The nearest surface on a ray of the world.
Vec3 surface_on_ray(const Vec3& origin, const Vec3& direction) {
  Vec3 on_screen = origin + direction * ((kScreenAway_m - origin.z()) / direction.z());
  if (is_on_screen(on_screen)) return on_screen;
  Vec3 on_pillar = origin + direction * ((kBackWall_m - 0.5 - origin.z()) / direction.z());
  if (on_pillar.x() > 0.9 && on_pillar.x() < 1.5) return on_pillar;
  Vec3 on_floor = origin + direction * ((1.0 - origin.y()) / direction.y());
  if (direction.y() > 0 && on_floor.z() < kBackWall_m) return on_floor;
  return origin + direction * ((kBackWall_m - origin.z()) / direction.z());
}

class ScreenRoom {
 public:
  /// @return the depth image from a camera, with a Kinect's noise.
  [[nodiscard]] FramePtr see(const SE3& T_world_camera, std::uint64_t seed) const {
    Rng rng(seed);
    auto frame = std::make_shared<RgbdFrame>();
    frame->depth_m = DepthImage(camera_.width(), camera_.height());
    for (int v = 0; v < camera_.height(); ++v)
      for (int u = 0; u < camera_.width(); ++u) {
        const Vec3 ray = T_world_camera.R() * camera_.unproject(Vec2(u, v), 1);
        const double z = (T_world_camera.inverse() * surface_on_ray(T_world_camera.t(), ray)).z();
        frame->depth_m.at(u, v) = static_cast<float>(rng.normal(z, kinect_depth_sigma_m(z)));
      }
    return frame;
  }

  struct View {
    FrameFeatures seen;
    std::vector<ScreenFinder::Point> points;
  };
  /// @param moved_m how far what the screen shows has moved since its points were mapped.
  [[nodiscard]] View points(const SE3& T_world_camera, const Vec3& moved_m) const {
    View view;
    view.seen.frame = see(T_world_camera, 2);
    Rng rng(7);
    auto features = std::make_shared<Features>();
    while (features->size() < 500) {
      const Vec2 px(rng.uniform(5, camera_.width() - 5.0), rng.uniform(5, camera_.height() - 5.0));
      const Vec3 p_world =
          surface_on_ray(T_world_camera.t(), T_world_camera.R() * camera_.unproject(px, 1));
      const bool on_screen = std::abs(p_world.z() - kScreenAway_m) < 1e-6 && is_on_screen(p_world);
      Feature f;
      f.uv_px = f.ideal_px = (px + Vec2(rng.normal(0, 0.15), rng.normal(0, 0.15))).cast<float>();
      f.depth_m = depth_at(view.seen.frame->depth_m, px.x(), px.y());
      features->points.push_back(f);
      features->descriptors.emplace_back();
      const auto index = static_cast<std::uint32_t>(features->size() - 1);
      view.points.push_back({index, on_screen ? Vec3(p_world - moved_m) : p_world, true});
    }
    view.seen.features = std::move(features);
    return view;
  }
  [[nodiscard]] const Camera& camera() const { return camera_; }
  /// Of a camera at the origin.
  void show_first_frame(ScreenFinder& finder) const {
    FrameFeatures first;
    first.frame = see(SE3(), 1);
    finder.remember(first, SE3());
  }

  /// The pose by all points, as tracking has it, and what the finder says of it.
  struct Answer {
    SE3 T_camera_world;
    ScreenFinder::Output out;
  };
  [[nodiscard]] Answer ask(const SE3& T_world_camera, const Vec3& moved_m) const {
    const View view = points(T_world_camera, moved_m);
    const PyramidScales scales(8, 1.2);
    std::vector<PoseObservation> all;
    for (const auto& point : view.points)
      all.push_back(
          {point.p_world, observation_of(view.seen.features->points[point.feature], 1, {}, 1)});
    const auto pose = solve_pose(camera_, T_world_camera.inverse(), all, {});
    CHECK(pose, "points agree");
    ScreenFinder finder(camera_, scales, {});
    show_first_frame(finder);
    const ScreenFinder::Place place{view.seen, pose->T_camera_world,
                                    pose->T_camera_world.inverse()};
    return {pose->T_camera_world, finder.step(place, 0, [&] { return view.points; })};
  }

 private:
  Camera camera_ = geometry_test::test_camera(260, 320, 240);
};

const SE3 kCameraMoved(so3_exp(Vec3(0.002, -0.004, 0.001)), Vec3(0.02, 0.01, 0.015));

TEST(ScreenFinder, AVideoThatPansIsNoMotionOfTheCamera) {
  for (const SE3& T_world_camera : {SE3(), kCameraMoved}) {
    const auto answer = ScreenRoom().ask(T_world_camera, Vec3(0.04, 0, 0));
    EXPECT_GT((answer.T_camera_world.inverse().t() - T_world_camera.t()).norm(), 0.02)
        << "all points together take it for one";
    ASSERT_TRUE(answer.out.found);
    EXPECT_TRUE(answer.out.found->moves_camera);
    EXPECT_LT((answer.out.found->T_camera_world.inverse().t() - T_world_camera.t()).norm(), 0.005);
    EXPECT_NEAR(answer.out.found->screen.plane.normalized().z(), 1, 0.01);
  }
}

/// All that is on the screen, and ten points beside it.
ScreenRoom::View hardly_beside(ScreenRoom::View view) {
  int beside = 0;
  std::erase_if(view.points, [&](const ScreenFinder::Point& point) {
    const Feature& f = view.seen.features->points[point.feature];
    return f.depth_m > kScreenAway_m + 0.2 && ++beside > 10;
  });
  return view;
}

TEST(ScreenFinder, DepthTellsWhereTheCameraIsIfHardlyAPointIsBesideTheScreen) {
  for (const double step_m : {0.0, 0.012}) {
    const ScreenRoom room;
    const PyramidScales scales(8, 1.2);
    ScreenFinder finder(room.camera(), scales, {});
    room.show_first_frame(finder);
    std::optional<ScreenFinder::Finding> found;
    SE3 T_camera_world;
    for (int i = 1; i < 10 && !found; ++i) {
      const auto view = hardly_beside(room.points(kCameraMoved, Vec3(0, i * step_m, 0)));
      std::vector<PoseObservation> all;
      for (const auto& point : view.points)
        all.push_back(
            {point.p_world, observation_of(view.seen.features->points[point.feature], 1, {}, 1)});
      T_camera_world = solve_pose(room.camera(), T_camera_world, all, {})->T_camera_world;
      found = finder
                  .step({view.seen, T_camera_world, T_camera_world.inverse()}, 0,
                        [&] { return view.points; })
                  .found;
      finder.remember(view.seen, T_camera_world.inverse());
    }
    ASSERT_EQ(found.has_value(), step_m > 0) << "a picture that stands is no screen that plays";
    if (!found) continue;
    EXPECT_GT((T_camera_world.inverse().t() - kCameraMoved.t()).norm(), 0.03) << "by the points";
    EXPECT_LT((found->T_camera_world.inverse().t() - kCameraMoved.t()).norm(), 0.01);
  }
}

TEST(ScreenFinder, DepthAloneHasNoPoseWhereWhatIsSeenMovesOtherwise) {
  const ScreenRoom room;
  const PyramidScales scales(8, 1.2);
  ScreenFinder finder(room.camera(), scales, {});
  room.show_first_frame(finder);
  FrameFeatures now;
  now.frame = room.see(kCameraMoved, 2);
  const auto by_depth = [&] { return finder.by_depth({now, SE3(), SE3()}, SE3()); };
  ASSERT_TRUE(by_depth());
  EXPECT_LT((by_depth()->T_camera_world.inverse().t() - kCameraMoved.t()).norm(), 0.015);
  auto somebody = std::make_shared<RgbdFrame>(*now.frame);
  for (int v = 0; v < somebody->depth_m.height(); ++v)
    for (int u = 0; u < 100; ++u) somebody->depth_m.at(u, v) = 1;
  now.frame = somebody;
  EXPECT_FALSE(by_depth());
}

TEST(ScreenFinder, AStillPictureIsASurfaceLikeOthers) {
  for (const SE3& T_world_camera : {SE3(), kCameraMoved}) {
    const auto answer = ScreenRoom().ask(T_world_camera, Vec3::Zero());
    EXPECT_FALSE(answer.out.found);
    EXPECT_FALSE(answer.out.undecided);
  }
}

TEST(DepthAgreement, IsBestAtTheTrueMotionAndPointsToIt) {
  const ScreenRoom room;
  const DepthSamples before(room.camera(), room.see(SE3(), 1)->depth_m);
  const FramePtr now = room.see(kCameraMoved, 2);
  const auto at = [&](const SE3& T_world_camera) {
    return compare_depth(room.camera(), before, now->depth_m, T_world_camera.inverse());
  };
  const DepthAgreement truth = at(kCameraMoved);
  const DepthAgreement wrong = at(kCameraMoved * SE3(so3_exp(Vec3(0, 0.01, 0)), Vec3(0.03, 0, 0)));
  EXPECT_GT(truth.samples, 500);
  EXPECT_LT(truth.possible_gain(), 25);
  EXPECT_GT(wrong.possible_gain(), 50);
  EXPECT_LT(truth.cost, wrong.cost);
}

TEST(PlanarPatches, ScreenPillarFloorAndWallAreApart) {
  const ScreenRoom room;
  const FramePtr frame = room.see(SE3(), 1);
  const PlanarPatches patches(room.camera(), frame->depth_m);
  const auto patch_of = [&](const Vec3& p) {
    return patches.patch_at(room.camera().project(p).cast<float>(), p);
  };
  const int screen = patch_of({0.1, 0.1, kScreenAway_m});
  ASSERT_GE(screen, 0);
  EXPECT_EQ(patch_of({-0.5, -0.3, kScreenAway_m}), screen);
  EXPECT_NE(patch_of({-1.6, -0.6, kBackWall_m}), screen);
  EXPECT_EQ(patch_of({0.1, 0.1, kScreenAway_m + 0.5}), -1) << "behind it";
  EXPECT_LT(
      distance_m(patches.planes()[static_cast<std::size_t>(screen)], {0.3, -0.2, kScreenAway_m}),
      0.01);
}

}  // namespace
}  // namespace ygslam
