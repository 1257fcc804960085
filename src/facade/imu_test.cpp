// Promises of Slam::push_imu that need no recording; how it carries a pose is tested with the
// system, the command line and Python.
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "facade/motion_inbox.hpp"
#include "facade/testing/film.hpp"
#include "geometry/imu.hpp"

namespace ygslam::api {
namespace {

using testing::code_of;
using testing::film;
using testing::kNan;
using testing::settings_for;

Settings with_imu() {
  Settings settings = settings_for(film("static_xyz"));
  settings.imu = Imu();
  return settings;
}

TEST(PushImu, WithoutAnImuItIsAnErrorAndNoReadingThatIsNoneIsTaken) {
  Slam without = Slam::open(settings_for(film("static_xyz")));
  EXPECT_EQ(code_of([&] { without.push_imu({}); }), 2);
  Slam slam = Slam::open(with_imu());
  EXPECT_EQ(code_of([&] { slam.push_imu({1, {0, kNan, 0}, {0, 0, 9.8}}); }), 4);
  EXPECT_EQ(code_of([&] { slam.push_imu({1, {0, 0, 0}, {0, 0, kNan}}); }), 4);
  EXPECT_EQ(code_of([&] { slam.push_imu({std::numeric_limits<std::int64_t>::min()}); }), 4);
  slam.push_imu({1, {0, 0, 0}, {0, 0, 9.8}});
}

TEST(PushImu, AnImuThatIsNoneIsRefusedWithAllItsFaults) {
  Settings settings = with_imu();
  settings.imu->rate_hz = 0;
  settings.imu->gyro_noise_radps_sqrthz = -1;
  settings.imu->T_camera_imu.rotation_xyzw = {0, 0, 0, 0};
  settings.imu->time_offset_s = kNan;
  try {
    static_cast<void>(Slam::open(settings));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code, 3);
    for (const char* word : {"rate_hz", "noise", "T_camera_imu", "time_offset_s"})
      EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << word;
  }
}

TEST(PushImu, AFileTellsWhereItIs) {
  EXPECT_EQ(code_of([] { static_cast<void>(Imu::read("/no/imu.yaml")); }), 3);
  const std::string path = ::testing::TempDir() + "facade_imu.yaml";
  std::ofstream(path)
      << "rate_hz: 100\ngyroscope_noise_density: 1e-4\ngyroscope_random_walk: 1e-6\n"
         "accelerometer_noise_density: 1e-3\naccelerometer_random_walk: 1e-5\n"
         "T_camera_imu: [0.1, 0, 0, 0, 0, 0, 1]\n";
  const Imu imu = Imu::read(path);
  EXPECT_EQ(imu.rate_hz, 100);
  EXPECT_EQ(imu.T_camera_imu.translation_m[0], 0.1);
  EXPECT_FALSE(imu.time_offset_s);
  std::ofstream(path) << "rate_hz: 100\n";
  EXPECT_EQ(code_of([&] { static_cast<void>(Imu::read(path)); }), 3);
}

TEST(PushImu, AThreadOfItsOwnMayCallIt) {
  const auto& seen = film("static_xyz");
  Slam slam = Slam::open(with_imu());
  std::atomic<bool> done = false;
  std::thread sensor([&] {
    for (std::int64_t t_ns = 0; !done; t_ns += 5'000'000)
      slam.push_imu({t_ns, {0, 0, 0}, {0, -9.8, 0}});
  });
  for (std::size_t i = 0; i < seen.size(); ++i)
    EXPECT_EQ(slam.process(seen[i]).state, State::kTracking);
  done = true;
  sensor.join();
}

Wheels some_wheels() { return {.T_base_camera = {{0, 0, 0.3}, {-0.5, 0.5, -0.5, 0.5}}}; }

TEST(PushOdometry, WithoutWheelsItIsAnErrorAndNoPoseThatIsNoneIsTaken) {
  Slam without = Slam::open(settings_for(film("static_xyz")));
  EXPECT_EQ(code_of([&] { without.push_odometry({}); }), 2);
  Settings settings = settings_for(film("static_xyz"));
  settings.wheels = some_wheels();
  Slam slam = Slam::open(settings);
  EXPECT_EQ(code_of([&] { slam.push_odometry({1, {{0, kNan, 0}}}); }), 4);
  EXPECT_EQ(code_of([&] { slam.push_odometry({1, {{0, 0, 0}, {0, 0, 0, 0}}}); }), 4);
  EXPECT_EQ(code_of([&] { slam.push_odometry({1, {{0, 1e300, 0}}}); }), 4);
  settings.wheels->T_base_camera.translation_m[0] = 1e300;
  EXPECT_EQ(code_of([&] { Slam::open(settings); }), 3);
  EXPECT_EQ(code_of([&] {
              slam.push_odometry({std::numeric_limits<std::int64_t>::min(), {}});
            }),
            4);
  slam.push_odometry({1, {}});
  const auto& seen = film("static_xyz");
  for (std::size_t i = 0; i < seen.size(); ++i)
    EXPECT_EQ(slam.process(seen[i]).state, State::kTracking);
}

TEST(PushOdometry, WheelsThatAreNoneAreRefusedWithAllTheirFaults) {
  Settings settings = settings_for(film("static_xyz"));
  settings.wheels = some_wheels();
  settings.wheels->way_scale = 1000;
  settings.wheels->turn_noise = kNan;
  settings.wheels->T_base_camera.rotation_xyzw = {0, 0, 0, 0};
  settings.wheels->time_offset_s = 100;
  try {
    static_cast<void>(Slam::open(settings));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code, 3);
    for (const char* word : {"way_scale", "turn_noise", "T_base_camera", "time_offset_s"})
      EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << word;
  }
}

TEST(PushOdometry, AFileTellsWhereTheCameraIs) {
  EXPECT_EQ(code_of([] { static_cast<void>(Wheels::read("/no/odom.yaml")); }), 3);
  const std::string path = ::testing::TempDir() + "facade_odom.yaml";
  std::ofstream(path) << "T_base_camera: [0.1, 0, 0.3, 0, 0, 0, 1]\nway_scale: 1.02\n";
  const Wheels wheels = Wheels::read(path);
  EXPECT_EQ(wheels.way_scale, 1.02);
  EXPECT_EQ(wheels.T_base_camera.translation_m[2], 0.3);
  std::ofstream(path) << "way_scale: 1000\n";
  EXPECT_EQ(code_of([&] { static_cast<void>(Wheels::read(path)); }), 3);
}

TEST(MotionInbox, KeepsOrderAndAnEnd) {
  MotionInbox<ImuSample> inbox;
  for (int i = 0; i < 3; ++i) inbox.put({{i}, Vec3::Zero(), Vec3::Zero()});
  const auto taken = inbox.take();
  ASSERT_EQ(taken.size(), 3U);
  EXPECT_EQ(taken[2].stamp.ns, 2);
  EXPECT_TRUE(inbox.take().empty());
  for (int i = 0; i < 25000; ++i) inbox.put({{i}, Vec3::Zero(), Vec3::Zero()});
  EXPECT_LE(inbox.take().size(), 10000U);
}

}  // namespace
}  // namespace ygslam::api
