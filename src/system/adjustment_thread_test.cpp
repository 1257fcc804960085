#include "system/adjustment_thread.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "map/map_test_world.hpp"

namespace ygslam {
namespace {

TEST(AdjustmentThread, GivesItsResultOnce) {
  map_test::World world(300, 31);
  const Map map = map_test::true_map(world, 6, {.noise_px = 0.5}).map;
  AdjustmentThread thread(world.camera(), {});
  EXPECT_FALSE(thread.take_result());
  EXPECT_FALSE(thread.is_pending());
  thread.start(make_full_adjustment(map, {}));
  thread.finish();
  EXPECT_TRUE(thread.is_pending());
  const auto patch = thread.take_result();
  ASSERT_TRUE(patch);
  EXPECT_EQ(patch->poses.size(), 6U);
  EXPECT_FALSE(thread.take_result());
  EXPECT_FALSE(thread.is_pending());
}

TEST(AdjustmentThread, ANewJobReplacesTheOld) {
  map_test::World world(300, 32);
  const Map old = map_test::true_map(world, 8, {.noise_px = 0.5}).map;
  const Map newer = map_test::true_map(world, 4, {.noise_px = 0.5}).map;
  AdjustmentThread thread(world.camera(), {});
  thread.start(make_full_adjustment(old, {}));
  thread.start(make_full_adjustment(newer, {}));
  thread.finish();
  const auto patch = thread.take_result();
  ASSERT_TRUE(patch);
  EXPECT_EQ(patch->poses.size(), 4U);
  thread.start(make_full_adjustment(old, {}));
  EXPECT_TRUE(thread.is_pending());
  thread.give_up();
  EXPECT_FALSE(thread.take_result());
  EXPECT_FALSE(thread.is_pending());
}

TEST(AdjustmentThread, WhoWaitsForAJobMayHaveItGivenUp) {
  map_test::World world(2000, 34);
  const Map map = map_test::true_map(world, 40, {.noise_px = 0.5}).map;
  AdjustmentThread thread(world.camera(), {});
  thread.start(make_full_adjustment(map, {}));
  const std::atomic<bool> abort{true};
  thread.finish(&abort);
  EXPECT_FALSE(thread.take_result());
}

TEST(AdjustmentThread, AJobThatFailsSaysSoWhenItsResultIsAskedFor) {
  map_test::World world(300, 33);
  FullAdjustment job = make_full_adjustment(map_test::true_map(world, 3).map, {});
  job.window.problem.observations.front().pose = 99;  // there are three
  AdjustmentThread thread(world.camera(), {});
  thread.start(job);
  EXPECT_THROW(
      {
        while (!thread.take_result()) std::this_thread::yield();
      },
      InternalError);
}

TEST(AdjustmentThread, AFailureIsToldThoughANewJobReplacesTheOld) {
  map_test::World world(300, 34);
  FullAdjustment job = make_full_adjustment(map_test::true_map(world, 3).map, {});
  AdjustmentThread thread(world.camera(), {});
  FullAdjustment wrong = job;
  wrong.window.problem.observations.front().pose = 99;  // there are three
  thread.start(wrong);
  EXPECT_THROW(thread.finish(), InternalError);  // it has failed by now
  thread.start(job);
  EXPECT_THROW(static_cast<void>(thread.take_result()), InternalError);
  thread.give_up();
  EXPECT_THROW(static_cast<void>(thread.take_result()), InternalError);
}

}  // namespace
}  // namespace ygslam
