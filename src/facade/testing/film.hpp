// For tests of the library: rendered frames, and short ways to run them.
#pragma once

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "simulation/sequence/sequence_source.hpp"
#include "ygslam/slam.hpp"

namespace ygslam::api::testing {

inline constexpr int kWidth = 320, kHeight = 240;
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Rendered frames, kept for all tests.
struct Film {
  CameraModel camera;
  std::vector<std::shared_ptr<const sim::SimulatedFrame>> frames;

  [[nodiscard]] Frame operator[](std::size_t i) const {
    const RgbdFrame& f = *frames[i]->frame;
    return {f.stamp.ns, reinterpret_cast<const std::uint8_t*>(f.colour.data()), f.depth_m.data()};
  }
  [[nodiscard]] std::size_t size() const { return frames.size(); }
};

inline const Film& film(const std::string& world) {
  static std::map<std::string, Film> films;
  Film& film = films[world];
  if (!film.frames.empty()) return film;
  sim::SequenceOptions options;
  options.seconds = world == "moving_box" ? 6 : 1.5;  // a mover is one after half a second
  options.fps = 20;
  options.width = kWidth;
  options.height = kHeight;
  options.texture_size = 256;
  options.antialias = false;
  if (world == "walking_rpy") options.rolling = 0.8;
  auto source = sim::open_world(world, options);
  CHECK(source.ok(), "the world is known");
  const CameraConfig c = source->camera().config();
  film.camera = {
      .fx = c.fx, .fy = c.fy, .cx = c.cx, .cy = c.cy, .width = kWidth, .height = kHeight};
  while (auto frame = source->next())
    film.frames.push_back(std::make_shared<const sim::SimulatedFrame>(std::move(*frame)));
  return film;
}

inline Settings settings_for(const Film& film) {
  Settings settings;
  settings.camera = film.camera;
  settings.segmenter = "none";
  settings.options = {{"orb.features", "500"}};
  return settings;
}

inline Settings deterministic_for(const Film& film) {
  Settings settings = settings_for(film);
  settings.deterministic = true;
  return settings;
}

/// The code of the Error that the call throws, 0 without one; its text goes to `message`.
template <typename Call>
int code_of(Call call, std::string* message = nullptr) {
  try {
    call();
    return 0;
  } catch (const Error& e) {
    if (message) *message = e.what();
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    return e.code;
  }
}

/// Everything an object says about a film.
struct Record {
  std::vector<Result> results;
  Outcome outcome;
};

inline Record run(const Settings& settings, const Film& film) {
  Slam slam = Slam::open(settings);
  Record record;
  for (std::size_t i = 0; i < film.size(); ++i) record.results.push_back(slam.process(film[i]));
  record.outcome = slam.finish();
  return record;
}

inline bool same(const Pose& a, const Pose& b) {
  return a.translation_m == b.translation_m && a.rotation_xyzw == b.rotation_xyzw;
}

inline void expect_same(const Outcome& a, const Outcome& b) {
  ASSERT_EQ(a.trajectory.size(), b.trajectory.size());
  for (std::size_t i = 0; i < a.trajectory.size(); ++i) {
    EXPECT_EQ(a.trajectory[i].t_ns, b.trajectory[i].t_ns);
    EXPECT_TRUE(same(a.trajectory[i].T_world_camera, b.trajectory[i].T_world_camera)) << i;
  }
  ASSERT_EQ(a.static_map.size(), b.static_map.size());
  for (std::size_t i = 0; i < a.static_map.size(); ++i) {
    const MapPoint &p = a.static_map[i], &q = b.static_map[i];
    ASSERT_TRUE(p.x_m == q.x_m && p.y_m == q.y_m && p.z_m == q.z_m && p.r == q.r && p.g == q.g &&
                p.b == q.b);
  }
}

}  // namespace ygslam::api::testing
