// The beginning of a stream, until it is known what its frames are made of.
#pragma once

#include <optional>
#include <vector>

#include "bag/bag_choice.hpp"
#include "bag/stamp_order.hpp"

namespace ygslam {

class LeadIn {
 public:
  struct Early {
    std::size_t topic;  ///< place in content().images
    StreamImage image;
  };
  LeadIn(const BagTopics& topics, const GivenCameras& cameras)
      : topics_(topics), cameras_(cameras) {}

  void take(const BagTopic& topic, const BagMessage& message);
  /// Of every topic that may be meant something has come, and what may still place the cameras.
  [[nodiscard]] bool is_complete(const std::vector<BagTopic>& announced) const;
  /// Two seconds of images, or very many.
  [[nodiscard]] bool is_too_long() const;
  [[nodiscard]] Result<BagChoice> choice() const { return choose(content(), topics_, cameras_); }
  [[nodiscard]] const BagContent& content() const { return reader_.content(); }
  std::vector<Early> take_images() { return std::move(images_); }

 private:
  const BagTopics& topics_;
  const GivenCameras& cameras_;
  ContentReader reader_;
  std::vector<Early> images_;
  std::size_t bytes_ = 0;
  std::optional<Timestamp> first_, last_;
};

}  // namespace ygslam
