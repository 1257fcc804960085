#include "volume/block_store.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "core/rng.hpp"

namespace ygslam {
namespace {

TEST(BlockKey, NamesEveryPlaceInItsOrder) {
  const std::vector<Eigen::Vector3i> ascending{{kBlockBias - 1, kBlockBias - 1, -kBlockBias},
                                               {5, -3, -1},
                                               {-7, -2, -1},
                                               {0, 0, 0},
                                               {1, 0, 0},
                                               {-9, 1, 0},
                                               {kBlockBias - 1, 0, 7}};
  for (std::size_t i = 0; i < ascending.size(); ++i) {
    EXPECT_EQ(block_of(block_key(ascending[i])), ascending[i]);
    if (i > 0) {
      EXPECT_LT(block_key(ascending[i - 1]), block_key(ascending[i]));
    }
  }
}

TEST(BlockStore, DoesWhatAMapDoes) {
  struct Cell {
    int value = 0;
  };
  Rng rng(3);
  BlockStore<Cell> store;
  std::map<BlockKey, int> truth;
  for (int step = 0; step < 200000; ++step) {
    const auto place = [&] { return static_cast<int>(rng.below(24)) - 12; };
    const BlockKey key = block_key({place(), place(), place()});
    const bool shrinking = step / 40000 % 2 == 1;
    if (rng.uniform() < (shrinking ? 0.3 : 0.7)) {
      Cell& cell = store.obtain(key);
      ASSERT_EQ(cell.value, truth[key]);
      cell.value = truth[key] = step + 1;
    } else if (truth.contains(key)) {
      store.find(key)->value = 0;
      store.release(key);
      truth.erase(key);
    } else {
      ASSERT_EQ(store.find(key), nullptr);
    }
    ASSERT_EQ(store.size(), truth.size());
  }
  std::vector<BlockKey> keys;
  for (const auto& [key, value] : truth) {
    keys.push_back(key);
    ASSERT_NE(store.find(key), nullptr);
    EXPECT_EQ(store.find(key)->value, value);
  }
  EXPECT_EQ(store.keys(), keys);
  EXPECT_THROW(store.release(block_key({99, 99, 99})), InternalError);
}

TEST(BlockSet, HoldsEachPlaceOnce) {
  Rng rng(4);
  BlockSet set;
  for (int round = 0; round < 2; ++round) {
    std::set<BlockKey> truth;
    for (int i = 0; i < 30000; ++i) {
      const auto place = [&] { return static_cast<int>(rng.below(30)); };
      const BlockKey key = block_key({place(), place(), place()});
      set.insert(key);
      truth.insert(key);
    }
    EXPECT_EQ(set.keys().size(), truth.size());
    EXPECT_EQ(std::set<BlockKey>(set.keys().begin(), set.keys().end()), truth);
    set.clear();
    EXPECT_TRUE(set.keys().empty());
  }
}

}  // namespace
}  // namespace ygslam
