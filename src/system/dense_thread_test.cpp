#include "system/dense_thread.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <future>
#include <mutex>
#include <thread>
#include <utility>

#include "geometry/geometry_testing.hpp"

namespace ygslam {
namespace {

Camera small_camera() { return geometry_test::test_camera(65, 80, 60); }

/// A wall two metres ahead, from places beside each other; each update moves the ones before a bit.
std::vector<DenseUpdate> walk(const Camera& camera, std::uint32_t views) {
  auto frame = std::make_shared<RgbdFrame>();
  frame->colour = ColourImage(camera.width(), camera.height());
  frame->depth_m = DepthImage(camera.width(), camera.height());
  for (float& depth_m : frame->depth_m) depth_m = 2;
  std::vector<DenseUpdate> updates(views);
  for (std::uint32_t i = 0; i < views; ++i) {
    DenseFrame& keyframe = updates[i].added.emplace_back();
    keyframe.id = KeyframeId{i};
    keyframe.frame = frame;
    for (std::uint32_t k = 0; k <= i; ++k)
      updates[i].T_world_camera[KeyframeId{k}] =
          SE3(Mat3::Identity(), Vec3(0.1 * k + 0.02 * i, 0, 0.001 * i));
  }
  return updates;
}

TEST(DenseThread, ComesToTheSameAsOneStageAfterTheOther) {
  const Camera camera = small_camera();
  const auto updates = walk(camera, 8);
  DenseThread thread({}, camera);
  std::size_t seen = 0;
  for (const DenseUpdate& update : updates) {
    thread.apply(update);
    thread.inspect([&](DenseMap& map) { seen += map.cloud().size(); });
  }
  thread.finish();
  thread.finish();
  DenseMap map({}, camera);
  for (const DenseUpdate& update : updates) map.apply(update);
  map.finish();
  std::uint64_t fingerprint = 0;
  thread.inspect([&](DenseMap& of_thread) { fingerprint = of_thread.volume().fingerprint(); });
  EXPECT_EQ(fingerprint, map.volume().fingerprint());
  EXPECT_GT(map.volume().views(), 0);
}

TEST(DenseThread, EndsWhereNobodyWaitsForIt) {
  const Camera camera = small_camera();
  const auto updates = walk(camera, 3);
  for (int i = 0; i < 20; ++i) {
    DenseThread thread({}, camera);
    for (const DenseUpdate& update : updates) thread.apply(update);
  }
}

/// All of a walk as one update, as after a time in which the thread had no room.
DenseUpdate walk_at_once(const Camera& camera, std::uint32_t views) {
  std::vector<DenseUpdate> updates = walk(camera, views);
  DenseUpdate all = std::move(updates.back());
  all.added.clear();
  for (std::uint32_t i = 0; i + 1 < views; ++i) all.added.push_back(updates[i].added.front());
  return all;
}

TEST(DenseThread, IsBehindWithOneUpdateOfManyFrames) {
  const Camera camera = small_camera();
  DenseThread thread({}, camera);
  thread.inspect([&](DenseMap&) {  // it cannot work meanwhile
    thread.apply(walk_at_once(camera, 5));
    EXPECT_FALSE(thread.is_behind());
    thread.apply(walk_at_once(camera, 40));
    EXPECT_TRUE(thread.is_behind());
    EXPECT_FALSE(thread.is_full());
    thread.apply(walk_at_once(camera, 40));
    EXPECT_TRUE(thread.is_full());
  });
  thread.finish();
  EXPECT_FALSE(thread.is_behind());
}

TEST(DenseThread, WhoLooksGoesBeforeTheNextStep) {
  const Camera camera = small_camera();
  DenseThread* its_thread = nullptr;
  std::jthread other;
  int shown = -1;
  std::promise<int> looked;
  const auto show = [&](const DenseMap& map) {
    if (std::exchange(shown, map.volume().views()) >= 0) return;
    other = std::jthread([&, views_then = shown] {
      its_thread->inspect(
          [&](const DenseMap& now) { looked.set_value(now.volume().views() - views_then); });
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // until it waits
  };
  DenseThread thread({}, camera, {show, 0});
  its_thread = &thread;
  thread.apply(walk_at_once(camera, 60));
  EXPECT_EQ(looked.get_future().get(), 0) << "nothing was done between";
  thread.finish();
  EXPECT_EQ(shown, 59);
}

TEST(DenseThread, CountsNoFramesThatItDoesNotTake) {
  const Camera camera = small_camera();
  DenseThread thread({}, camera);
  thread.finish();
  thread.apply(walk_at_once(camera, 80));
  EXPECT_FALSE(thread.is_full());
  EXPECT_FALSE(thread.is_behind());
}

TEST(DenseThread, ShowsTheMapWhileNothingComesAnyMore) {
  const Camera camera = small_camera();
  const auto updates = walk(camera, 6);
  std::mutex mutex;
  std::condition_variable shown;
  int views = 0;
  const auto look = [&](DenseMap& map) {
    const std::lock_guard lock(mutex);
    views = map.volume().views();
    shown.notify_all();
  };
  DenseThread thread({}, camera, {look, 0.01});
  for (const DenseUpdate& update : updates) thread.apply(update);
  std::unique_lock lock(mutex);
  EXPECT_TRUE(shown.wait_for(lock, std::chrono::seconds(60), [&] { return views == 6; }));
}

TEST(DenseThread, ShowsAtOnceWhatCannotWaitForTheRest) {
  const Camera camera = small_camera();
  std::mutex mutex;
  std::condition_variable shown;
  int views = 0, slow = 0;
  DenseSink sink;
  sink.every_s = 1e6;
  sink.look = [&](DenseMap&) { ++slow; };
  sink.look_at_once = [&](DenseMap& map) {
    const std::lock_guard lock(mutex);
    views = map.volume().views();
    shown.notify_all();
  };
  DenseThread thread({}, camera, sink);
  for (const DenseUpdate& update : walk(camera, 6)) thread.apply(update);
  {
    std::unique_lock lock(mutex);
    EXPECT_TRUE(shown.wait_for(lock, std::chrono::seconds(60), [&] { return views == 6; }));
  }
  thread.finish();
  EXPECT_EQ(slow, 1);
}

}  // namespace
}  // namespace ygslam
