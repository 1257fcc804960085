#include "simulation/sequence/inertial_files.hpp"

#include <iterator>
#include <vector>

#include "core/log.hpp"
#include "io/imu_calibration.hpp"
#include "io/imu_file.hpp"
#include "io/trajectory.hpp"
#include "io/wheel_calibration.hpp"
#include "simulation/sequence/sequence_writer.hpp"

namespace ygslam::sim {
namespace {

constexpr double kMargin_s = 0.1;
constexpr double kMostSideways = 0.02;  // of the way

std::string truth_text(const std::vector<ImuReading>& readings, Timestamp start) {
  std::string out =
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
      "q_RS_z [],v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],"
      "b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],"
      "b_a_RS_S_z [m s^-2]\n";
  for (const ImuReading& r : readings) {
    const Vec3 &p = r.truth.T_world_imu.t(), &v = r.truth.velocity_world_mps;
    const Vec3 &bw = r.gyro_bias_radps, &ba = r.accel_bias_mps2;
    const Eigen::Quaterniond q = r.truth.T_world_imu.quaternion();
    fmt::format_to(std::back_inserter(out),
                   "{},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},"
                   "{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f}\n",
                   start.ns + to_ns(r.t_s), p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), v.x(),
                   v.y(), v.z(), bw.x(), bw.y(), bw.z(), ba.x(), ba.y(), ba.z());
  }
  return out;
}

}  // namespace

ImuCalibration known_calibration(const ImuOptions& options) {
  ImuCalibration known;
  known.T_camera_imu = options.T_camera_imu;
  known.noise = options.model.noise;
  known.noise.rate_hz = options.rate_hz;
  // Of readings without any noise nothing can be estimated.
  const ImuNoise least{options.rate_hz, 1e-5, 1e-4, 2e-6, 9e-5};
  for (double ImuNoise::*const density :
       {&ImuNoise::gyro_noise_radps_sqrthz, &ImuNoise::accel_noise_mps2_sqrthz,
        &ImuNoise::gyro_walk_radps2_sqrthz, &ImuNoise::accel_walk_mps3_sqrthz})
    if (known.noise.*density == 0) known.noise.*density = least.*density;
  known.gyro_range_radps = options.model.gyro_range_radps;
  known.accel_range_mps2 = options.model.accel_range_mps2;
  return known;
}

Status write_imu_files(const std::filesystem::path& folder, const SequenceSource& source,
                       const ImuOptions& options, double until_s, bool truth) {
  const auto readings =
      imu_readings(source.path(), options, source.start(), -kMargin_s, until_s + kMargin_s);
  std::vector<ImuSample> samples;
  for (const ImuReading& reading : readings) samples.push_back(reading.sample);
  Status written = write_new_file(folder / kImuReadings, format_imu(samples));
  if (written.ok())
    written = write_new_file(
        folder / kImuPlace,
        format_imu_calibration(known_calibration(options),
                               fmt::format("{} on a rendered camera", options.model.name)));
  if (written.ok() && truth)
    written = write_new_file(folder / kImuTruth, truth_text(readings, source.start()));
  return written;
}

Status write_wheel_file(const std::filesystem::path& folder, const SequenceSource& source,
                        const WheelOptions& options, double until_s) {
  const WheelReadings readings =
      wheel_readings(source.path(), options, source.start(), -kMargin_s, until_s + kMargin_s);
  if (readings.sideways_m > kMostSideways * readings.way_m)
    log::warn(
        "--wheels: the camera moves sideways for {:.1f} m of its {:.1f} m, which wheels do not "
        "feel; a robot's path is `path: drive`",
        readings.sideways_m, readings.way_m);
  const Vec3& t = readings.T_base_camera.t();
  const Eigen::Quaterniond q = readings.T_base_camera.quaternion();
  std::string out = fmt::format(
      "# poses of the robot's base (x ahead, z up) as two wheels tell them\n"
      "# T_base_camera: {:.6f} {:.6f} {:.6f} {:.9f} {:.9f} {:.9f} {:.9f}\n"
      "# timestamp x y z qx qy qz qw\n",
      t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  for (const OdometrySample& sample : readings.samples)
    out += format_tum({sample.stamp, sample.T_odom_base}, 9);
  Status written = write_new_file(folder / kWheelPoses, out);
  if (!written.ok()) return written;
  const WheelCalibration known{.T_base_camera = readings.T_base_camera};
  return write_new_file(folder / kWheelPlace,
                        format_wheel_calibration(known, "two wheels below a rendered camera"));
}

}  // namespace ygslam::sim
