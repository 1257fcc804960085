// Queue and snapshot: what two threads hand to each other arrives once, in order, and nobody
// waits for ever.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <numeric>
#include <thread>
#include <vector>

#include "core/bounded_queue.hpp"
#include "core/published.hpp"

namespace ygslam {
namespace {

TEST(BoundedQueue, GivesBackInOrder) {
  BoundedQueue<int> queue(8, Overflow::kBlock);
  for (int i = 0; i < 8; ++i) EXPECT_TRUE(queue.push(i));
  EXPECT_EQ(queue.size(), 8U);
  for (int i = 0; i < 8; ++i) EXPECT_EQ(queue.pop(), i);
  EXPECT_EQ(queue.try_pop(), std::nullopt);
}

TEST(BoundedQueue, DropsTheOldestAndCountsThem) {
  BoundedQueue<int> queue(3, Overflow::kDropOldest);
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(queue.push(i));
  EXPECT_EQ(queue.dropped(), 7U);
  EXPECT_EQ(queue.size(), 3U);
  for (int i = 7; i < 10; ++i) EXPECT_EQ(queue.pop(), i);
}

TEST(BoundedQueue, AClosedQueueDrainsAndTakesNoMore) {
  for (const Overflow overflow : {Overflow::kBlock, Overflow::kDropOldest}) {
    BoundedQueue<int> queue(2, overflow);
    queue.push(1);
    queue.push(2);
    queue.close();
    EXPECT_FALSE(queue.push(3));
    EXPECT_EQ(queue.dropped(), 0U);
    EXPECT_EQ(queue.pop(), 1);
    EXPECT_EQ(queue.pop(), 2);
    EXPECT_EQ(queue.pop(), std::nullopt);
  }
}

// The last entry may come between a wait in vain and the question whether more can come.
TEST(BoundedQueue, IsNotDrainedWhileSomethingIsLeft) {
  BoundedQueue<int> queue(2, Overflow::kBlock);
  EXPECT_EQ(queue.pop_until(std::chrono::steady_clock::now()), std::nullopt);
  EXPECT_FALSE(queue.is_drained()) << "more may come";
  queue.push(1);
  queue.close();
  EXPECT_TRUE(queue.is_closed());
  EXPECT_FALSE(queue.is_drained());
  EXPECT_EQ(queue.pop(), 1);
  EXPECT_TRUE(queue.is_drained());
}

TEST(BoundedQueue, CloseFreesBothSides) {
  BoundedQueue<int> full(1, Overflow::kBlock);
  full.push(1);
  BoundedQueue<int> empty(1, Overflow::kBlock);
  std::atomic<bool> pushed{true};
  std::optional<int> popped = 7;
  {
    const std::jthread producer([&] { pushed = full.push(2); });
    const std::jthread consumer([&] { popped = empty.pop(); });
    full.close();
    empty.close();
  }
  EXPECT_FALSE(pushed);
  EXPECT_EQ(popped, std::nullopt);
}

TEST(BoundedQueue, AStopTokenFreesTheConsumer) {
  BoundedQueue<int> queue(1, Overflow::kBlock);
  std::optional<int> popped = 7;
  {
    std::jthread consumer([&](const std::stop_token& stop) { popped = queue.pop(stop); });
    consumer.request_stop();
  }
  EXPECT_EQ(popped, std::nullopt);
}

TEST(BoundedQueue, BlockingLosesNothingBetweenThreads) {
  constexpr int kCount = 5000;
  BoundedQueue<int> queue(4, Overflow::kBlock);
  std::vector<int> received;
  {
    const std::jthread producer([&] {
      for (int i = 0; i < kCount; ++i) queue.push(i);
      queue.close();
    });
    while (const auto value = queue.pop()) {
      received.push_back(*value);
      ASSERT_LE(queue.size(), 4U);
    }
  }
  std::vector<int> expected(kCount);
  std::iota(expected.begin(), expected.end(), 0);
  EXPECT_EQ(received, expected);
  EXPECT_EQ(queue.dropped(), 0U);
}

TEST(BoundedQueue, DroppingKeepsOrderAndAccountsForEveryEntry) {
  constexpr std::size_t kCount = 5000;
  BoundedQueue<std::size_t> queue(4, Overflow::kDropOldest);
  std::vector<std::size_t> received;
  {
    const std::jthread producer([&] {
      for (std::size_t i = 0; i < kCount; ++i) queue.push(i);
      queue.close();
    });
    while (const auto value = queue.pop()) received.push_back(*value);
  }
  EXPECT_TRUE(std::is_sorted(received.begin(), received.end()));
  EXPECT_EQ(received.size() + queue.dropped(), kCount);
  EXPECT_EQ(received.back(), kCount - 1);
}

TEST(Published, ReadersSeeWholeSnapshotsThatOnlyGetNewer) {
  struct State {
    int version = 0;
    std::vector<int> copies;  // all equal to version
  };
  Published<State> published(std::make_shared<State>());
  std::atomic<bool> torn{false}, older{false};
  {
    const auto read = [&](const std::stop_token& stop) {
      int last = 0;
      while (!stop.stop_requested()) {
        const auto state = published.load();
        if (state->version < last) older = true;
        last = state->version;
        for (const int copy : state->copies) torn = torn || copy != state->version;
      }
    };
    const std::jthread one(read), two(read);
    for (int i = 1; i <= 2000; ++i)
      published.store(std::make_shared<State>(State{i, std::vector<int>(20, i)}));
  }
  EXPECT_FALSE(torn);
  EXPECT_FALSE(older);
  EXPECT_EQ(published.load()->version, 2000);
}

TEST(Published, ASnapshotOutlivesItsSuccessor) {
  Published<int> published(std::make_shared<int>(1));
  const auto first = published.load();
  published.store(std::make_shared<int>(2));
  EXPECT_EQ(*first, 1);
  EXPECT_EQ(*published.load(), 2);
}

}  // namespace
}  // namespace ygslam
