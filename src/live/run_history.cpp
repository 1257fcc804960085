#include "live/run_history.hpp"

#include <cstring>

#include "live/run_messages.hpp"

namespace ygslam {
namespace {

constexpr std::uint8_t kUint32 = 6, kFloat32 = 7, kFloat64 = 8;  // of sensor_msgs/PointField
constexpr std::array kFloats = {"tracked", "x",      "y",       "z",           "qx",
                                "qy",      "qz",     "qw",      "features_ms", "motion_ms",
                                "pose_ms", "static", "dynamic", "unknown",     "mask_age"};

std::vector<ros::PointField> fields() {
  std::vector<ros::PointField> fields{{"t", 0, kFloat64}, {"frame", 8, kUint32}};
  std::uint32_t offset = 12;
  for (const char* name : kFloats) {
    fields.push_back({name, offset, kFloat32});
    offset += sizeof(float);
  }
  return fields;
}
constexpr std::uint32_t kPointSize = 12 + sizeof(float) * kFloats.size();

}  // namespace

void RunHistory::add(const RgbdFrame& frame, const TrackResult& result) {
  if (seen_++ % stride_ != 0) return;
  if (frames_.size() >= kMostFrames) {
    for (std::size_t i = 0; 2 * i < frames_.size(); ++i) frames_[i] = frames_[2 * i];
    frames_.resize((frames_.size() + 1) / 2);
    stride_ *= 2;
  }
  const bool is_sure = result.state == TrackState::kTracking && !result.provisional;
  const auto [p, q] = pose_in_map(result.T_world_odom * result.T_odom_camera);
  const auto real = [](auto value) { return static_cast<float>(value); };
  const PointLabels& labels = result.labels;
  frames_.push_back(
      {static_cast<double>(frame.stamp.ns) * 1e-9,
       index(frame.id),
       is_sure                  ? 1.0F
       : has_pose(result.state) ? 0.5F
                                : 0.0F,
       {real(p.x), real(p.y), real(p.z), real(q.x), real(q.y), real(q.z), real(q.w)},
       {real(result.orb_ms), real(result.motion_ms), real(result.pose_ms)},
       {real(labels.static_points), real(labels.dynamic_points), real(labels.unknown_points)},
       real(result.mask_age_frames)});
}

ros::PointCloud2 RunHistory::message(Timestamp stamp) const {
  ros::PointCloud2 cloud;
  cloud.header = {ros::to_ros(stamp), "map"};
  cloud.point_fields = fields();
  cloud.width = static_cast<std::uint32_t>(frames_.size());
  cloud.point_step = kPointSize;
  cloud.row_step = kPointSize * cloud.width;
  cloud.data.resize(cloud.row_step);
  auto* at = cloud.data.data();
  const auto put = [&at](const auto& value) {
    std::memcpy(at, &value, sizeof value);
    at += sizeof value;
  };
  for (const Frame& frame : frames_) {
    put(frame.t_s);
    put(frame.number);
    put(frame.tracked);
    put(frame.pose);
    put(frame.times_ms);
    put(frame.points);
    put(frame.mask_age);
  }
  return cloud;
}

}  // namespace ygslam
