// The ground plan while the map grows: columns of space above the floor, kept up to date where
// something changed. What stands is what the space layer says, but the last views decide about what
// was seen through since: counts of all views would keep a ghost for as long as it stood there.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "core/time.hpp"
#include "scene/scene.hpp"
#include "volume/space_layer.hpp"

namespace ygslam {

/// Heights are above the floor.
struct GroundPlanConfig {
  double low_m = 0.10;         ///< what is lower can be driven over
  double high_m = 1.50;        ///< what is higher can be driven under
  double floor_seen_m = 0.30;  ///< air seen free below this vouches for the floor under it
  double hidden_m = 0.05;  ///< a part of the column so high that nobody saw may hold an obstacle
  int min_views = 2;       ///< that an obstacle needs: ReadingConfig's
  int young_hits = 4;      ///< of what so few views saw, one view through disposes; of others two
};

enum class GroundState : std::int8_t { kUnknown = -1, kFree = 0, kOccupied = 100 };

/// In the floor's frame (scene/floor_frame.hpp); row 0 has the smallest y. Its borders lie on
/// multiples of eight cells, so that it does not change its size with each view.
struct GroundGrid {
  int width = 0, height = 0;  ///< 0: nothing is known, or no floor
  double cell_m = 0;
  Vec2 origin_floor = Vec2::Zero();  ///< lower left corner of the first cell
  std::vector<GroundState> cells;
  SE3 T_world_floor;
};

class GroundPlan {
 public:
  explicit GroundPlan(const GroundPlanConfig& config) : config_(config) {}

  /// What the newest view observed, in the order of views.
  void observe(const SeenSpace& seen);
  /// What a view observed that was put in anew, at another pose: its surfaces stand again, but
  /// where those that came later see through. @param later what they observe, the newest first.
  void reobserve(const SeenSpace& seen, const std::vector<const SeenSpace*>& later);
  /// Where the floor is; without one there is no plan. Little changes are left out, for all columns
  /// are laid anew.
  void set_floor(const Gravity& gravity);
  [[nodiscard]] bool has_floor() const { return floor_.has_value(); }
  /// Brings the columns up to date. @param changed blocks of the layer since the last call.
  void update(const SpaceLayer& space, const std::vector<BlockKey>& changed);
  [[nodiscard]] GroundGrid grid() const;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  enum class CellState : std::uint8_t { kNothing, kFree, kOccupied };
  /// What is known of a block's cells, as it was laid into the columns.
  struct Block {
    std::array<CellState, kBlockCells> known{};
    std::array<std::uint8_t, kBlockCells> through{};  // views in a row, the last ones
  };
  static constexpr int kSide = 8;  // columns of a tile
  /// Eighths of cells that lie in each layer of each column.
  struct Tile {
    std::vector<std::uint8_t> free;  // by halves of layers
    std::vector<std::uint8_t> occupied;
    std::array<std::uint16_t, kSide * kSide> floor{};
    std::array<GroundState, kSide * kSide> state{};
    bool is_changed = false;
  };
  struct Lattice;

  [[nodiscard]] int layers() const;
  void add_part(const Vec3& p, CellState what, int count);
  void project(const Lattice& lattice, const SpaceLayer& space, BlockKey key);
  void rebuild(const SpaceLayer& space, const std::vector<BlockKey>& changed);
  [[nodiscard]] Tile& tile(int x, int y);
  [[nodiscard]] GroundState judged(const Tile& tile, int column) const;
  [[nodiscard]] CellState known(const SpaceCounts& counts, int through) const;

  GroundPlanConfig config_;
  double cell_m_ = 0;
  std::optional<Gravity> floor_;
  SE3 T_world_floor_;
  bool is_built_ = false;  // with this floor
  std::unordered_map<BlockKey, Block> blocks_;
  std::unordered_map<BlockKey, Tile> tiles_;
  std::vector<BlockKey> observed_;  // blocks in which views in a row changed
};

}  // namespace ygslam
