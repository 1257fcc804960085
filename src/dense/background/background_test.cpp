#include "dense/background/background.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

constexpr double kWall_m = 2.0;

CameraConfig wall_camera() {
  CameraConfig c;
  c.fx = c.fy = 130, c.cx = 79.5, c.cy = 59.5, c.width = 160, c.height = 120;
  return c;
}

Rgb8 wall_colour(const Vec3& p) {
  const auto wave = [](double x) { return static_cast<std::uint8_t>(128 + 60 * std::sin(6 * x)); };
  return {wave(p.x()), wave(p.y()), 90};
}

struct Box {
  int left, top, right, bottom;  // [px]
  [[nodiscard]] bool contains(int u, int v) const {
    return u >= left && u < right && v >= top && v < bottom;
  }
};

/// The wall z = kWall_m, and before it a red object that fills a part of the picture.
RgbdFrame wall_behind(const Camera& camera, const SE3& T_world_camera, const Box& thing) {
  RgbdFrame frame;
  frame.id = FrameId{0};
  frame.colour = ColourImage(camera.width(), camera.height());
  frame.depth_m = DepthImage(camera.width(), camera.height());
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const Vec3 ray = T_world_camera.R() * camera.unproject({u, v}, 1.0);
      const double depth_m = (kWall_m - T_world_camera.t().z()) / ray.z();
      const bool hidden = thing.contains(u, v);
      frame.depth_m.at(u, v) = hidden ? 1.0F : static_cast<float>(depth_m);
      frame.colour.at(u, v) =
          hidden ? Rgb8{250, 0, 0} : wall_colour(T_world_camera.t() + depth_m * ray);
    }
  }
  return frame;
}

GreyImage mask_of(const Box& thing) {
  GreyImage mask(160, 120);
  for (int v = 0; v < 120; ++v)
    for (int u = 0; u < 160; ++u)
      if (thing.contains(u, v)) mask.at(u, v) = 255;
  return mask;
}

SE3 pose_at(double x) { return SE3(so3_exp(Vec3(0.02, -0.1 * x, 0.01)), Vec3(x, 0.02, 0)); }

constexpr Box kNone{0, 0, 0, 0};

/// Four views of the wall with an object in the same place of each picture.
DenseMap wall_map(const Camera& camera, const Box& thing) {
  DenseMap map({}, camera);
  DenseUpdate update;
  for (std::uint32_t i = 0; i < 4; ++i) {
    const SE3 T_world_camera = pose_at(0.05 * i);
    update.T_world_camera[KeyframeId{i}] = T_world_camera;
    update.added.push_back({KeyframeId{i},
                            std::make_shared<RgbdFrame>(wall_behind(camera, T_world_camera, thing)),
                            {},
                            mask_of(thing),
                            {},
                            {}});
  }
  map.apply(update);
  map.finish();
  return map;
}

constexpr std::uint8_t source(PixelSource value) { return static_cast<std::uint8_t>(value); }

TEST(Background, ShowsTheRoomInPlaceOfAMover) {
  const Camera camera(wall_camera());
  DenseMap map = wall_map(camera, kNone);
  const Box thing{60, 30, 100, 90};
  const SE3 T_world_camera = pose_at(0.08);
  const RgbdFrame frame = wall_behind(camera, T_world_camera, thing);
  const RgbdFrame truth = wall_behind(camera, T_world_camera, kNone);
  const FrameGeometry geometry(camera, T_world_camera, {});
  const GreyImage hidden = hidden_pixels(frame, mask_of(thing), geometry, map);
  const BackgroundPicture picture = Background(map).step(frame, hidden, geometry);
  int shown = 0;
  for (int v = 0; v < 120; ++v) {
    for (int u = 0; u < 160; ++u) {
      ASSERT_NEAR(picture.depth_m.at(u, v), truth.depth_m.at(u, v), 0.01) << u << ' ' << v;
      ASSERT_NEAR(picture.colour.at(u, v).r, truth.colour.at(u, v).r, 8) << u << ' ' << v;
      ASSERT_NEAR(picture.colour.at(u, v).g, truth.colour.at(u, v).g, 8);
      shown += picture.source.at(u, v) == source(PixelSource::kView) ? 1 : 0;
      if (hidden.at(u, v) == 0) {
        ASSERT_EQ(picture.source.at(u, v), source(PixelSource::kFrame));
        ASSERT_EQ(picture.colour.at(u, v), frame.colour.at(u, v));
        ASSERT_EQ(picture.depth_m.at(u, v), frame.depth_m.at(u, v));
      }
    }
  }
  EXPECT_GE(shown, 40 * 60) << "the mover, and a margin around it";
  EXPECT_LE(shown, 60 * 80);
}

