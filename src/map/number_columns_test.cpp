#include "map/number_columns.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "core/rng.hpp"

namespace ygslam::map_fields {
namespace {

/// The same bits, also where the values are no numbers that equal themselves.
template <typename T>
void expect_same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(T)), 0);
}

TEST(Zigzag, IsOneToOneAndSmallWhereStepsAre) {
  for (unsigned step = 0; step < 65536; ++step) {
    const auto s = static_cast<std::uint16_t>(step);
    EXPECT_EQ(unzigzag(zigzag(s)), s);
  }
  for (const int step : {0, -1, 1, -2, 2})
    EXPECT_EQ(zigzag(static_cast<std::uint64_t>(step)), step < 0 ? -2 * step - 1 : 2 * step);
  Rng rng(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const std::uint64_t step = rng.next();
    EXPECT_EQ(unzigzag(zigzag(step)), step);
  }
}

/// Writes the values with guesses, reads them, and gives the number of bytes that are not zero.
template <typename T>
std::size_t bytes_beyond(const std::vector<T>& values, const std::vector<T>& guesses) {
  ArchiveWriter out;
  const auto guess = [&](std::size_t i) { return guesses[i]; };
  guessed_column(
      out, values.size(), [&](std::size_t i) -> auto& { return values[i]; }, guess);
  ArchiveReader in(out.bytes());
  std::vector<T> back(values.size());
  guessed_column(
      in, back.size(), [&](std::size_t i) -> auto& { return back[i]; }, guess);
  in.check_end();
  EXPECT_TRUE(in.ok()) << in.fault();
  expect_same_bits(values, back);
  return static_cast<std::size_t>(
      std::ranges::count_if(out.bytes(), [](char byte) { return byte != 0; }));
}

TEST(GuessedColumn, IsExactWhateverIsGuessed) {
  Rng rng(2);
  std::vector<float> values = {0.0F,
                               -0.0F,
                               1e-45F,
                               -1.5F,
                               std::numeric_limits<float>::max(),
                               std::numeric_limits<float>::lowest()};
  std::vector<float> guesses = {1.0F, 0.0F, -1e30F, 1.5F, -7.0F, 0.0F};
  for (int i = 0; i < 1000; ++i) {
    for (std::vector<float>* numbers : {&values, &guesses}) {
      const double factor = rng.normal();
      numbers->push_back(static_cast<float>(factor * std::exp(rng.uniform(-50, 50))));
    }
  }
  bytes_beyond(values, guesses);
  bytes_beyond(std::vector<double>(values.begin(), values.end()),
               std::vector<double>(guesses.begin(), guesses.end()));
}

TEST(GuessedColumn, WhatIsGuessedRightIsNothing) {
  Rng rng(3);
  std::vector<float> values(500);
  for (float& v : values) v = static_cast<float>(rng.uniform(-600, 600));
  EXPECT_EQ(bytes_beyond(values, values), 0U);
  std::vector<float> next = values;
  for (float& v : next) v = std::nextafter(v, 1e9F);
  EXPECT_LE(bytes_beyond(values, next), values.size()) << "a byte for the last bit";
}

TEST(GuessedColumn, WhatIsNotFiniteIsRefused) {
  const std::vector<float> none = {1, std::numeric_limits<float>::infinity()};
  const auto guess = [](std::size_t) { return 1.0F; };
  ArchiveWriter out;
  guessed_column(
      out, 2, [&](std::size_t i) -> auto& { return none[i]; }, guess);
  ArchiveReader in(out.bytes());
  std::vector<float> back(2);
  guessed_column(
      in, 2, [&](std::size_t i) -> auto& { return back[i]; }, guess);
  EXPECT_FALSE(in.ok());
}

std::string written(const std::vector<float>& depth_m, Order order) {
  ArchiveWriter out;
  depths(out, depth_m.size(), order, [&](std::size_t i) -> auto& { return depth_m[i]; });
  return out.bytes();
}

/// @return bytes for each depth.
std::size_t expect_exact(const std::vector<float>& depth_m, Order order) {
  const std::string bytes = written(depth_m, order);
  ArchiveReader in(bytes);
  std::vector<float> back(depth_m.size());
  depths(in, back.size(), order, [&](std::size_t i) -> auto& { return back[i]; });
  in.check_end();
  EXPECT_TRUE(in.ok()) << in.fault();
  expect_same_bits(depth_m, back);
  return (bytes.size() - sizeof(float)) / depth_m.size();
}

TEST(Depths, WholeUnitsTakeHalf) {
  Rng rng(4);
  for (const Order order : {Order::kInOrder, Order::kMixed}) {
    for (const double per_metre : {5000.0, 1000.0}) {
      std::vector<float> depth_m = {0, 65535 * static_cast<float>(1 / per_metre), 0};
      for (int i = 0; i < 2000; ++i)
        depth_m.push_back(static_cast<float>(rng.below(65536)) * static_cast<float>(1 / per_metre));
      EXPECT_EQ(expect_exact(depth_m, order), sizeof(std::uint16_t));
    }
  }
}

TEST(Depths, AnyOthersStayAsTheyAre) {
  std::vector<float> whole;
  for (int i = 0; i < 100; ++i) whole.push_back(static_cast<float>(i) * static_cast<float>(1e-3));
  const float beyond = 65536 * static_cast<float>(1e-3);  // what 16 bits hold
  for (const float odd : {1.23456F, -0.0F, beyond, 1e9F, std::nextafter(whole[77], 1.0F)}) {
    std::vector<float> depth_m = whole;
    depth_m[50] = odd;
    for (const Order order : {Order::kInOrder, Order::kMixed})
      EXPECT_EQ(expect_exact(depth_m, order), sizeof(float)) << odd;
  }
  EXPECT_EQ(expect_exact({1.5F}, Order::kMixed), sizeof(std::uint16_t));
}

TEST(Depths, DamageIsSeen) {
  const std::string bytes = written({0, 0.002F, 1.5F}, Order::kMixed);
  std::vector<float> back(3);
  const auto depth_m = [&](std::size_t i) -> auto& { return back[i]; };
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    ArchiveReader in(std::string_view(bytes).substr(0, length));
    depths(in, 3, Order::kMixed, depth_m);
    EXPECT_FALSE(in.ok()) << length;
  }
  for (const float unit_m : {-0.001F, 1.0F, std::numeric_limits<float>::quiet_NaN()}) {
    std::string damaged = bytes;
    std::memcpy(damaged.data(), &unit_m, sizeof(unit_m));
    ArchiveReader in(damaged);
    depths(in, 3, Order::kMixed, depth_m);
    EXPECT_FALSE(in.ok()) << unit_m;
  }
}

}  // namespace
}  // namespace ygslam::map_fields
