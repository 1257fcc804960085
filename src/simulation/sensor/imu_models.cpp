#include "simulation/sensor/imu_models.hpp"

#include <algorithm>
#include <array>
#include <numbers>

namespace ygslam::sim {
namespace {

constexpr double kDeg = std::numbers::pi / 180;
constexpr double kMicroG = 1e-6 * kStandardGravity_mps2;
constexpr double kMilliG = 1e-3 * kStandardGravity_mps2;
// No data sheet tells the random walk of the bias. These are measured on a Bosch BMI160 of the same
// kind (Allan deviation; Schubert et al. 2018, "The TUM VI benchmark", section III).
constexpr double kGyroWalk = 2.2e-6;   // [rad/s^2/sqrt(Hz)]
constexpr double kAccelWalk = 8.6e-5;  // [m/s^3/sqrt(Hz)]
// Ranges as RealSense sets them: 1000 degrees a second, 4 g.
constexpr double kGyroRange = 1000 * kDeg;
constexpr double kAccelRange = 4 * kStandardGravity_mps2;
constexpr double kGyroStep = 2 * kGyroRange / 65536;
constexpr double step_of_bits(int bits) { return 2 * kAccelRange / (1 << bits); }

// Typical values at 25 degrees Celsius. Bosch BST-BMI055-DS000-08 and BST-BMI085-DS001, TDK
// DS-000347 (ICM-42688-P): noise density, zero-rate and zero-g offset, sensitivity tolerance,
// cross-axis sensitivity. Bosch tells no tolerance for the accelerometers' sensitivity: 1 % is
// ours.
constexpr std::array kModels = {
    ImuModel{.name = "ideal", .noise = {200, 0, 0, 0, 0}},
    ImuModel{.name = "BMI055",
             .noise = {200, 0.014 * kDeg, 150 * kMicroG, kGyroWalk, kAccelWalk},
             .gyro_offset_radps = 1 * kDeg,
             .accel_offset_mps2 = 70 * kMilliG,
             .gyro_scale = 0.01,
             .accel_scale = 0.01,
             .gyro_misalignment_rad = 0.01,
             .accel_misalignment_rad = 0.01,
             .gyro_range_radps = kGyroRange,
             .accel_range_mps2 = kAccelRange,
             .gyro_step_radps = kGyroStep,
             .accel_step_mps2 = step_of_bits(12)},
    ImuModel{.name = "BMI085",
             .noise = {200, 0.014 * kDeg, 120 * kMicroG, kGyroWalk, kAccelWalk},
             .gyro_offset_radps = 1 * kDeg,
             .accel_offset_mps2 = 16 * kMilliG,
             .gyro_scale = 0.01,
             .accel_scale = 0.01,
             .gyro_misalignment_rad = 0.01,
             .accel_misalignment_rad = 0.005,
             .gyro_range_radps = kGyroRange,
             .accel_range_mps2 = kAccelRange,
             .gyro_step_radps = kGyroStep,
             .accel_step_mps2 = step_of_bits(16)},
    ImuModel{.name = "ICM-42688",
             .noise = {200, 0.0028 * kDeg, 70 * kMicroG, kGyroWalk, kAccelWalk},
             .gyro_offset_radps = 0.5 * kDeg,
             .accel_offset_mps2 = 20 * kMilliG,
             .gyro_scale = 0.005,
             .accel_scale = 0.005,
             .gyro_misalignment_rad = 0.0125,
             .accel_misalignment_rad = 0.01,
             .gyro_range_radps = kGyroRange,
             .accel_range_mps2 = kAccelRange,
             .gyro_step_radps = kGyroStep,
             .accel_step_mps2 = step_of_bits(16)},
};

}  // namespace

std::span<const ImuModel> imu_models() { return kModels; }

const ImuModel* find_imu_model(std::string_view name) {
  const auto* found = std::find_if(kModels.begin(), kModels.end(),
                                   [&](const ImuModel& model) { return model.name == name; });
  return found == kModels.end() ? nullptr : found;
}

}  // namespace ygslam::sim
