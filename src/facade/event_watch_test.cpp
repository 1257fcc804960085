#include "facade/event_watch.hpp"

#include <gtest/gtest.h>

namespace ygslam::api {
namespace {

using Events = std::vector<Event>;

TrackResult in_state(TrackState state) {
  TrackResult result;
  result.state = state;
  return result;
}

TEST(EventWatch, TellsEachChangeOnce) {
  EventWatch watch;
  EXPECT_EQ(watch.step(in_state(TrackState::kTracking), 0), Events{});
  EXPECT_EQ(watch.step(in_state(TrackState::kLost), 0), Events{Event::kLost});
  EXPECT_EQ(watch.step(in_state(TrackState::kLost), 0), Events{});
  EXPECT_EQ(watch.step(in_state(TrackState::kWeak), 0), Events{Event::kRelocalised});
  EXPECT_EQ(watch.step(in_state(TrackState::kTracking), 2), Events{Event::kLoopClosed});
  EXPECT_EQ(watch.step(in_state(TrackState::kTracking), 2), Events{});
  watch.add(Event::kMapSaved);
  EXPECT_EQ(watch.step(in_state(TrackState::kTracking), 2), Events{Event::kMapSaved});
}

TEST(EventWatch, TellsOfTheCameraWhereItsTimesAreTakenOver) {
  EventWatch watch;
  TrackResult result = in_state(TrackState::kTracking);
  result.shutter.emplace();
  result.shutter->taken_over = false;
  EXPECT_EQ(watch.step(result, 0), Events{});
  result.shutter->taken_over = true;
  EXPECT_EQ(watch.step(result, 0), Events{Event::kCameraLearned});
}

TEST(EventWatch, ANewWorldCountsItsOwnLoops) {
  EventWatch watch;
  EXPECT_EQ(watch.step(in_state(TrackState::kLost), 3).size(), 2U);
  watch.restart();
  EXPECT_EQ(watch.step(in_state(TrackState::kTracking), 0), Events{});
  EXPECT_EQ(watch.step(in_state(TrackState::kTracking), 1), Events{Event::kLoopClosed});
}

}  // namespace
}  // namespace ygslam::api
