#include "system/result_route.hpp"

namespace ygslam {
namespace {

/// Whether a frame of a submap without a place is to be looked for in the rest of the map.
bool asks_for_place(const RgbdFrame& frame, const TrackResult& result) {
  constexpr std::uint32_t kEveryFrames = 10;
  return result.unplaced && index(frame.id) % kEveryFrames == 0;
}

}  // namespace

std::optional<FrameMessage> ResultRoute::frame_message(const FramePtr& frame, TrackResult& result) {
  auto offered = offer_.step(frame, result);
  if (result.candidate) {
    // The very first keyframe may come with a later frame, whose labels are not those of its
    // points.
    const bool is_of_this_frame = result.candidate->features == result.features;
    KeyframeMessage message{std::move(*result.candidate), {}};
    if (is_of_this_frame) message.labels = result.labels.label;
    return message;
  }
  if (offered) return std::move(*offered);
  return std::nullopt;
}

std::vector<MapRequest> ResultRoute::requests(const RgbdFrame& frame, const TrackResult& result) {
  std::vector<MapRequest> requests;
  if (result.imu_retraction) requests.emplace_back(*result.imu_retraction);
  if (result.shutter && result.shutter->taken_over) requests.emplace_back(*result.shutter);
  if (result.ego_mask_grew) requests.emplace_back(result.ego_mask);
  if (asks_for_place(frame, result))
    requests.emplace_back(PlaceRequest{result.features, result.labels.weight, result.pose});
  if (result.wanted_view) requests.emplace_back(*result.wanted_view);
  if (result.state == TrackState::kLost || result.state == TrackState::kCoasting)
    requests.emplace_back(PlaceRequest{result.features, result.labels.weight, std::nullopt});
  return requests;
}

}  // namespace ygslam
