#include "bag/ros_messages.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <sstream>

#include "core/check.hpp"

namespace ygslam::ros {
namespace {

constexpr std::int64_t kNsPerS = 1'000'000'000;

// As the .msg files name them: without /msg, other types with their package.
const std::map<std::string, std::string>& definitions() {
  static const std::map<std::string, std::string> definitions = {
      {"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
      {"builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"},
      {"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
      {"std_msgs/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n"},
      {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
      {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
      {"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"},
      {"geometry_msgs/Pose",
       "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
      {"geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"},
      {"geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
      {"geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
      {"geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
      {"geometry_msgs/Transform",
       "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
      {"geometry_msgs/TransformStamped",
       "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"},
      {"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
      {"nav_msgs/Odometry",
       "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
       "geometry_msgs/TwistWithCovariance twist\n"},
      {"nav_msgs/Path", "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n"},
      {"sensor_msgs/Image",
       "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
       "uint8 is_bigendian\nuint32 step\nuint8[] data\n"},
      {"sensor_msgs/Imu",
       "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
       "float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
       "float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n"
       "float64[9] linear_acceleration_covariance\n"},
      {"sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"},
      {"sensor_msgs/RegionOfInterest",
       "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"},
      {"sensor_msgs/CameraInfo",
       "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\n"
       "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\n"
       "uint32 binning_y\nsensor_msgs/RegionOfInterest roi\n"},
      {"sensor_msgs/PointField",
       "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\n"
       "uint8 UINT32=6\nuint8 FLOAT32=7\nuint8 FLOAT64=8\n"
       "string name\nuint32 offset\nuint8 datatype\nuint32 count\n"},
      {"sensor_msgs/PointCloud2",
       "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n"
       "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n"},
      {"visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n"},
      {"visualization_msgs/MeshFile", "string filename\nuint8[] data\n"},
      {"visualization_msgs/Marker",
       "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\n"
       "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\n"
       "builtin_interfaces/Duration lifetime\nbool frame_locked\ngeometry_msgs/Point[] points\n"
       "std_msgs/ColorRGBA[] colors\nstring texture_resource\n"
       "sensor_msgs/CompressedImage texture\n"
       "visualization_msgs/UVCoordinate[] uv_coordinates\nstring text\nstring mesh_resource\n"
       "visualization_msgs/MeshFile mesh_file\nbool mesh_use_embedded_materials\n"},
      {"visualization_msgs/MarkerArray", "visualization_msgs/Marker[] markers\n"},
      {"diagnostic_msgs/KeyValue", "string key\nstring value\n"},
      {"diagnostic_msgs/DiagnosticStatus",
       "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\n"
       "string message\nstring hardware_id\ndiagnostic_msgs/KeyValue[] values\n"},
      {"diagnostic_msgs/DiagnosticArray",
       "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n"},
      {"foxglove_msgs/Point2", "float64 x\nfloat64 y\n"},
      {"foxglove_msgs/Color", "float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n"},
      {"foxglove_msgs/CircleAnnotation",
       "builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nfloat64 diameter\n"
       "float64 thickness\nfoxglove_msgs/Color fill_color\nfoxglove_msgs/Color outline_color\n"},
      {"foxglove_msgs/PointsAnnotation",
       "uint8 UNKNOWN=0\nuint8 POINTS=1\nuint8 LINE_LOOP=2\nuint8 LINE_STRIP=3\n"
       "uint8 LINE_LIST=4\nbuiltin_interfaces/Time timestamp\nuint8 type\n"
       "foxglove_msgs/Point2[] points\nfoxglove_msgs/Color outline_color\n"
       "foxglove_msgs/Color[] outline_colors\nfoxglove_msgs/Color fill_color\n"
       "float64 thickness\n"},
      {"foxglove_msgs/TextAnnotation",
       "builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nstring text\n"
       "float64 font_size\nfoxglove_msgs/Color text_color\n"
       "foxglove_msgs/Color background_color\n"},
      {"foxglove_msgs/ImageAnnotations",
       "foxglove_msgs/CircleAnnotation[] circles\nfoxglove_msgs/PointsAnnotation[] points\n"
       "foxglove_msgs/TextAnnotation[] texts\n"},
  };
  return definitions;
}

void append_parts(const std::string& name, std::set<std::string>& told, std::string& text) {
  std::istringstream lines(definitions().at(name));
  for (std::string line; std::getline(lines, line);) {
    std::string part = line.substr(0, line.find(' '));
    part = part.substr(0, part.find('['));
    if (!definitions().contains(part) || !told.insert(part).second) continue;
    text += std::string(80, '=') + "\nMSG: " + part + "\n" + definitions().at(part);
    append_parts(part, told, text);
  }
}

}  // namespace

Time to_ros(Timestamp stamp) {
  const std::int64_t nanosec = ((stamp.ns % kNsPerS) + kNsPerS) % kNsPerS;
  return {static_cast<std::int32_t>((stamp.ns - nanosec) / kNsPerS),
          static_cast<std::uint32_t>(nanosec)};
}

Timestamp from_ros(const Time& time) { return {time.sec * kNsPerS + time.nanosec}; }

Pose to_ros(const SE3& T_parent_child) {
  const Vec3& t = T_parent_child.t();
  const Eigen::Quaterniond q = T_parent_child.quaternion();
  return {{t.x(), t.y(), t.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

std::string schema_of(const std::string& type) {
  const std::size_t msg = type.find("/msg/");
  CHECK(msg != std::string::npos, "a type is package/msg/Name");
  const std::string name = type.substr(0, msg) + type.substr(msg + 4);
  std::string text = definitions().at(name);
  std::set<std::string> told{name};
  append_parts(name, told, text);
  return text;
}

}  // namespace ygslam::ros
