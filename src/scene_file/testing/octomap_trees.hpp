// OctoMap as the referee of our files, behind a plain interface: its headers, which are no C++20,
// stay in one file.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string_view>

namespace ygslam::testing::octomap_trees {

struct Leaf {
  std::array<std::uint16_t, 3> key{};  ///< OctoMap's: cell index + 32768, for x, y and z
  float log_odds = 0;
  bool coloured = false;
  std::array<std::uint8_t, 3> rgb{};
};

/// Fills in the next leaf; false when there is none left.
using LeafSource = std::function<bool(Leaf&)>;
using ByteSink = std::function<void(std::string_view)>;

/// A plain OcTree in its binary form: occupied or free by the sign of the log-odds, pruned.
void write_bt(double cell_m, const LeafSource& leaves, const ByteSink& sink);
/// A ColorOcTree, every leaf as it was given.
void write_ot(double cell_m, const LeafSource& leaves, const ByteSink& sink);

}  // namespace ygslam::testing::octomap_trees
