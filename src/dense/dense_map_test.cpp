#include "dense/dense_map.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"
#include "volume/reading.hpp"

namespace ygslam {
namespace {

Camera small_camera() {
  CameraConfig c;
  c.fx = c.fy = 130, c.cx = 79.5, c.cy = 59.5, c.width = 160, c.height = 120;
  return Camera(c);
}

/// What the camera sees of the plane z = distance_m of the world, its columns coloured by u.
FramePtr plane_view(const Camera& camera, const SE3& T_world_camera, double distance_m) {
  auto frame = std::make_shared<RgbdFrame>();
  frame->id = FrameId{0};
  frame->colour = ColourImage(camera.width(), camera.height());
  frame->depth_m = DepthImage(camera.width(), camera.height());
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const Vec3 ray = T_world_camera.R() * camera.unproject({u, v}, 1.0);
      const double depth_m = (distance_m - T_world_camera.t().z()) / ray.z();
      frame->depth_m.at(u, v) = static_cast<float>(depth_m);
      frame->colour.at(u, v) = {static_cast<std::uint8_t>(u), 40, 200};
    }
  }
  return frame;
}

SE3 pose(double x, double yaw) { return SE3(so3_exp(Vec3(0, yaw, 0.02)), Vec3(x, 0.05, -0.1)); }

/// Three views of one plane.
DenseUpdate three_views(const Camera& camera, double distance_m) {
  DenseUpdate update;
  for (std::uint32_t i = 0; i < 3; ++i) {
    const SE3 T_world_camera = pose(0.1 * i, 0.1 * i - 0.1);
    update.T_world_camera[KeyframeId{i}] = T_world_camera;
    update.added.push_back(
        {KeyframeId{i}, plane_view(camera, T_world_camera, distance_m), {}, {}, {}, {}});
  }
  return update;
}

void expect_plane(const std::vector<ColouredPoint>& points, double distance_m) {
  ASSERT_GT(points.size(), 1000U);
  for (const ColouredPoint& p : points) {
    ASSERT_NEAR(p.p_world.z(), distance_m, 3e-3);
    ASSERT_NEAR(p.colour.g, 40, 3);
    ASSERT_NEAR(p.colour.b, 200, 5);
  }
}

TEST(DenseMap, APlaneComesOutWhereItIs) {
  const Camera camera = small_camera();
  DenseMap map({}, camera);
  map.apply(three_views(camera, 2.005));
  EXPECT_TRUE(map.cloud().empty()) << "nothing is put in by itself";
  while (map.step()) {
  }
  expect_plane(map.cloud(), 2.005);
  EXPECT_GT(map.memory_bytes(), 0U);
}

TEST(DenseMap, FollowsCorrectedPosesAndForgetsRemovedKeyframes) {
  const Camera camera = small_camera();
  DenseMap map({}, camera);
  map.apply(three_views(camera, 2.0));
  map.finish();
  DenseUpdate lifted;
  const SE3 up(Mat3::Identity(), Vec3(0, 0, 0.5));
  for (const auto& [id, T_world_camera] : three_views(camera, 2.0).T_world_camera)
    lifted.T_world_camera[id] = up * T_world_camera;
  map.apply(lifted);
  EXPECT_TRUE(map.step());
  while (map.step()) {
  }
  expect_plane(map.cloud(), 2.5);
  lifted.removed = {{KeyframeId{0}, {}}, {KeyframeId{1}, {}}, {KeyframeId{2}, {}}};
  map.apply(lifted);
  EXPECT_TRUE(map.cloud().empty());
  EXPECT_EQ(map.volume().views(), 0);
}

TEST(DenseMap, SmallCorrectionsWaitWhereNobodyLooks) {
  const Camera camera = small_camera();
  for (const bool is_watched : {false, true}) {
    DenseMap map({}, camera);
    if (is_watched) map.expect_looks();
    map.apply(three_views(camera, 2.0));
    while (map.step()) {
    }
    DenseUpdate lifted;
    const SE3 up(Mat3::Identity(), Vec3(0, 0, 0.03));
    for (const auto& [id, T_world_camera] : three_views(camera, 2.0).T_world_camera)
      lifted.T_world_camera[id] = up * T_world_camera;
    map.apply(lifted);
    while (map.step()) {
    }
    expect_plane(map.cloud(), is_watched ? 2.03 : 2.0);
    map.finish();
    expect_plane(map.cloud(), 2.03);
  }
}

TEST(DenseMap, KeyframesWithoutAPlaceAreLeftOut) {
  const Camera camera = small_camera();
  DenseMap map({}, camera);
  DenseUpdate update = three_views(camera, 2.0);
  map.apply(update);
  map.finish();
  map.apply({{}, {}, {{KeyframeId{1}, update.T_world_camera.at(KeyframeId{1})}}});
  map.finish();
  EXPECT_EQ(map.volume().views(), 1);
  expect_plane(map.cloud(), 2.0);
}

