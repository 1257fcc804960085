// What else a stream tells of the camera's motion, beside its frames.
#pragma once

#include <string>
#include <vector>

#include "bag/motion_topics.hpp"
#include "bag/stream_odometry.hpp"
#include "bag/stream_readings.hpp"
#include "io/frame_stream.hpp"

namespace ygslam {

/// What is wanted of it.
struct WantedMotion {
  struct Sensor {
    bool is_wanted = false, by_tf = false;  ///< /tf_static is to tell where it is
    std::string name{};                     ///< as chosen; empty: the only one
  };
  Sensor imu, wheels;
};

/// One thread at a time, but for take().
class MotionBeside {
 public:
  void add(const BagTopic& topic, const BagMessage& message, std::int64_t shift_ns);
  /// Of what is wanted there is one topic at least, and each that was announced has said something
  /// and is placed; or the moving frame that is wanted is. Until list().
  [[nodiscard]] bool is_there(const WantedMotion& wanted, const std::vector<BagTopic>& announced,
                              const std::string& camera_frame) const;
  /// What has come by now, as MotionFrames does.
  void list(const std::vector<BagTopic>& announced, const std::string& camera_frame,
            Sequence& sequence);

  // As FrameStream. After list().
  [[nodiscard]] Result<std::string> use_imu(const std::string& choice);
  [[nodiscard]] Result<std::string> use_odometry(const std::string& choice);
  void hand_out(FrameId id);
  [[nodiscard]] StreamMotion take(FrameId id) { return {readings_.take(id), odometry_.take(id)}; }
  /// What speaks against either; said once.
  [[nodiscard]] std::vector<std::string> take_doubts();

 private:
  bool is_listed_ = false;
  FrameTree frames_;      // of the beginning, as the next
  MotionFrames sensors_;  // where they are
  std::vector<MotionTopic> imu_topics_, odometry_topics_;
  std::string chosen_imu_, chosen_odometry_;  // empty: none
  StreamReadings readings_;
  StreamOdometry odometry_;
};

}  // namespace ygslam