TEST(Background, SaysWhatWasNeverSeen) {
  const Camera camera(wall_camera());
  const Box always{50, 20, 110, 100}, now{70, 50, 80, 60};
  DenseMap map = wall_map(camera, always);
  const SE3 T_world_camera = pose_at(0.08);
  const RgbdFrame frame = wall_behind(camera, T_world_camera, now);
  const FrameGeometry geometry(camera, T_world_camera, {});
  const GreyImage hidden = hidden_pixels(frame, mask_of(now), geometry, map);
  const BackgroundPicture picture = Background(map).step(frame, hidden, geometry);
  for (int v = 0; v < 120; ++v) {
    for (int u = 0; u < 160; ++u) {
      if (hidden.at(u, v) == 0) continue;
      ASSERT_EQ(picture.source.at(u, v), source(PixelSource::kNever));
      ASSERT_EQ(picture.depth_m.at(u, v), 0);
      ASSERT_EQ(picture.colour.at(u, v), Rgb8{});
    }
  }
}

TEST(Background, FindsWhatStandsInFreeSpaceWithoutAMask) {
  const Camera camera(wall_camera());
  const DenseMap map = wall_map(camera, kNone);
  const Box thing{60, 30, 100, 90}, small{20, 20, 26, 26};
  const FrameGeometry geometry(camera, pose_at(0.08), {});
  const GreyImage hidden =
      hidden_pixels(wall_behind(camera, pose_at(0.08), thing), {}, geometry, map);
  for (int v = 0; v < 120; ++v)
    for (int u = 0; u < 160; ++u)
      ASSERT_TRUE(!thing.contains(u, v) || hidden.at(u, v) == 255) << u << ' ' << v;
  const auto count = [](const GreyImage& mask) {
    return std::count(mask.begin(), mask.end(), 255);
  };
  EXPECT_LT(count(hidden), 60 * 80) << "the wall is none";
  EXPECT_EQ(count(hidden_pixels(wall_behind(camera, pose_at(0.08), small), {}, geometry, map)), 0)
      << "thin things that the map does not hold are part of the room";
}

TEST(Background, LearnsWhatKeyframesDoNotShow) {
  const Camera camera(wall_camera());
  const Box always{50, 20, 110, 100};
  DenseMap map = wall_map(camera, always);
  const RgbdFrame frame = wall_behind(camera, pose_at(0.08), kNone);
  const FrameGeometry geometry(camera, pose_at(0.08), {});
  const GreyImage nothing(160, 120);
  EXPECT_TRUE(add_what_is_new(frame, nothing, geometry, {}, map));
  EXPECT_TRUE(add_what_is_new(frame, nothing, geometry, {}, map)) << "one view is not believed";
  EXPECT_FALSE(add_what_is_new(frame, nothing, geometry, {}, map));
  const GreyImage hidden = hidden_pixels(frame, mask_of(always), geometry, map);
  const BackgroundPicture picture = Background(map).step(frame, hidden, geometry);
  EXPECT_EQ(picture.source.at(80, 60), source(PixelSource::kView));
}

TEST(FrameGeometry, ProjectsToWhereItWasUnprojectedFrom) {
  CameraConfig config = wall_camera();
  config.k1 = 0.1, config.p1 = 0.01;
  const Camera camera(config);
  ReadOut read_out{{0.03, 0.03, 0}, {}};
  read_out.body_velocity << 0.5, -0.2, 0.1, 0.3, 0.6, -0.4;
  for (const ReadOut& how : {ReadOut{}, read_out}) {
    const FrameGeometry geometry(camera, pose_at(0.3), how);
    for (int v = 5; v < 120; v += 10) {
      for (int u = 5; u < 160; u += 10) {
        const auto seen = geometry.project(geometry.unproject(u, v, 1.7F));
        ASSERT_TRUE(seen);
        ASSERT_NEAR(seen->uv_px.x(), u, 0.02);
        ASSERT_NEAR(seen->uv_px.y(), v, 0.02);
        ASSERT_NEAR(seen->z_m, 1.7, 1e-3);
      }
    }
  }
}

}  // namespace
}  // namespace ygslam
