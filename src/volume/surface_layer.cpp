#include "volume/surface_layer.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "core/parallel.hpp"
#include "volume/content_hash.hpp"
#include "volume/surface_kernel.hpp"

namespace ygslam {
namespace {

constexpr double kQuantaPerVoxel = 512;
constexpr int kSampleStride_px = 2;
constexpr int kBlocksAtOnce = 32;
constexpr std::uint64_t kColourMask = (std::uint64_t{1} << 21) - 1;

}  // namespace

void SurfaceBlock::vote(ObjectId object, int voxel, int sign) {
  const auto place = std::lower_bound(
      votes.begin(), votes.end(), object,
      [](const ObjectVotes& entry, ObjectId wanted) { return entry.object < wanted; });
  auto entry = place;
  if (entry == votes.end() || entry->object != object) {
    CHECK(sign > 0, "votes taken back that were never given");
    entry = votes.emplace(place);
    entry->object = object;
  }
  std::uint16_t& count = entry->votes[static_cast<std::size_t>(voxel)];
  count = static_cast<std::uint16_t>(count + sign);
  entry->total += static_cast<std::uint32_t>(sign);
  if (entry->total == 0) votes.erase(entry);
  if (votes.empty()) votes = {};  // gives the memory back
}

SurfaceLabel SurfaceBlock::label(int voxel) const {
  const auto i = static_cast<std::size_t>(voxel);
  SurfaceLabel label;
  if (views[i] == 0) return label;
  int most = 0, none = views[i];
  for (const ObjectVotes& entry : votes) {
    none -= entry.votes[i];
    if (entry.votes[i] <= most) continue;
    most = entry.votes[i];
    label.object = entry.object;
  }
  if (most < none) {
    label.object = kNoObject;
    most = none;
  }
  label.probability = static_cast<float>(most) / static_cast<float>(views[i]);
  return label;
}

Rgb8 SurfaceBlock::mean_colour(int voxel) const {
  const auto i = static_cast<std::size_t>(voxel);
  if (views[i] == 0) return {};
  const auto mean = [&](int shift) {
    const std::uint64_t sum = (colour[i] >> shift) & kColourMask;
    return static_cast<std::uint8_t>((sum + views[i] / 2U) / views[i]);
  };
  return {mean(0), mean(21), mean(42)};
}

SurfaceLayer::SurfaceLayer(const SurfaceConfig& config, const DepthNoise& noise)
    : config_(config), noise_(noise), quantum_m_(config.voxel_m / kQuantaPerVoxel) {
  CHECK(config.voxel_m > 0 && config.truncation_voxels >= 1 && config.truncation_sigmas >= 0);
}

void SurfaceLayer::find_touched(const PreparedView& view, const SE3& T_world_camera) {
  const Pinhole& camera = view.camera();
  constexpr int kTile = DepthPyramid::kTile_px;
  const int columns = (camera.width + kTile - 1) / kTile;
  const double block_m = kBlockSide * config_.voxel_m;
  const Eigen::Matrix3f R = T_world_camera.R().cast<float>();
  const Vec3 t_blocks = T_world_camera.t() / block_m;
  const auto per_block = static_cast<float>(1 / block_m);
  const auto least_m = static_cast<float>(config_.truncation_voxels * config_.voxel_m);
  const auto unit_m = static_cast<float>(DepthView::kUnit_m);
  const auto inverse_fx = static_cast<float>(1 / camera.fx);
  const auto inverse_fy = static_cast<float>(1 / camera.fy);
  // Pixels between samples belong to points this far from them.
  const float gap = 0.75F * kSampleStride_px * std::max(inverse_fx, inverse_fy);
  touched_.clear();
  Eigen::Vector3i last_low(0, 0, 0), last_high(-1, -1, -1);
  const auto touch = [&](int u, int v, const Eigen::Vector3f& normal_world) {
    const std::uint32_t geometry = view.geometry()[v * camera.width + u];
    if (geometry >> 24 == 0) return;
    const float depth_m = static_cast<float>(geometry & 0xffffU) * unit_m;
    const Eigen::Vector3f p_camera(
        (static_cast<float>(u) - static_cast<float>(camera.cx)) * inverse_fx * depth_m,
        (static_cast<float>(v) - static_cast<float>(camera.cy)) * inverse_fy * depth_m, depth_m);
    const float beyond_m = depth_m - static_cast<float>(noise_.from_m);
    const float sigma_m = static_cast<float>(noise_.base_m) +
                          static_cast<float>(noise_.factor_per_m) * beyond_m * beyond_m;
    const float band_m = std::max(least_m, static_cast<float>(config_.truncation_sigmas) * sigma_m);
    const Eigen::Vector3f reach = (band_m * normal_world.cwiseAbs()).array() + gap * depth_m;
    const Vec3 middle = (R * p_camera * per_block).cast<double>() + t_blocks;
    const Vec3 extent = (reach * per_block).cast<double>();
    if (!(middle.cwiseAbs().maxCoeff() < kBlockBias / 2)) return;
    const Eigen::Vector3i low = (middle - extent).array().floor().cast<int>();
    const Eigen::Vector3i high = (middle + extent).array().floor().cast<int>();
    if (low == last_low && high == last_high) return;
    last_low = low;
    last_high = high;
    for (int z = low.z(); z <= high.z(); ++z)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int x = low.x(); x <= high.x(); ++x) touched_.insert(block_key({x, y, z}));
  };
  for (int v = 0; v < camera.height; v += kSampleStride_px) {
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector3f normal_world =
          R * view.tile_normals()[static_cast<std::size_t>(v / kTile * columns + column)];
      const int end = std::min((column + 1) * kTile, camera.width);
      for (int u = column * kTile; u < end; u += kSampleStride_px) touch(u, v, normal_world);
    }
  }
}

