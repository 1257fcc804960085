// As much of rclcpp as ros2/src/ygslam_node.cpp uses, for tests/ros_node_test.cpp: names and
// signatures after docs.ros.org, behaviour that of one process without any middleware.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace rcl_interfaces::msg {
struct ParameterDescriptor {
  std::string description;
};
}  // namespace rcl_interfaces::msg

namespace rclcpp {

struct rcl_serialized_message_t {
  std::uint8_t* buffer;
  std::size_t buffer_length, buffer_capacity;
};
class SerializedMessage {
 public:
  explicit SerializedMessage(std::size_t capacity = 0) : bytes_(capacity) {
    raw_ = {bytes_.data(), 0, capacity};
  }
  rcl_serialized_message_t& get_rcl_serialized_message() { return raw_; }
  const rcl_serialized_message_t& get_rcl_serialized_message() const { return raw_; }

 private:
  std::vector<std::uint8_t> bytes_;
  rcl_serialized_message_t raw_;
};

struct QoS {
  explicit QoS(std::size_t history) : depth(history) {}
  QoS& reliable() { return is_reliable = true, *this; }
  QoS& transient_local() { return is_transient_local = true, *this; }
  std::size_t depth;
  bool is_reliable = true, is_transient_local = false;
};
struct SensorDataQoS : QoS {
  SensorDataQoS() : QoS(5) { is_reliable = false; }
};

struct GenericPublisher {
  using SharedPtr = std::shared_ptr<GenericPublisher>;
  std::string type;
  QoS qos;
  std::size_t listeners = 0;
  std::vector<std::vector<std::uint8_t>> sent;
  [[nodiscard]] std::size_t get_subscription_count() const { return listeners; }
  void publish(const SerializedMessage& message) {
    const auto& raw = message.get_rcl_serialized_message();
    sent.emplace_back(raw.buffer, raw.buffer + raw.buffer_length);
  }
};
struct GenericSubscription {
  using SharedPtr = std::shared_ptr<GenericSubscription>;
  std::string type;
  std::function<void(std::shared_ptr<SerializedMessage>)> callback;
};
template <typename S>
struct Service {
  using SharedPtr = std::shared_ptr<Service>;
  std::function<void(std::shared_ptr<typename S::Request>, std::shared_ptr<typename S::Response>)>
      callback;
};

struct Logger {};
struct Clock {};
struct NodeOptions {
  std::map<std::string, std::string> texts;
};

class Node {
 public:
  Node(const std::string& /*name*/, const NodeOptions& options) : options_(options) {}
  virtual ~Node() = default;

  std::map<std::string, GenericPublisher::SharedPtr> publishers;
  std::map<std::string, GenericSubscription::SharedPtr> subscriptions;
  std::map<std::string, std::function<bool(std::string&)>> services;

 protected:
  template <typename T>
  T declare_parameter(const std::string& name, const T& standing,
                      const rcl_interfaces::msg::ParameterDescriptor& = {}) {
    if constexpr (std::is_same_v<T, std::string>) {
      const auto given = options_.texts.find(name);
      if (given != options_.texts.end()) return given->second;
    }
    return standing;
  }
  GenericPublisher::SharedPtr create_generic_publisher(const std::string& topic,
                                                       const std::string& type, const QoS& qos) {
    return publishers[topic] =
               std::make_shared<GenericPublisher>(GenericPublisher{type, qos, 0, {}});
  }
  GenericSubscription::SharedPtr create_generic_subscription(
      const std::string& topic, const std::string& type, const QoS& /*qos*/,
      std::function<void(std::shared_ptr<SerializedMessage>)> callback) {
    return subscriptions[topic] = std::make_shared<GenericSubscription>(
               GenericSubscription{type, std::move(callback)});
  }
  template <typename S, typename Callback>
  typename Service<S>::SharedPtr create_service(const std::string& name, Callback callback) {
    services[name] = [callback](std::string& message) {
      auto response = std::make_shared<typename S::Response>();
      callback(std::make_shared<typename S::Request>(), response);
      message = response->message;
      return response->success;
    };
    return std::make_shared<Service<S>>();
  }
  [[nodiscard]] Logger get_logger() const { return {}; }
  [[nodiscard]] std::shared_ptr<Clock> get_clock() const { return std::make_shared<Clock>(); }

 private:
  NodeOptions options_;
};

}  // namespace rclcpp

#define RCLCPP_ERROR(logger, ...) (static_cast<void>(logger), std::fprintf(stderr, __VA_ARGS__))
#define RCLCPP_WARN(logger, ...) RCLCPP_ERROR(logger, __VA_ARGS__)
#define RCLCPP_INFO(logger, ...) RCLCPP_ERROR(logger, __VA_ARGS__)
#define RCLCPP_WARN_THROTTLE(logger, clock, ms, ...) \
  (static_cast<void>(clock), RCLCPP_ERROR(logger, __VA_ARGS__))
