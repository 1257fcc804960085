#include "map/feature_fields.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"
#include "geometry/geometry_testing.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam::map_fields {
namespace {

Camera bent_camera() {
  CameraConfig config = geometry_test::test_camera().config();
  config.k1 = -0.1;
  config.k2 = 0.05;
  config.p1 = 0.001;
  return Camera(config);
}

/// @param shift_px how far a rolling shutter moves features, at most.
Features some_features(int count, const Camera& camera, double shift_px, Rng& rng) {
  Features features;
  for (int i = 0; i < count; ++i) {
    Feature f;
    f.uv_px = {static_cast<float>(rng.uniform(0, 639)), static_cast<float>(rng.uniform(0, 479))};
    const Vec2 shift = random_in_box<2>(rng, {-shift_px, -shift_px}, {shift_px, shift_px});
    f.ideal_px = (camera.undistort(f.uv_px.cast<double>()) + shift).cast<float>();
    f.depth_m = rng.uniform() < .8 ? static_cast<float>(rng.uniform(.3, 8)) : 0.0F;
    f.angle_rad = static_cast<float>(rng.uniform(0, 2 * std::numbers::pi));
    f.response = 5;
    f.octave = static_cast<std::uint8_t>(rng.below(32));
    f.on_depth_edge = rng.below(4) == 0;
    f.on_plane = rng.below(2) == 0;
    features.points.push_back(f);
    Descriptor d;
    for (auto& bits : d.bits) bits = rng.next();
    features.descriptors.push_back(d);
  }
  return features;
}

std::string written(const Features& features, const Camera* camera) {
  ArchiveWriter out;
  map_fields::features(out, features, camera);
  return out.bytes();
}

Features read_back(std::span<const char> bytes, const Camera* camera) {
  Features features;
  ArchiveReader in(bytes);
  map_fields::features(in, features, camera);
  in.check_end();
  EXPECT_TRUE(in.ok()) << in.fault();
  return features;
}

double turn_between(float a_rad, float b_rad) {
  return std::abs(std::remainder(double{a_rad} - b_rad, 2 * std::numbers::pi));
}

TEST(FeatureFields, ComeBackExactlyButForAngleAndStrength) {
  Rng rng(5);
  const Camera straight = geometry_test::test_camera();
  const Camera bent = bent_camera();
  for (const Camera* seen_by : {&straight, &bent})
    for (const double shift_px : {0.0, 8.0})
      for (const Camera* camera : {seen_by, static_cast<const Camera*>(nullptr)}) {
        const Features before = some_features(300, *seen_by, shift_px, rng);
        const std::string bytes = written(before, camera);
        const Features after = read_back(bytes, camera);
        ASSERT_EQ(after.size(), before.size());
        EXPECT_EQ(after.descriptors, before.descriptors);
        for (std::size_t i = 0; i < before.size(); ++i) {
          const Feature& a = before.points[i];
          const Feature& b = after.points[i];
          EXPECT_EQ(b.uv_px, a.uv_px);
          EXPECT_EQ(b.ideal_px, a.ideal_px);
          EXPECT_EQ(b.depth_m, a.depth_m);
          EXPECT_EQ(b.octave, a.octave);
          EXPECT_EQ(b.on_depth_edge, a.on_depth_edge);
          EXPECT_EQ(b.on_plane, a.on_plane);
          EXPECT_LE(turn_between(a.angle_rad, b.angle_rad), std::numbers::pi / kAngleParts + 1e-6);
          EXPECT_EQ(b.response, 0);
        }
        EXPECT_EQ(written(after, camera), bytes) << "saved again the same";
      }
}

/// Where all follows from the camera the columns of ideal_px are zeros.
TEST(FeatureFields, WhatTheCameraSaysIsNotKept) {
  Rng rng(6);
  const Camera camera = bent_camera();
  const Features features = some_features(100, camera, 0, rng);
  const std::string bytes = written(features, &camera);
  const std::size_t n = features.size();
  EXPECT_EQ(bytes.substr(4 + 8 * n, 8 * n), std::string(8 * n, '\0'));
  EXPECT_NE(written(features, nullptr).substr(4 + 8 * n, 8 * n), std::string(8 * n, '\0'));
}

TEST(FeatureFields, AnglesStayInTheTurn) {
  for (int code = 0; code < 256; ++code) {
    const float angle_rad = angle_of(static_cast<std::uint8_t>(code));
    EXPECT_EQ(angle_code(angle_rad), code);
    EXPECT_GE(angle_rad, 0);
    EXPECT_LT(angle_rad, 2 * std::numbers::pi);
  }
  EXPECT_EQ(angle_code(std::nextafter(static_cast<float>(2 * std::numbers::pi), 0.0F)), 0)
      << "the turn closes";
  EXPECT_EQ(angle_code(-static_cast<float>(std::numbers::pi / 2)), 192);
  EXPECT_EQ(angle_of(angle_code(1e30F)), angle_of(angle_code(1e30F))) << "of older files";
}

TEST(FeatureFields, DamageIsSeen) {
  Rng rng(7);
  const Camera camera = bent_camera();
  const std::string bytes = written(some_features(20, camera, 0, rng), &camera);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    ArchiveReader in(std::string_view(bytes).substr(0, length));
    Features features;
    map_fields::features(in, features, &camera);
    EXPECT_FALSE(in.ok()) << length;
  }
  for (int trial = 0; trial < 2000; ++trial) {  // refused, or features that can be kept again
    std::string damaged = bytes;
    damaged[rng.below(static_cast<std::uint32_t>(bytes.size()))] ^=
        static_cast<char>(1 + rng.below(255));
    ArchiveReader in(damaged);
    Features features;
    map_fields::features(in, features, &camera);
    in.check_end();
    if (!in.ok()) continue;
    const std::string again = written(features, &camera);
    EXPECT_EQ(written(read_back(again, &camera), &camera), again);
  }
}

