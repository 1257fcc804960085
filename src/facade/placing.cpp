#include "facade/placing.hpp"

namespace ygslam::api {
namespace {

constexpr std::uint32_t kTries = 4;  // with the place that the try before brought into view
constexpr std::int64_t kStep_ns = 1'000'000'000;

}  // namespace

std::optional<SE3> place_in(const Map& map, const RgbdFrame& frame, const Camera& camera,
                            SlamConfig config) {
  if (map.keyframes().empty()) return std::nullopt;
  config.dynamic.mode = DynamicMode::kOff;
  config.dense.enabled = false;
  config.run.keep_trajectory = false;
  MapUse use;
  use.start = map;
  use.start->forget_frames();
  use.frozen = true;
  const auto runner = make_offline_runner(config, camera, nullptr, std::move(use));
  for (std::uint32_t i = 0; i < kTries; ++i) {
    auto again = std::make_shared<RgbdFrame>(frame);
    again->id = FrameId{i};
    again->stamp = {static_cast<std::int64_t>(i) * kStep_ns};
    const TrackResult result = runner->process(again);
    if (result.state == TrackState::kTracking) return result.T_world_camera;
  }
  return std::nullopt;
}

}  // namespace ygslam::api
