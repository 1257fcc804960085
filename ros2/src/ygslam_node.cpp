// The ROS 2 node: subscribes, publishes, has parameters and services. Messages are handed to the
// library and taken from it serialised; what they mean, their frames and their pairing is the
// library's (ygslam/ros_adapter.hpp), where it is tested. This file was never compiled against
// ROS 2.
#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <rclcpp/rclcpp.hpp>
#include <rclcpp_components/register_node_macro.hpp>
#include <std_srvs/srv/trigger.hpp>
#include <string>
#include <utility>
#include <vector>
#include <ygslam/ros_adapter.hpp>

namespace ygslam_ros {

using std_srvs::srv::Trigger;
using ygslam::api::RosAdapter;
using ygslam::api::RosMessage;

class YgslamNode : public rclcpp::Node {
 public:
  explicit YgslamNode(const rclcpp::NodeOptions& options) : Node("ygslam", options) {
    ygslam::api::Settings settings;
    settings.camera.fx = 0;  // that of the camera info
    const auto ignore = declare_parameter("ignore", std::vector<std::int64_t>());
    for (std::size_t i = 0; i + 3 < ignore.size(); i += 4) {  // x y width height of each rectangle
      settings.camera.ignore.push_back(
          {static_cast<int>(ignore[i]), static_cast<int>(ignore[i + 1]),
           static_cast<int>(ignore[i + 2]), static_cast<int>(ignore[i + 3])});
    }
    settings.camera.ignore_image =
        text("ignore_image", "", "8-bit grey PNG, not 0 where the image shows the robot itself");
    settings.model = text("model", "", "segmentation network, .onnx or .xml; empty: none");
    settings.segmenter = text("segmenter", "", "model, builtin, none; empty: the model, if any");
    settings.load_map = text("load_map", "", "map of an earlier run to go on with");
    settings.localize_only = declare_parameter("localize_only", false);
    settings.keep_trajectory = false;  // a node may run for days
    const std::vector<std::string> set = declare_parameter("set", std::vector<std::string>());
    for (const std::string& setting : set) {  // as --set: "motion.tau_px=1.5"
      const auto equals = setting.find('=');
      settings.options[setting.substr(0, equals)] =
          equals == std::string::npos ? "" : setting.substr(equals + 1);
    }
    settings.log = [logger = get_logger()](ygslam::api::LogLevel level, const std::string& line) {
      if (level == ygslam::api::LogLevel::kError) RCLCPP_ERROR(logger, "%s", line.c_str());
      if (level == ygslam::api::LogLevel::kWarning) RCLCPP_WARN(logger, "%s", line.c_str());
      if (level == ygslam::api::LogLevel::kInfo) RCLCPP_INFO(logger, "%s", line.c_str());
    };
    map_file_ = text("map_file", "room.map", "where ~/save_map writes");
    publishes_tf_ = declare_parameter("publish_tf", true);
    advertise();
    RosAdapter::Topics topics;
    topics.wanted = [this](const std::string& topic) { return is_wanted(topic); };
    topics.publish = [this](const RosMessage& message) { publish(message); };
    topics.map_period_s = declare_parameter("map_period_s", 2.0);
    adapter_ = std::make_unique<RosAdapter>(settings, std::move(topics));
    subscribe();
    serve();
  }

 private:
  std::string text(const std::string& name, const std::string& standing, const std::string& what) {
    rcl_interfaces::msg::ParameterDescriptor description;
    description.description = what;
    return declare_parameter(name, standing, description);
  }

