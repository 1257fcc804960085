#include "simulation/sequence/inertial_files.hpp"

#include "core/log.hpp"
#include "io/imu_calibration.hpp"
#include "io/imu_file.hpp"
#include "io/testing/temp_folder.hpp"
#include "io/trajectory_formats.hpp"
#include "io/wheel_calibration.hpp"
#include "simulation/sequence/test_worlds.hpp"

namespace ygslam::sim {
namespace {

// The readers take what is written here for what it is, and doubt nothing: hands and steps are no
// faults of a sensor.
TEST(InertialFiles, AreReadBackWithoutDoubts) {
  const ygslam::testing::TempFolder folder;
  std::string warnings;
  const log::ScopedSink sink(
      std::make_shared<const log::Sink>([&](log::Level level, const std::string& line) {
        if (level != log::Level::kInfo) warnings += line + "\n";
      }));
  for (const char* world : {"walking_rpy", "walking_static", "corridor_loop", "robot_rounds"}) {
    const SequenceSource source = open_or_die(world, small_options(20, 10));
    for (const ImuModel& model : imu_models()) {
      ImuOptions options;
      options.model = model;
      options.uncalibrated_share = 1;
      ASSERT_TRUE(write_imu_files(folder.path(), source, options, 20, true).ok());
      const auto samples = read_imu(folder.path() / kImuReadings);
      ASSERT_TRUE(samples.ok()) << samples.error().message;
      EXPECT_NEAR(seconds_between(samples->back().stamp, source.start()), 20.1, 0.0051);
      EXPECT_GE(samples->back().stamp.ns, source.start().ns + 20'100'000'000);
      EXPECT_EQ(samples->front().stamp.ns, source.start().ns - 100'000'000);
      const auto known = read_imu_calibration(folder.path() / kImuPlace);
      ASSERT_TRUE(known.ok()) << known.error().message;
      EXPECT_EQ(known->noise.accel_noise_mps2_sqrthz,
                known_calibration(options).noise.accel_noise_mps2_sqrthz);
      EXPECT_LT((known->T_camera_imu.inverse() * options.T_camera_imu).log().norm(), 1e-9);
      EXPECT_EQ(warnings, "") << world << " " << model.name;
    }
  }
}

TEST(InertialFiles, OdometryIsATrajectoryLikeAnyOther) {
  const ygslam::testing::TempFolder folder;
  const SequenceSource source = open_or_die("robot_rounds", small_options(5, 5));
  ASSERT_TRUE(write_wheel_file(folder.path(), source, {}, 5).ok());
  const auto poses = read_stamped_trajectory(folder.path() / kWheelPoses);
  ASSERT_TRUE(poses.ok()) << poses.error().message;
  const WheelReadings readings = wheel_readings(source.path(), {}, source.start(), -0.1, 5.1);
  ASSERT_EQ(poses->size(), readings.samples.size());
  for (std::size_t i = 0; i < poses->size(); ++i) {
    EXPECT_EQ((*poses)[i].stamp, readings.samples[i].stamp);
    const SE3 error = (*poses)[i].T_world_camera.inverse() * readings.samples[i].T_odom_base;
    EXPECT_LT(error.log().norm(), 1e-7);
  }
  const auto known = read_wheel_calibration(folder.path() / kWheelPlace);
  ASSERT_TRUE(known.ok()) << known.error().message;
  EXPECT_LT((known->T_base_camera.inverse() * readings.T_base_camera).log().norm(), 1e-9);
}

}  // namespace
}  // namespace ygslam::sim
