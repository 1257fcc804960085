// The surface: signed distance, colour, views and votes for objects in blocks of 8^3 voxels.
//
// All sums are whole numbers. A view at a pose adds the same numbers whenever and beside whatever
// it is added, so that contributions may come in any order and are taken back exactly; a block
// exists if and only if some view contributes to it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "geometry/se3.hpp"
#include "scene/scene.hpp"
#include "volume/block_store.hpp"
#include "volume/prepared_view.hpp"

namespace ygslam {

struct SurfaceConfig {
  double voxel_m = 0.02;
  double truncation_voxels = 3;  ///< the signed distance is kept up to this from the surface,
  double truncation_sigmas = 3;  ///< or up to this, if more
};

/// Votes of views for one object, by voxel of a block.
struct ObjectVotes {
  ObjectId object = kNoObject;
  std::uint32_t total = 0;
  std::array<std::uint16_t, kBlockCells> votes{};
};

/// Sums over the views that saw a voxel close to a surface. Voxel (x, y, z) of the block stands at
/// cell_offset(x, y, z).
struct alignas(64) SurfaceBlock {
  /// Distances [SurfaceLayer::quantum_m()] times weights; > 0 in front of the surface.
  std::array<std::int32_t, kBlockCells> weighted_distance{};
  std::array<std::uint16_t, kBlockCells> weight{};
  std::array<std::uint16_t, kBlockCells> views{};
  /// Red | green << 21 | blue << 42.
  std::array<std::uint64_t, kBlockCells> colour{};
  /// In ascending order of objects, none without a vote. A view that does not vote for any object
  /// has seen something else there.
  std::vector<ObjectVotes> votes;
  std::uint32_t contributions = 0;  ///< sum of views
  std::uint64_t revision = 0;       ///< SurfaceLayer::revision() of the last change

  void vote(ObjectId object, int voxel, int sign);
  /// @return the object with most votes at a voxel, the lowest number among equals, and its share
  /// of the views; kNoObject where more views voted for none.
  [[nodiscard]] SurfaceLabel label(int voxel) const;
  [[nodiscard]] Rgb8 mean_colour(int voxel) const;
};

class SurfaceLayer {
 public:
  explicit SurfaceLayer(const SurfaceConfig& config, const DepthNoise& noise);

  /// Adds (sign 1) or takes back (sign -1) what a view at a pose contributes. What is taken back
  /// must have been added.
  void fuse(const PreparedView& view, const SE3& T_world_camera, int sign, int threads);

  [[nodiscard]] const SurfaceConfig& config() const { return config_; }
  [[nodiscard]] double quantum_m() const { return quantum_m_; }
  /// Counts changes.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  [[nodiscard]] const BlockStore<SurfaceBlock>& blocks() const { return blocks_; }
  [[nodiscard]] std::size_t memory_bytes() const;
  /// Of what is in the blocks, in whatever order it came.
  [[nodiscard]] std::uint64_t fingerprint() const;

 private:
  void find_touched(const PreparedView& view, const SE3& T_world_camera);

  SurfaceConfig config_;
  DepthNoise noise_;
  double quantum_m_;
  BlockStore<SurfaceBlock> blocks_;
  std::uint64_t revision_ = 0;
  BlockSet touched_;  // by the view being fused
};

}  // namespace ygslam
