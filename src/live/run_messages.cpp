#include "live/run_messages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <set>

#include "io/jpeg_codec.hpp"
#include "scene/floor_frame.hpp"

namespace ygslam {
namespace {

constexpr int kJpegQuality = 80;
constexpr double kPoint_px = 4;
constexpr double kArrow_s = 1;  // a velocity is drawn as the way of so long

const ros::Colour64 kGreen{0.2, 0.8, 0.3, 1}, kRed{0.95, 0.2, 0.2, 1}, kYellow{0.95, 0.85, 0.2, 1},
    kWhite{1, 1, 1, 1}, kDark{0, 0, 0, 0.6}, kBlue{0.35, 0.65, 1, 1};
constexpr int kMaskStep_px = 4;  // of an outline: a person has some hundred lines then

bool has_pose(const TrackResult& result) { return ygslam::has_pose(result.state); }

ros::Header header(Timestamp stamp, const char* frame) { return {ros::to_ros(stamp), frame}; }

ros::Vector3 to_map(const Vec3& p_world) {
  const Vec3 p_map = T_body_optical() * p_world;
  return {p_map.x(), p_map.y(), p_map.z()};
}

template <typename T>
void put(Bytes& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

/// A cloud of x, y, z and what `more` says, each 4 bytes.
ros::PointCloud2 empty_cloud(std::size_t points, Timestamp stamp,
                             std::vector<ros::PointField> more) {
  ros::PointCloud2 cloud;
  cloud.header = header(stamp, "map");
  cloud.point_fields = {{"x", 0}, {"y", 4}, {"z", 8}};
  for (ros::PointField& field : more) cloud.point_fields.push_back(std::move(field));
  cloud.width = static_cast<std::uint32_t>(points);
  cloud.point_step = static_cast<std::uint32_t>(4 * cloud.point_fields.size());
  cloud.row_step = cloud.point_step * cloud.width;
  cloud.data.resize(cloud.row_step);
  return cloud;
}

void put_point(ros::PointCloud2& cloud, std::size_t i, const Vec3& p_world) {
  const ros::Vector3 p = to_map(p_world);
  const std::size_t at = i * cloud.point_step;
  put(cloud.data, at, static_cast<float>(p.x));
  put(cloud.data, at + 4, static_cast<float>(p.y));
  put(cloud.data, at + 8, static_cast<float>(p.z));
}

/// Where a mask looked at every few pixels changes, as pairs of points: along rows, then columns.
std::vector<ros::Point2> outline_of(const GreyImage& ids) {
  std::vector<ros::Point2> lines;
  const int width = ids.width() / kMaskStep_px, height = ids.height() / kMaskStep_px;
  GreyImage cells(width + 2, height + 2, 0);  // nobody is beyond the border
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      cells.at(x + 1, y + 1) = ids.at(kMaskStep_px * x, kMaskStep_px * y);
  const auto id = [&](int x, int y) { return cells.at(x + 1, y + 1); };
  // Lines between a and its neighbours before it, from one end of a to the other.
  const auto trace = [&](int lanes, int length, auto changes, auto point) {
    for (int lane = 0; lane <= lanes; ++lane) {
      for (int a = 0; a < length; ++a) {
        if (!changes(lane, a)) continue;
        const int from = a;
        while (a + 1 < length && changes(lane, a + 1)) ++a;
        lines.push_back(point(lane, from));
        lines.push_back(point(lane, a + 1));
      }
    }
  };
  const auto at = [](int x, int y) {
    return ros::Point2{static_cast<double>(kMaskStep_px * x),
                       static_cast<double>(kMaskStep_px * y)};
  };
  trace(
      height, width, [&](int y, int x) { return id(x, y) != id(x, y - 1); },
      [&](int y, int x) { return at(x, y); });
  trace(
      width, height, [&](int x, int y) { return id(x, y) != id(x - 1, y); },
      [&](int x, int y) { return at(x, y); });
  return lines;
}

std::string name_of(const TrackedObject& object) {
  return fmt::format("{} {}", coco_class_name(object.class_id), index(object.id));
}

/// Grey: nobody has seen it for a while.
ros::Colour colour_of(const TrackedObject& object) {
  if (object.faded) return {0.6F, 0.6F, 0.6F, 0.15F};
  return object.resting ? ros::Colour{0.95F, 0.85F, 0.2F, 0.4F}
                        : ros::Colour{0.95F, 0.2F, 0.2F, 0.4F};
}

ros::KeyValue value(const char* key, auto number) { return {key, fmt::format("{}", number)}; }
ros::KeyValue milliseconds(const char* key, double ms) { return {key, fmt::format("{:.2f}", ms)}; }

/// x, y, z, then rotations about the axes of odom, row by row.
std::array<double, 36> covariance_rows(const TrackResult& result) {
  const Mat6 covariance = odom_covariance(result, T_body_optical().R());
  std::array<double, 36> rows;
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(rows.data()) = covariance;
  return rows;
}

}  // namespace

const SE3& T_body_optical() {
  static const SE3 T((Mat3() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished(), Vec3::Zero());
  return T;
}

ros::Pose pose_in_map(const SE3& T_parent_child) {
  return ros::to_ros(T_body_optical() * T_parent_child * T_body_optical().inverse());
}

ros::TfMessage tf_message(const RgbdFrame& frame, const TrackResult& result) {
  ros::TfMessage message;
  if (has_pose(result))
    message.transforms.push_back(
        {header(frame.stamp, "map"), "odom", pose_in_map(result.T_world_odom)});
  message.transforms.push_back(
      {header(frame.stamp, "odom"), "camera", pose_in_map(result.T_odom_camera)});
  message.transforms.push_back(
      {header(frame.stamp, "camera"), kCameraFrame, ros::to_ros(T_body_optical())});
  return message;
}

ros::Odometry odometry_message(const RgbdFrame& frame, const TrackResult& result) {
  ros::Odometry message;
  message.header = header(frame.stamp, "odom");
  message.child_frame_id = "camera";
  message.pose = pose_in_map(result.T_odom_camera);
  message.pose_covariance = covariance_rows(result);
  for (std::size_t i = 0; i < 6; ++i) message.twist_covariance[7 * i] = kUnknownVariance;
  return message;
}

ros::CompressedImage image_message(const RgbdFrame& frame) {
  const std::string jpeg = jpeg::encode(
      &frame.colour.data()->r, {frame.colour.width(), frame.colour.height()}, kJpegQuality);
  return {header(frame.stamp, kCameraFrame), "jpeg", Bytes(jpeg.begin(), jpeg.end())};
}

ros::CameraInfo camera_info_message(const CameraConfig& camera, Timestamp stamp,
                                    const char* frame) {
  ros::CameraInfo info;
  info.header = header(stamp, frame);
  info.height = static_cast<std::uint32_t>(camera.height);
  info.width = static_cast<std::uint32_t>(camera.width);
  info.distortion_model = "plumb_bob";
  info.d = {camera.k1, camera.k2, camera.p1, camera.p2, camera.k3};
  info.k = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
  info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.p = {camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0};
  return info;
}

ros::ImageAnnotations annotation_message(const RgbdFrame& frame, const TrackResult& result) {
  ros::ImageAnnotations message;
  const ros::Time stamp = ros::to_ros(frame.stamp);
  // One list for each label: a colour for each point would be twice as much as the point.
  constexpr std::array kLabels = {MotionLabel::kStatic, MotionLabel::kDynamic,
                                  MotionLabel::kUnknown};
  const std::array colours = {kGreen, kRed, kYellow};
  for (std::size_t k = 0; k < kLabels.size(); ++k) {
    ros::PointsAnnotation& points = message.points.emplace_back();
    points.timestamp = stamp;
    points.thickness = kPoint_px;
    points.outline_colour = colours[k];
    for (std::size_t i = 0; result.features && i < result.features->size(); ++i) {
      const auto& uv_px = result.features->points[i].uv_px;
      if (result.labels.label[i] == kLabels[k]) points.points.push_back({uv_px.x(), uv_px.y()});
    }
  }
  if (!result.masks.empty()) {
    const Segmentation& mask = **std::ranges::max_element(
        result.masks, {}, [](const SegmentationPtr& m) { return m->stamp.ns; });
    ros::PointsAnnotation outline;
    outline.timestamp = ros::to_ros(mask.stamp);
    outline.type = ros::PointsAnnotation::kLineList;
    outline.points = outline_of(mask.ids);
    outline.outline_colour = kBlue;
    message.points.push_back(std::move(outline));
  }
  for (const TrackedObject& object : result.objects) {
    if (object.box_px.empty()) continue;
    const double x0 = object.box_px.x0, y0 = object.box_px.y0;
    const double x1 = object.box_px.x1, y1 = object.box_px.y1;
    ros::PointsAnnotation box;
    box.timestamp = stamp;
    box.type = ros::PointsAnnotation::kLineLoop;
    box.points = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
    box.outline_colour = object.resting ? kYellow : kRed;
    message.points.push_back(std::move(box));
    message.texts.push_back({stamp, {x0, y0}, name_of(object), 14, kWhite, kDark});
  }
  return message;
}

ros::MarkerArray object_message(const RgbdFrame& frame, const TrackResult& result) {
  const ros::Header in_map = header(frame.stamp, "map");
  ros::Marker erase;
  erase.header = in_map;
  erase.action = ros::Marker::kDeleteAll;
  ros::MarkerArray message{{std::move(erase)}};
  for (const TrackedObject& object : result.objects) {
    ros::Marker box;
    box.header = in_map;
    box.ns = "objects";
    box.id = static_cast<std::int32_t>(index(object.id));
    box.pose.position = to_map((object.min_world + object.max_world) / 2);
    const ros::Vector3 size = to_map(object.max_world - object.min_world);
    box.scale = {std::abs(size.x), std::abs(size.y), std::abs(size.z)};
    box.colour = colour_of(object);
    ros::Marker name = box, way = box;
    name.ns = "names";
    name.type = ros::Marker::kText;
    name.text = name_of(object);
    name.pose.position.z += box.scale.z / 2 + 0.15;
    name.scale = {0, 0, 0.2};
    name.colour = {1, 1, 1, object.faded ? 0.5F : 1.0F};
    way.ns = "velocities";
    way.type = ros::Marker::kLineList;
    way.pose = {};
    way.points = {to_map(object.centre_world),
                  to_map(object.centre_world + kArrow_s * object.velocity_world_mps)};
    way.scale = {0.02, 0, 0};
    for (ros::Marker* marker : {&box, &name, &way}) message.markers.push_back(*marker);
  }
  return message;
}

ros::DiagnosticArray state_message(const RgbdFrame& frame, const TrackResult& result) {
  ros::DiagnosticStatus status;
  status.name = "ygslam: tracking";
  status.hardware_id = "camera";
  status.message = to_string(result.state);
  if (result.unplaced) {
    status.message += ", in a submap whose place is a guess";
  } else if (result.provisional) {
    status.message += ", the place is provisional";
  }
  status.level = result.state == TrackState::kLost ? ros::DiagnosticStatus::kError
                 : result.state != TrackState::kTracking || result.provisional
                     ? ros::DiagnosticStatus::kWarn
                     : ros::DiagnosticStatus::kOk;
  status.values = {value("frame", index(frame.id)),
                   value("matches", result.matches),
                   value("inliers", result.inliers),
                   value("static points", result.labels.static_points),
                   value("dynamic points", result.labels.dynamic_points),
                   value("unknown points", result.labels.unknown_points),
                   value("mask age [frames]", result.mask_age_frames),
                   value("objects", result.objects.size()),
                   milliseconds("features [ms]", result.orb_ms),
                   milliseconds("motion check [ms]", result.motion_ms),
                   milliseconds("pose [ms]", result.pose_ms)};
  return {header(frame.stamp, ""), {std::move(status)}};
}

ros::PointCloud2 landmark_message(const Map& map, Timestamp stamp) {
  ros::PointCloud2 cloud = empty_cloud(map.landmark_count(), stamp, {{"static_weight", 12}});
  std::vector<const Landmark*> landmarks;
  map.for_each_landmark([&](const Landmark& landmark) { landmarks.push_back(&landmark); });
  std::ranges::sort(landmarks, {}, &Landmark::id);  // the same map, the same bytes
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    put_point(cloud, i, landmarks[i]->p_world);
    put(cloud.data, i * cloud.point_step + 12, landmarks[i]->static_weight());
  }
  return cloud;
}

ros::PointCloud2 cloud_message(std::span<const ColouredPoint> points, std::size_t most_points,
                               Timestamp stamp) {
  const std::size_t count = std::min(points.size(), most_points);
  ros::PointCloud2 cloud = empty_cloud(count, stamp, {{"rgb", 12}});
  for (std::size_t i = 0; i < count; ++i) {
    const ColouredPoint& point = points[i * points.size() / count];
    put_point(cloud, i, point.p_world.cast<double>());
    const std::uint32_t rgb = static_cast<std::uint32_t>(point.colour.r) << 16 |
                              static_cast<std::uint32_t>(point.colour.g) << 8 | point.colour.b;
    put(cloud.data, i * cloud.point_step + 12, rgb);  // in the bytes of a float, as PCL has it
  }
  return cloud;
}

ros::TfMessage floor_message(const Gravity& gravity, Timestamp stamp) {
  // The floor's frame has z up already.
  const SE3 T_map_floor = T_body_optical() * T_world_floor(gravity);
  return {{{header(stamp, "map"), "floor", ros::to_ros(T_map_floor)}}};
}

ros::MarkerArray loop_message(const Map& map, std::span<const LoopAttempt> attempts,
                              Timestamp stamp) {
  std::set<std::pair<KeyframeId, KeyframeId>> closed;
  for (const LoopAttempt& attempt : attempts) {
    if (attempt.outcome == LoopOutcome::kClosed)
      closed.emplace(attempt.keyframe, attempt.match.place);
  }
  ros::MarkerArray message;
  ros::Marker& lines = message.markers.emplace_back();
  lines.header = header(stamp, "map");
  lines.ns = "loops";
  lines.type = ros::Marker::kLineList;
  lines.colour = {0.35F, 0.65F, 1, 1};
  lines.scale = {0.02, 0, 0};
  for (const auto& [keyframe, place] : closed) {
    if (!map.has_keyframe(keyframe) || !map.has_keyframe(place)) continue;
    for (const KeyframeId end : {keyframe, place})
      lines.points.push_back(to_map(map.keyframe(end).T_camera_world.inverse().t()));
  }
  return message;
}

ros::Path path_message(const Map& map, Timestamp stamp) {
  ros::Path path;
  path.header = header(stamp, "map");
  for (const auto& [id, keyframe] : map.keyframes()) {
    const SE3 T_world_camera = keyframe.T_camera_world.inverse();
    path.poses.push_back({header(keyframe.data->stamp, "map"), pose_in_map(T_world_camera)});
  }
  return path;
}

}  // namespace ygslam
