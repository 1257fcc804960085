#include "app/simulation_recorder.hpp"

#include <cstring>

#include "bag/imu_messages.hpp"
#include "bag/ros_images.hpp"
#include "image/depth.hpp"
#include "io/image_file.hpp"
#include "live/run_messages.hpp"

namespace ygslam {
namespace {

constexpr const char* kDepthFrame = "depth_optical";
constexpr const char* kImuFrame = "imu";
constexpr const char* kBaseFrame = "base_link";
constexpr const char* kWheelFrame = "wheel_odom";
constexpr std::int64_t kAfterLast_ns = 100'000'000;
constexpr int kJpegQuality = 95;  // as in the files

ros::Image depth_message(const DepthImage& depth_m, Timestamp stamp, const char* frame) {
  ros::Image message;
  message.header = {ros::to_ros(stamp), frame};
  message.width = static_cast<std::uint32_t>(depth_m.width());
  message.height = static_cast<std::uint32_t>(depth_m.height());
  message.encoding = "16UC1";
  message.step = 2 * message.width;
  const Image<std::uint16_t> raw = raw_from_depth(depth_m, ros::kMillimetres);
  message.data.resize(2 * raw.size());
  std::memcpy(message.data.data(), raw.data(), message.data.size());
  return message;
}

}  // namespace

TrackResult TrueResults::of(const sim::SimulatedFrame& frame) {
  if (!T_first_world_) T_first_world_ = frame.T_world_camera.inverse();
  TrackResult result;
  result.state = TrackState::kTracking;
  result.T_world_camera = result.T_odom_camera = *T_first_world_ * frame.T_world_camera;
  return result;
}

std::vector<ColouredPoint> visible_points(const sim::SimulatedFrame& frame, const Camera& camera,
                                          const SE3& T_world_camera) {
  constexpr int kStep_px = 4;
  std::vector<ColouredPoint> points;
  const DepthImage& depth_m = frame.depth_true_m;
  for (int v = 0; v < depth_m.height(); v += kStep_px)
    for (int u = 0; u < depth_m.width(); u += kStep_px) {
      if (!(depth_m.at(u, v) > 0)) continue;
      const Vec2 ideal_px = camera.undistort({static_cast<double>(u), static_cast<double>(v)});
      const Vec3 p_world = T_world_camera * camera.unproject(ideal_px, depth_m.at(u, v));
      points.push_back({p_world.cast<float>(), frame.frame->colour.at(u, v)});
    }
  return points;
}

Result<SimulationRecorder> SimulationRecorder::create(const std::filesystem::path& file,
                                                      const sim::SequenceSource& source,
                                                      bool jpeg) {
  auto writer = McapWriter::create(file);
  if (!writer.ok()) return writer.error();
  return SimulationRecorder(std::move(writer).value(), source, jpeg);
}

Status SimulationRecorder::place_sensors(Timestamp stamp) {
  if (std::exchange(is_placed_, true)) return Ok{};
  ros::TfMessage places;
  const auto place = [&](const char* frame, const SE3& T_camera_frame) {
    places.transforms.push_back(
        {{ros::to_ros(stamp), kCameraFrame}, frame, ros::to_ros(T_camera_frame)});
  };
  if (depth_camera_) place(kDepthFrame, depth_camera_->T_colour_depth);
  if (!sensors_.imu.empty()) place(kImuFrame, sensors_.imu_calibration.T_camera_imu);
  if (!sensors_.wheels.empty()) place(kBaseFrame, sensors_.T_base_camera.inverse());
  return places.transforms.empty() ? Status(Ok{}) : write("/tf_static", stamp, places);
}

Status SimulationRecorder::add_readings(Timestamp until) {
  Status status = Ok{};
  for (; next_imu_ < sensors_.imu.size(); ++next_imu_) {
    const ImuSample& sample = sensors_.imu[next_imu_];
    if (sample.stamp > until || !status.ok()) break;
    status =
        write("/imu", sample.stamp, ros::to_ros(sample, sensors_.imu_calibration.noise, kImuFrame));
  }
  for (; next_wheels_ < sensors_.wheels.size(); ++next_wheels_) {
    const OdometrySample& sample = sensors_.wheels[next_wheels_];
    if (sample.stamp > until || !status.ok()) break;
    ros::Odometry message;
    message.header = {ros::to_ros(sample.stamp), kWheelFrame};
    message.child_frame_id = kBaseFrame;
    message.pose = ros::to_ros(sample.T_odom_base);
    status = write("/wheel_odometry", sample.stamp, message);
  }
  return status;
}

Status SimulationRecorder::finish() {
  const Status status = add_readings({last_.ns + kAfterLast_ns});
  return status.ok() ? writer_.finish() : status;
}

Status SimulationRecorder::add_colour(const sim::SimulatedFrame& frame) {
  const ColourImage& colour = frame.frame->colour;
  std::string bytes = jpeg_ ? encode_jpeg(colour, kJpegQuality) : encode_png(colour, 1);
  if (frame.delivery.truncate_colour) bytes.resize(bytes.size() / 2);
  const Timestamp stamp = frame.frame->stamp;
  Status written = write("/camera/camera_info", stamp, camera_info_message(camera_, stamp));
  if (!written.ok()) return written;
  return write("/camera/image/compressed", stamp,
               ros::CompressedImage{{ros::to_ros(stamp), kCameraFrame},
                                    jpeg_ ? "jpeg" : "png",
                                    Bytes(bytes.begin(), bytes.end())});
}

Status SimulationRecorder::add_depth(const sim::SimulatedFrame& frame) {
  const Timestamp stamp = frame.frame->stamp;
  const char* name = depth_camera_ ? kDepthFrame : kCameraFrame;
  const CameraConfig& camera = depth_camera_ ? depth_camera_->camera : camera_;
  Status written =
      write("/camera/depth/camera_info", stamp, camera_info_message(camera, stamp, name));
  if (!written.ok()) return written;
  ros::Image depth = depth_message(frame.frame->depth_m, stamp, name);
  if (frame.delivery.truncate_depth) depth.data.resize(depth.data.size() / 2);
  return write("/camera/depth/image", stamp, depth);
}

Status SimulationRecorder::add(const sim::SimulatedFrame& frame) {
  if (!frame.delivery.frame) return Ok{};
  const Timestamp stamp = frame.frame->stamp;
  const TrackResult truth = truth_.of(frame);
  last_ = stamp;
  Status status = place_sensors(stamp);
  if (status.ok()) status = add_readings(stamp);
  if (status.ok()) status = write("/tf", stamp, tf_message(*frame.frame, truth));
  if (status.ok()) status = write("/odometry", stamp, odometry_message(*frame.frame, truth));
  if (status.ok() && frame.delivery.depth) status = add_depth(frame);
  if (status.ok() && frame.delivery.colour) status = add_colour(frame);
  return status;
}

}  // namespace ygslam
