#include "facade/event_watch.hpp"

#include <utility>

namespace ygslam::api {

std::vector<Event> EventWatch::step(const TrackResult& tracked, int closed_loops) {
  const bool was_lost = std::exchange(state_, tracked.state) == TrackState::kLost;
  const bool is_lost = tracked.state == TrackState::kLost;
  if (is_lost && !was_lost) add(Event::kLost);
  if (was_lost && !is_lost) add(Event::kRelocalised);
  if (tracked.candidate) add(Event::kKeyframe);
  if (closed_loops > std::exchange(closed_loops_, closed_loops)) add(Event::kLoopClosed);
  if (tracked.shutter && tracked.shutter->taken_over) add(Event::kCameraLearned);
  return std::exchange(waiting_, {});
}

void EventWatch::restart() {
  state_ = TrackState::kWaiting;
  closed_loops_ = 0;
}

}  // namespace ygslam::api