/// Whatever way it came about: the same keyframes at the same poses give the same bytes.
TEST(DenseMap, IsAPureFunctionOfKeyframesAndPoses) {
  const Camera camera = small_camera();
  Rng rng(7);
  for (int trial = 0; trial < 5; ++trial) {
    DenseMap walked({}, camera);
    DenseUpdate last = three_views(camera, 2.0);
    walked.apply(last);
    for (int change = 0; change < 6; ++change) {
      DenseUpdate update;
      for (const auto& [id, T_world_camera] : last.T_world_camera) {
        Vec6 twist;
        for (int i = 0; i < 6; ++i) twist[i] = rng.normal() * (change % 2 == 0 ? 0.05 : 0.001);
        if (rng.below(4) != 0) update.T_world_camera[id] = T_world_camera * SE3::exp(twist);
      }
      walked.apply(update);
      for (std::uint64_t steps = rng.below(4); steps > 0; --steps) walked.step();
      if (change == 5) last.T_world_camera = update.T_world_camera;
    }
    walked.finish();
    DenseMap direct({}, camera);
    direct.apply(last);
    direct.finish();
    EXPECT_EQ(walked.volume().fingerprint(), direct.volume().fingerprint());
    EXPECT_EQ(walked.mesh().triangles, direct.mesh().triangles);
  }
}

TEST(DenseMap, NothingComesFromMaskedPixelsOrTheirMargin) {
  const Camera camera = small_camera();
  DenseMapConfig config;
  config.margin_px = 4;
  DenseMap map(config, camera);
  GreyImage movers(camera.width(), camera.height());
  for (int v = 30; v < 90; ++v)
    for (int u = 50; u < 110; ++u) movers.at(u, v) = 255;
  DenseUpdate update;
  update.T_world_camera[KeyframeId{0}] = SE3();
  update.added.push_back({KeyframeId{0}, plane_view(camera, SE3(), 2.0), {}, movers, {}, {}});
  map.apply(update);
  map.finish();
  const auto points = map.cloud();
  ASSERT_FALSE(points.empty());
  for (const ColouredPoint& p : points) {
    const Vec2 px = camera.project(p.p_world.cast<double>());
    // A voxel is as large as 1.3 pixels.
    const bool inside = px.x() > 48 && px.x() < 111 && px.y() > 28 && px.y() < 91;
    ASSERT_FALSE(inside) << px.transpose();
  }
  int free = 0;
  for (const SpaceCell& cell : space_cells(map.volume()).cells)
    free += cell.state == SpaceState::kFree ? 1 : 0;
  EXPECT_GT(free, 1000) << "all depth tells what is free";
}

TEST(StoredView, ComesBackAsItWasLeft) {
  Rng rng(11);
  DepthView view;
  view.camera = {100, 100, 15.5, 11.5, 32, 24};
  view.depth = Image<std::uint16_t>(32, 24);
  view.colour = ColourImage(32, 24);
  view.object = Image<std::uint8_t>(32, 24);
  view.objects = {SceneObjectId{7}, SceneObjectId{300}};
  for (auto& depth : view.depth) depth = static_cast<std::uint16_t>(rng.below(1 << 16));
  for (auto& object : view.object) object = static_cast<std::uint8_t>(rng.below(3));
  const auto byte = [&] { return static_cast<std::uint8_t>(rng.below(256)); };
  for (Rgb8& colour : view.colour) colour = {byte(), byte(), byte()};
  const ColourImage before = view.colour;
  const StoredView stored(view);
  const DepthView back = stored.restored();
  EXPECT_TRUE(std::equal(back.depth.begin(), back.depth.end(), view.depth.begin()));
  EXPECT_TRUE(std::equal(back.object.begin(), back.object.end(), view.object.begin()));
  EXPECT_TRUE(std::equal(back.colour.begin(), back.colour.end(), view.colour.begin()));
  EXPECT_EQ(back.objects, view.objects);
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_NEAR(before.begin()[i].r, view.colour.begin()[i].r, 4);
  DepthView again = back;
  EXPECT_EQ(StoredView(again).bytes(), stored.bytes());
}

TEST(Dilated, EqualsBruteForce) {
  Rng rng(3);
  for (int trial = 0; trial < 20; ++trial) {
    const int height = 1 + static_cast<int>(rng.below(30));
    GreyImage mask(1 + static_cast<int>(rng.below(40)), height);
    for (auto& pixel : mask)
      pixel = rng.below(30) == 0 ? static_cast<std::uint8_t>(1 + rng.below(255)) : 0;
    const int radius_px = static_cast<int>(rng.below(6));
    const GreyImage grown = dilated(mask, radius_px);
    ASSERT_TRUE(grown.same_size(mask));
    for (int v = 0; v < mask.height(); ++v) {
      for (int u = 0; u < mask.width(); ++u) {
        std::uint8_t greatest = 0;
        for (int dv = -radius_px; dv <= radius_px; ++dv)
          for (int du = -radius_px; du <= radius_px; ++du)
            if (mask.contains(u + du, v + dv))
              greatest = std::max(greatest, mask.at(u + du, v + dv));
        ASSERT_EQ(grown.at(u, v), greatest) << u << ' ' << v << " radius " << radius_px;
      }
    }
  }
  EXPECT_TRUE(dilated({}, 5).empty());
  EXPECT_EQ(dilated(GreyImage(1, 1, 7), 5).at(0, 0), 7);
}

}  // namespace
}  // namespace ygslam