  void advertise() {
    // Of maps whoever comes later gets the last (REP 2003); transforms as tf2 publishes them.
    const auto live = rclcpp::QoS(10);
    const auto map = rclcpp::QoS(1).reliable().transient_local();
    const auto add = [this](const std::string& topic, const std::string& type,
                            const rclcpp::QoS& qos) {
      const std::string name = topic == "/tf" ? topic : "~" + topic;
      publishers_[topic] = create_generic_publisher(name, type, qos);
    };
    if (publishes_tf_) add("/tf", "tf2_msgs/msg/TFMessage", rclcpp::QoS(100));
    add("/odometry", "nav_msgs/msg/Odometry", live);
    add("/objects", "visualization_msgs/msg/MarkerArray", live);
    add("/state", "diagnostic_msgs/msg/DiagnosticArray", live);
    add("/landmarks", "sensor_msgs/msg/PointCloud2", map);
    add("/path", "nav_msgs/msg/Path", map);
    add("/loops", "visualization_msgs/msg/MarkerArray", map);
    add("/cloud", "sensor_msgs/msg/PointCloud2", map);
    add("/mesh", "visualization_msgs/msg/MarkerArray", map);
    add("/mesh/classes", "visualization_msgs/msg/MarkerArray", map);
  }

  bool is_wanted(const std::string& topic) const {
    const auto publisher = publishers_.find(topic);
    if (publisher == publishers_.end()) return false;
    return topic == "/tf" || publisher->second->get_subscription_count() > 0;
  }

  void publish(const RosMessage& message) {
    rclcpp::SerializedMessage serialized(message.cdr.size());
    auto& raw = serialized.get_rcl_serialized_message();
    std::copy(message.cdr.begin(), message.cdr.end(), raw.buffer);
    raw.buffer_length = message.cdr.size();
    publishers_.at(message.topic)->publish(serialized);
  }

  void subscribe() {
    const auto listen = [this](RosAdapter::Input input, const std::string& topic,
                               const std::string& type) {
      subscriptions_.push_back(create_generic_subscription(
          topic, type, rclcpp::SensorDataQoS(),
          [this, input, type](const std::shared_ptr<rclcpp::SerializedMessage>& message) {
            take(input, type, *message);
          }));
    };
    const std::string colour = text("colour_type", "sensor_msgs/msg/Image", "or CompressedImage");
    const std::string depth = text("depth_type", "sensor_msgs/msg/Image", "or CompressedImage");
    listen(RosAdapter::Input::kColour, "rgb/image", colour);  // to be remapped
    listen(RosAdapter::Input::kDepth, "depth/image", depth);
    listen(RosAdapter::Input::kCameraInfo, "rgb/camera_info", "sensor_msgs/msg/CameraInfo");
  }

  void take(RosAdapter::Input input, const std::string& type,
            const rclcpp::SerializedMessage& message) {
    const auto& raw = message.get_rcl_serialized_message();
    try {
      adapter_->take(input, type, raw.buffer, raw.buffer_length);
    } catch (const ygslam::api::Error& error) {
      if (error.code != 4) throw;  // a message that cannot be used is left out
      RCLCPP_WARN_THROTTLE(get_logger(), *get_clock(), 5000, "%s", error.what());
    }
  }

  void serve() {
    const auto offer = [this](const char* name, auto work) {
      services_.push_back(create_service<Trigger>(
          // rclcpp takes no other kind of parameters:
          // NOLINTNEXTLINE(performance-unnecessary-value-param)
          name, [work](std::shared_ptr<Trigger::Request>, std::shared_ptr<Trigger::Response> done) {
            try {
              work();
              done->success = true;
            } catch (const ygslam::api::Error& error) {
              done->message = error.what();
            }
          }));
    };
    offer("~/save_map", [this] { adapter_->save_map(map_file_); });
    offer("~/reset", [this] { adapter_->reset(); });
  }

  bool publishes_tf_ = true;
  std::string map_file_;
  std::map<std::string, rclcpp::GenericPublisher::SharedPtr> publishers_;
  std::unique_ptr<RosAdapter> adapter_;
  std::vector<rclcpp::GenericSubscription::SharedPtr> subscriptions_;
  std::vector<rclcpp::Service<Trigger>::SharedPtr> services_;
};

}  // namespace ygslam_ros

RCLCPP_COMPONENTS_REGISTER_NODE(ygslam_ros::YgslamNode)
