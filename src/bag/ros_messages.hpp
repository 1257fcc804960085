// The messages that are written and read. Field names and order are those of the .msg files
// in ros2/common_interfaces, ros2/geometry2 and foxglove/schemas.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "bag/cdr.hpp"
#include "core/time.hpp"
#include "geometry/se3.hpp"

namespace ygslam::ros {

// `fields` takes message and CdrWriter or CdrReader: Self is const where it is written.

struct Time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.sec, m.nanosec);
  }
};

struct Header {
  static constexpr bool kCountedInRos1 = true;
  Time stamp;
  std::string frame_id;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.stamp, m.frame_id);
  }
};

struct Vector3 {  // also geometry_msgs/Point
  double x = 0, y = 0, z = 0;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.x, m.y, m.z);
  }
};

struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.x, m.y, m.z, m.w);
  }
};

struct Pose {  // also geometry_msgs/Transform
  Vector3 position;
  Quaternion orientation;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.position, m.orientation);
  }
};

struct PoseStamped {
  Header header;
  Pose pose;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.pose);
  }
};

struct TransformStamped {
  static constexpr const char* kType = "geometry_msgs/msg/TransformStamped";
  Header header;
  std::string child_frame_id;
  Pose transform;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.child_frame_id, m.transform);
  }
};

struct TfMessage {
  static constexpr const char* kType = "tf2_msgs/msg/TFMessage";
  std::vector<TransformStamped> transforms;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.transforms);
  }
};

struct Odometry {
  static constexpr const char* kType = "nav_msgs/msg/Odometry";
  Header header;
  std::string child_frame_id;
  Pose pose;
  std::array<double, 36> pose_covariance{};
  std::array<double, 6> twist{};
  std::array<double, 36> twist_covariance{};
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.child_frame_id, m.pose, m.pose_covariance, m.twist, m.twist_covariance);
  }
};

struct Path {
  static constexpr const char* kType = "nav_msgs/msg/Path";
  Header header;
  std::vector<PoseStamped> poses;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.poses);
  }
};

struct Image {
  static constexpr const char* kType = "sensor_msgs/msg/Image";
  Header header;
  std::uint32_t height = 0, width = 0;
  std::string encoding;
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;
  Bytes data;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.height, m.width, m.encoding, m.is_bigendian, m.step, m.data);
  }
};

struct CompressedImage {
  static constexpr const char* kType = "sensor_msgs/msg/CompressedImage";
  Header header;
  std::string format;
  Bytes data;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.format, m.data);
  }
};

struct CameraInfo {
  static constexpr const char* kType = "sensor_msgs/msg/CameraInfo";
  Header header;
  std::uint32_t height = 0, width = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{}, r{};
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0, binning_y = 0;
  std::array<std::uint32_t, 4> roi{};  // x_offset, y_offset, height, width
  std::uint8_t roi_do_rectify = 0;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.height, m.width, m.distortion_model, m.d, m.k, m.r, m.p, m.binning_x,
        m.binning_y, m.roi, m.roi_do_rectify);
  }
};

struct PointField {
  static constexpr std::uint8_t kFloat32 = 7;
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = kFloat32;
  std::uint32_t count = 1;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.name, m.offset, m.datatype, m.count);
  }
};

struct PointCloud2 {
  static constexpr const char* kType = "sensor_msgs/msg/PointCloud2";
  Header header;
  std::uint32_t height = 1, width = 0;
  std::vector<PointField> point_fields;
  std::uint8_t is_bigendian = 0;
  std::uint32_t point_step = 0, row_step = 0;
  Bytes data;
  std::uint8_t is_dense = 1;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.height, m.width, m.point_fields, m.is_bigendian, m.point_step, m.row_step,
        m.data, m.is_dense);
  }
};

struct Colour {
  float r = 0, g = 0, b = 0, a = 1;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.r, m.g, m.b, m.a);
  }
};

