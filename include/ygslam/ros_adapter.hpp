// YG-SLAM for ROS 2, without ROS: serialised messages (CDR) in, serialised messages out. What is
// left for a node is to subscribe, to publish and to have parameters (ros2/ in the sources).
#pragma once

#include <ygslam/slam.hpp>

namespace ygslam::api {

/// A serialised message to be published.
struct RosMessage {
  /// /tf, /odometry, /camera/image/compressed, /camera/camera_info, /camera/annotations, /objects,
  /// /state and, of the map, /landmarks, /path, /loops, /cloud, /mesh, /mesh/classes
  /// (docs/live.md).
  std::string topic;
  std::string type;  ///< "nav_msgs/msg/Odometry"
  std::int64_t t_ns = 0;
  std::vector<std::uint8_t> cdr;
};

/// Frames as REP 105 has them, axes as REP 103: map -> odom -> camera -> camera_optical, the last
/// one with the axes of the images. One thread at a time may use it.
class YGSLAM_API RosAdapter {
 public:
  enum class Input { kColour, kDepth, kCameraInfo };
  struct Topics {
    /// Whether anybody wants a topic now: else its messages are not made. Empty: all, always.
    std::function<bool(const std::string& topic)> wanted;
    std::function<void(RosMessage)> publish;
    double map_period_s = 2;  ///< how often messages of the map are made, by the images' stamps
  };

  /// @param settings without a camera (fx = 0): that of the first CameraInfo.
  /// @throws Error (3)
  RosAdapter(const Settings& settings, Topics topics);
  RosAdapter(RosAdapter&&) noexcept;
  RosAdapter& operator=(RosAdapter&&) noexcept;
  ~RosAdapter();

  /// A message: images are paired by their stamps, within 20 ms; each pair is a frame, processed in
  /// the call that completes it. Before the first CameraInfo they are left out.
  /// @param type sensor_msgs/msg/Image, CompressedImage or CameraInfo.
  /// @return how many frames were processed.
  /// @throws Error (3: a camera that cannot be used, 4: no such message or an image that cannot be
  /// used, 5, 6, 2, 1)
  int take(Input input, const std::string& type, const std::uint8_t* cdr, std::size_t bytes);

  /// As those of Slam; nothing before the first CameraInfo.
  void save_map(const std::string& path);
  void reset();
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ygslam::api
