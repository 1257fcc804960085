// What Slam::process() takes besides contiguous RGB and registered depth in metres.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "facade/testing/film.hpp"

namespace ygslam::api {
namespace {

using testing::code_of;
using testing::deterministic_for;
using testing::Film;
using testing::film;
using testing::kHeight;
using testing::kNan;
using testing::kWidth;
using testing::same;
using testing::settings_for;

constexpr std::size_t kFrames = 6;
constexpr std::size_t kPixels = static_cast<std::size_t>(kWidth) * kHeight;

/// The results of a film's first frames, each changed before.
template <typename Change>
std::vector<Result> results_of(const Settings& settings, const Film& seen, const Change& change) {
  Slam slam = Slam::open(settings);
  std::vector<Result> results;
  for (std::size_t i = 0; i < kFrames; ++i) {
    Frame frame = seen[i];
    change(frame);
    results.push_back(slam.process(frame));
  }
  return results;
}

void expect_same_poses(const std::vector<Result>& a, const std::vector<Result>& b) {
  for (std::size_t i = 0; i < kFrames; ++i) {
    EXPECT_EQ(a[i].state, State::kTracking) << i;
    EXPECT_TRUE(same(a[i].T_world_camera, b[i].T_world_camera)) << i;
  }
}

/// With so many bytes more in each row.
template <typename T>
std::vector<T> padded(const T* from, std::size_t row, std::size_t more) {
  std::vector<T> rows(kHeight * (row + more), T{77});
  for (std::size_t v = 0; v < kHeight; ++v)
    std::copy_n(from + v * row, row, rows.data() + v * (row + more));
  return rows;
}

TEST(Input, RowsMayBeApartAndColoursTheOtherWayRound) {
  const Film& seen = film("static_xyz");
  const Settings settings = deterministic_for(seen);
  const auto plain = results_of(settings, seen, [](Frame&) {});
  std::vector<std::uint8_t> bgr;
  std::vector<float> depth_m;
  const auto odd = results_of(settings, seen, [&](Frame& frame) {
    bgr.assign(frame.rgb, frame.rgb + 3 * kPixels);
    for (std::size_t i = 0; i < kPixels; ++i) std::swap(bgr[3 * i], bgr[3 * i + 2]);
    bgr = padded(bgr.data(), 3 * kWidth, 7);
    depth_m = padded(frame.depth_m, kWidth, 3);
    frame.rgb = bgr.data();
    frame.colour = ColourOrder::kBgr;
    frame.colour_stride = 3 * kWidth + 7;
    frame.depth_m = depth_m.data();
    frame.depth_stride = (kWidth + 3) * sizeof(float);
  });
  expect_same_poses(odd, plain);
}

TEST(Input, GreyIsEnough) {
  const Film& seen = film("static_xyz");
  std::vector<std::uint8_t> grey(kPixels);
  const auto results = results_of(deterministic_for(seen), seen, [&](Frame& frame) {
    for (std::size_t i = 0; i < kPixels; ++i) grey[i] = frame.rgb[3 * i + 1];
    frame.rgb = grey.data();
    frame.colour = ColourOrder::kMono;
  });
  for (const Result& result : results) EXPECT_EQ(result.state, State::kTracking);
}

TEST(Input, RawDepthIsMetresByItsScale) {
  const Film& seen = film("static_xyz");
  const Settings settings = deterministic_for(seen);
  std::vector<std::uint16_t> raw(kPixels);
  std::vector<float> metres(kPixels);
  const auto quantise = [&](const Frame& frame) {
    for (std::size_t i = 0; i < kPixels; ++i) {
      raw[i] = static_cast<std::uint16_t>(std::lround(frame.depth_m[i] * 1000));
      metres[i] = static_cast<float>(raw[i] * 0.001);
    }
  };
  const auto in_metres = results_of(settings, seen, [&](Frame& frame) {
    quantise(frame);
    frame.depth_m = metres.data();
  });
  const auto as_raw = results_of(settings, seen, [&](Frame& frame) {
    quantise(frame);
    frame.depth_m = nullptr;
    frame.depth_raw = raw.data();
    frame.depth_scale = 1000;
  });
  expect_same_poses(as_raw, in_metres);
}

TEST(Input, DepthOfACameraOfItsOwnIsRegistered) {
  const Film& seen = film("static_xyz");
  Settings settings = deterministic_for(seen);
  CameraModel half = seen.camera;  // every second pixel of every second row
  half.fx /= 2, half.fy /= 2, half.cx /= 2, half.cy /= 2, half.width /= 2, half.height /= 2;
  settings.depth_camera = DepthCamera{half, {}};
  std::vector<float> depth_m(kPixels / 4);
  const auto results = results_of(settings, seen, [&](Frame& frame) {
    for (int v = 0; v < half.height; ++v)
      for (int u = 0; u < half.width; ++u)
        depth_m[static_cast<std::size_t>(v * half.width + u)] =
            frame.depth_m[2 * v * kWidth + 2 * u];
    frame.depth_m = depth_m.data();
  });
  const SE3 T_start = seen.frames[0]->T_world_camera;
  for (std::size_t i = 0; i < kFrames; ++i) {
    EXPECT_EQ(results[i].state, State::kTracking);
    const Vec3 truth = (T_start.inverse() * seen.frames[i]->T_world_camera).t();
    const auto& t = results[i].T_world_camera.translation_m;
    EXPECT_LT((truth - Vec3(t[0], t[1], t[2])).norm(), 0.03) << i;
  }
  settings.depth_camera->camera.fx = 0;
  EXPECT_EQ(code_of([&] { Slam::open(settings); }), 3);
  settings.depth_camera = DepthCamera{half, {{kNan, 0, 0}, {0, 0, 0, 1}}};
  EXPECT_EQ(code_of([&] { Slam::open(settings); }), 3);
}

TEST(Input, MasksOfOnesOwnLeaveTheirPixelsOut) {
  const Film& seen = film("static_xyz");
  Settings settings = deterministic_for(seen);
  settings.dynamic = "semantic";
  std::vector<std::uint8_t> ids(kPixels);  // the left half is somebody
  for (std::size_t i = 0; i < kPixels; ++i) ids[i] = i % kWidth < kWidth / 2 ? 1 : 0;
  const auto without = results_of(settings, seen, [](Frame&) {});
  settings.segmenter = "frames";
  for (const bool deterministic : {true, false}) {
    settings.deterministic = deterministic;
    const auto with = results_of(settings, seen, [&](Frame& frame) {
      frame.instance_ids = ids.data();
      frame.instances = {{"person", 0.9F}};
    });
    EXPECT_EQ(without.back().mask_age_frames, -1);
    EXPECT_EQ(with.back().mask_age_frames, 0) << "each frame waits for its own";
    EXPECT_EQ(with.back().state, State::kTracking);
    EXPECT_LT(with.back().static_points, 0.8 * without.back().static_points);
    const auto nobody = results_of(settings, seen, [](Frame&) {});
    EXPECT_EQ(nobody.back().mask_age_frames, -1) << "nobody looked";
  }
}

TEST(Input, WhatIsWrongWithAFrameIsCode4) {
  const Film& seen = film("static_xyz");
  Settings settings = deterministic_for(seen);
  settings.segmenter = "frames";
  settings.dynamic = "semantic";
  Slam slam = Slam::open(settings);
  const std::vector<std::uint16_t> raw(kPixels, 1000);
  std::vector<std::uint8_t> ids(kPixels, 0);
  ids.back() = 2;
  const auto refused = [&](auto change) {
    Frame frame = seen[0];
    change(frame);
    std::string said;
    EXPECT_EQ(code_of([&] { slam.process(frame); }, &said), 4);
    EXPECT_FALSE(said.empty());
    EXPECT_EQ(code_of([&] { slam.push(frame); }), 4);
  };
  refused([&](Frame& f) { f.depth_raw = raw.data(), f.depth_scale = 1000; });
  for (const double scale : {0.0, -1.0, kNan, std::numeric_limits<double>::infinity()})
    refused(
        [&](Frame& f) { f.depth_m = nullptr, f.depth_raw = raw.data(), f.depth_scale = scale; });
  refused([](Frame& f) { f.colour_stride = 3 * kWidth - 1; });
  refused([](Frame& f) { f.depth_stride = 1; });
  refused([](Frame& f) { f.instances = {{"person", 1}}; });
  refused([&](Frame& f) { f.instance_ids = ids.data(), f.instances = {{"person", 1}}; });
  refused([&](Frame& f) { f.instance_ids = ids.data(), f.instance_stride = kWidth - 1; });
  refused([&](Frame& f) { f.instance_ids = ids.data(), f.instances = {{"person"}, {"ghost"}}; });
  refused([&](Frame& f) { f.instance_ids = ids.data(), f.instances = {{"person"}, {"cat", NAN}}; });
  refused([&](Frame& f) { f.instance_ids = ids.data(), f.instances.resize(256); });
  refused([](Frame& f) { f.T_last_camera = Pose{{kNan, 0, 0}, {0, 0, 0, 1}}; });
  refused([](Frame& f) { f.T_last_camera = Pose{{0, 0, 0}, {0, 0, 0, 2}}; });
  settings.segmenter = "none";
  Slam other = Slam::open(settings);
  Frame frame = seen[0];
  frame.instance_ids = ids.data();
  EXPECT_EQ(code_of([&] { other.process(frame); }), 4) << "it does not take them";
  EXPECT_EQ(slam.process(seen[0]).state, State::kTracking) << "none of it left a trace";
}

}  // namespace
}  // namespace ygslam::api