std::string written_weights(const std::vector<float>& weight) {
  ArchiveWriter out;
  static_weight(out, weight);
  return out.bytes();
}

TEST(WeightFields, ComeBackExactly) {
  Rng rng(8);
  for (const double other : {0.0, 0.2, 1.0}) {
    std::vector<float> weight(500);
    for (float& w : weight)
      w = rng.uniform() < other ? static_cast<float>(rng.uniform()) : rng.below(2);
    const std::string bytes = written_weights(weight);
    ArchiveReader in(bytes);
    std::vector<float> back;
    static_weight(in, back);
    in.check_end();
    ASSERT_TRUE(in.ok()) << in.fault();
    EXPECT_EQ(back, weight);
    EXPECT_EQ(written_weights(back), bytes);
    if (other == 0) {
      EXPECT_EQ(bytes.size(), 4 + weight.size());
    }
  }
}

TEST(WeightFields, DamageIsSeen) {
  const std::string bytes = written_weights({0, 1, 0.5F, 0.25F, 1});
  const auto fault_of = [](std::string_view damaged) {
    ArchiveReader in(damaged);
    std::vector<float> weight;
    static_weight(in, weight);
    in.check_end();
    return std::string(in.ok() ? "" : in.fault());
  };
  EXPECT_EQ(fault_of(bytes), "");
  for (std::size_t length = 0; length < bytes.size(); ++length)
    EXPECT_NE(fault_of(std::string_view(bytes).substr(0, length)), "") << length;
  std::string damaged = bytes;
  damaged[4] = 3;
  EXPECT_EQ(fault_of(damaged), "a weight of no kind");
  damaged = written_weights({2});
  EXPECT_EQ(fault_of(damaged), kNoWeight);
  damaged = written_weights({-0.5F});
  EXPECT_EQ(fault_of(damaged), kNoWeight);
  // A row of zeros, which takes a few bytes of a file, must not fill the memory.
  EXPECT_EQ(fault_of(std::string("\0\0\0\x03", 4) + std::string(3U << 24, '\0')),
            "cut short, or a count too large");
}

}  // namespace
}  // namespace ygslam::map_fields
