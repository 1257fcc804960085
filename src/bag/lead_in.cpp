#include "bag/lead_in.hpp"

#include <algorithm>

namespace ygslam {
namespace {

constexpr double kLongestLeadIn_s = 2;
constexpr std::size_t kMostLeadInImages = 256;
constexpr std::size_t kMostLeadInBytes = std::size_t{256} << 20;

bool shows_image(const BagTopic& topic) {
  return topic.type == ros::kImageType || topic.type == ros::kCompressedType;
}

bool is_camera(const BagTopic& topic) { return topic.type == ros::kCameraType; }

}  // namespace

void LeadIn::take(const BagTopic& topic, const BagMessage& message) {
  const auto place = reader_.take(topic, message);
  if (!place) return;
  const auto& images = content().images[*place].images;
  const Timestamp stamp = images.back().stamp;
  if (!last_ || are_far_apart(stamp, *last_)) first_ = last_ = stamp;
  first_ = std::min(*first_, stamp);
  last_ = std::max(*last_, stamp);
  bytes_ += message.bytes.size();
  images_.push_back(
      {*place, {stamp, images.size() - 1, {message.bytes.begin(), message.bytes.end()}}});
}

bool LeadIn::is_complete(const std::vector<BagTopic>& announced) const {
  const auto now = choice();
  if (!now.ok() || !now->depth_missing.empty()) return false;
  if (!topics_.rgb.empty() && !topics_.depth.empty()) return true;
  const auto told = static_cast<std::ptrdiff_t>(content().cameras.size());
  if (std::ranges::count_if(announced, is_camera) > told) return false;
  const auto shown = static_cast<std::ptrdiff_t>(content().images.size());
  return std::ranges::count_if(announced, shows_image) == shown;
}

bool LeadIn::is_too_long() const {
  return bytes_ > kMostLeadInBytes || images_.size() >= kMostLeadInImages ||
         (first_ && seconds_between(*last_, *first_) > kLongestLeadIn_s);
}

}  // namespace ygslam