struct Marker {
  static constexpr std::int32_t kCube = 1, kLineList = 5, kText = 9, kTriangleList = 11;
  static constexpr std::int32_t kAdd = 0, kDelete = 2, kDeleteAll = 3;
  Header header;
  std::string ns;
  std::int32_t id = 0, type = kCube, action = kAdd;
  Pose pose;
  Vector3 scale;
  Colour colour;
  Time lifetime;
  std::uint8_t frame_locked = 0;
  std::vector<Vector3> points;
  std::vector<Colour> colours;
  std::string texture_resource;
  CompressedImage texture;
  std::vector<std::array<float, 2>> uv_coordinates;
  std::string text;
  std::string mesh_resource;
  std::string mesh_file_name;
  Bytes mesh_file;
  std::uint8_t mesh_use_embedded_materials = 0;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.ns, m.id, m.type, m.action, m.pose, m.scale, m.colour, m.lifetime,
        m.frame_locked, m.points, m.colours, m.texture_resource, m.texture, m.uv_coordinates,
        m.text, m.mesh_resource, m.mesh_file_name, m.mesh_file, m.mesh_use_embedded_materials);
  }
};

struct MarkerArray {
  static constexpr const char* kType = "visualization_msgs/msg/MarkerArray";
  std::vector<Marker> markers;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.markers);
  }
};

struct KeyValue {
  std::string key, value;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.key, m.value);
  }
};

struct DiagnosticStatus {
  static constexpr std::uint8_t kOk = 0, kWarn = 1, kError = 2;
  std::uint8_t level = kOk;
  std::string name, message, hardware_id;
  std::vector<KeyValue> values;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.level, m.name, m.message, m.hardware_id, m.values);
  }
};

struct DiagnosticArray {
  static constexpr const char* kType = "diagnostic_msgs/msg/DiagnosticArray";
  Header header;
  std::vector<DiagnosticStatus> status;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.status);
  }
};

struct Point2 {
  double x = 0, y = 0;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.x, m.y);
  }
};

struct Colour64 {
  double r = 0, g = 0, b = 0, a = 1;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.r, m.g, m.b, m.a);
  }
};

struct PointsAnnotation {
  static constexpr std::uint8_t kPoints = 1, kLineLoop = 2, kLineList = 4;
  Time timestamp;
  std::uint8_t type = kPoints;
  std::vector<Point2> points;
  Colour64 outline_colour;
  std::vector<Colour64> outline_colours;
  Colour64 fill_colour;
  double thickness = 2;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.timestamp, m.type, m.points, m.outline_colour, m.outline_colours, m.fill_colour,
        m.thickness);
  }
};

struct TextAnnotation {
  Time timestamp;
  Point2 position;
  std::string text;
  double font_size = 14;
  Colour64 text_colour, background_colour;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.timestamp, m.position, m.text, m.font_size, m.text_colour, m.background_colour);
  }
};

struct CircleAnnotation {
  Time timestamp;
  Point2 position;
  double diameter = 0, thickness = 1;
  Colour64 fill_colour, outline_colour;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.timestamp, m.position, m.diameter, m.thickness, m.fill_colour, m.outline_colour);
  }
};

struct ImageAnnotations {
  static constexpr const char* kType = "foxglove_msgs/msg/ImageAnnotations";
  std::vector<CircleAnnotation> circles;
  std::vector<PointsAnnotation> points;
  std::vector<TextAnnotation> texts;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.circles, m.points, m.texts);
  }
};

[[nodiscard]] Time to_ros(Timestamp stamp);
[[nodiscard]] Timestamp from_ros(const Time& time);
[[nodiscard]] Pose to_ros(const SE3& T_parent_child);

/// The definition of a type and of all it is made of, as MCAP's `ros2msg` wants it.
/// @param type kType of a message above.
[[nodiscard]] std::string schema_of(const std::string& type);

}  // namespace ygslam::ros
