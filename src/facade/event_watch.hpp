// Tells what happened from one frame to the next.
#pragma once

#include <vector>

#include "tracking/track_result.hpp"
#include "ygslam/slam.hpp"

namespace ygslam::api {

class EventWatch {
 public:
  /// To be told with the next frame.
  void add(Event event) { waiting_.push_back(event); }
  /// @param closed_loops so far.
  [[nodiscard]] std::vector<Event> step(const TrackResult& tracked, int closed_loops);
  /// A new world: loops are counted from 0, nothing was lost.
  void restart();

 private:
  std::vector<Event> waiting_;
  TrackState state_ = TrackState::kWaiting;  // of the frame before
  int closed_loops_ = 0;
};

}  // namespace ygslam::api