void SurfaceLayer::fuse(const PreparedView& view, const SE3& T_world_camera, int sign,
                        int threads) {
  CHECK((sign == 1 || sign == -1) && T_world_camera.is_finite());
  find_touched(view, T_world_camera);
  ++revision_;
  std::vector<BlockKey> keys;
  std::vector<SurfaceBlock*> blocks;
  for (const BlockKey key : touched_.keys()) {
    SurfaceBlock* block = sign > 0 ? &blocks_.obtain(key) : blocks_.find(key);
    if (block == nullptr) continue;
    keys.push_back(key);
    blocks.push_back(block);
  }
  const SurfaceProjection projection(view, T_world_camera, config_, noise_, quantum_m_);
  const int count = static_cast<int>(keys.size());
  parallel_for((count + kBlocksAtOnce - 1) / kBlocksAtOnce, threads, [&](int chunk) {
    const int end = std::min((chunk + 1) * kBlocksAtOnce, count);
    for (int k = chunk * kBlocksAtOnce; k < end; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const int voxels = fuse_block(projection, keys[i], sign, *blocks[i]);
      if (voxels == 0) continue;
      CHECK(sign > 0 || blocks[i]->contributions >= static_cast<std::uint32_t>(voxels),
            "a view taken back that was never added");
      blocks[i]->contributions += static_cast<std::uint32_t>(sign * voxels);
      blocks[i]->revision = revision_;
    }
  });
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (blocks[i]->contributions != 0) continue;
    blocks[i]->revision = 0;
    blocks_.release(keys[i]);
  }
}

std::size_t SurfaceLayer::memory_bytes() const {
  std::size_t bytes = blocks_.memory_bytes();
  for (const BlockKey key : blocks_.keys())
    bytes += blocks_.find(key)->votes.capacity() * sizeof(ObjectVotes);
  return bytes;
}

std::uint64_t SurfaceLayer::fingerprint() const {
  ContentHash hash;
  for (const BlockKey key : blocks_.keys()) {
    const SurfaceBlock& block = *blocks_.find(key);
    hash.add(key);
    hash.add_all(block.weighted_distance);
    hash.add_all(block.weight);
    hash.add_all(block.views);
    hash.add_all(block.colour);
    for (const ObjectVotes& entry : block.votes) {
      hash.add(static_cast<std::uint64_t>(entry.object));
      hash.add_all(entry.votes);
    }
  }
  return hash.value();
}

}  // namespace ygslam
