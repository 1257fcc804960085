#include "volume/surface_layer.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "core/content_hash.hpp"
#include "core/parallel.hpp"
#include "volume/surface_kernel.hpp"
#include "volume/surface_reach.hpp"

namespace ygslam {
namespace {

constexpr double kQuantaPerVoxel = 512;
constexpr int kBlocksAtOnce = 32;
constexpr std::size_t kBricksAtOnce = 64;
constexpr std::uint64_t kColourMask = (std::uint64_t{1} << 21) - 1;

}  // namespace

SurfaceBrick* BrickPool::obtain() {
  const std::scoped_lock lock(*mutex_);
  if (free_.empty()) {
    chunks_.push_back(std::make_unique<SurfaceBrick[]>(kBricksAtOnce));
    for (std::size_t i = kBricksAtOnce; i-- > 0;) free_.push_back(&chunks_.back()[i]);
  }
  SurfaceBrick* brick = free_.back();
  free_.pop_back();
  return brick;
}

void BrickPool::release(SurfaceBrick* brick) {
  const std::scoped_lock lock(*mutex_);
  free_.push_back(brick);
}

std::size_t BrickPool::memory_bytes() const {
  const std::scoped_lock lock(*mutex_);
  return chunks_.size() * kBricksAtOnce * sizeof(SurfaceBrick) +
         free_.capacity() * sizeof(SurfaceBrick*);
}

Rgb8 SurfaceBrick::mean_colour(int voxel) const {
  const auto i = static_cast<std::size_t>(voxel);
  if (views[i] == 0) return {};
  const auto mean = [&](int shift) {
    const std::uint64_t sum = (colour[i] >> shift) & kColourMask;
    return static_cast<std::uint8_t>((sum + views[i] / 2U) / views[i]);
  };
  return {mean(0), mean(21), mean(42)};
}

void SurfaceBlock::vote(SceneObjectId object, int offset, int sign) {
  const auto place = std::lower_bound(
      votes.begin(), votes.end(), object,
      [](const ObjectVotes& entry, SceneObjectId wanted) { return entry.object < wanted; });
  auto entry = place;
  if (entry == votes.end() || entry->object != object) {
    CHECK(sign > 0, "votes taken back that were never given");
    entry = votes.emplace(place);
    entry->object = object;
  }
  std::uint16_t& count = entry->votes[static_cast<std::size_t>(offset)];
  count = static_cast<std::uint16_t>(count + sign);
  entry->total += static_cast<std::uint32_t>(sign);
  if (entry->total == 0) votes.erase(entry);
  if (votes.empty()) votes = {};  // gives the memory back
}

SurfaceLabel SurfaceBlock::label(int offset, int views) const {
  SurfaceLabel label;
  int most = 0, none = views, know = views;
  for (const ObjectVotes& entry : votes) {
    const int count = entry.votes[static_cast<std::size_t>(offset)];
    none -= count;
    if (entry.object == kUnsureObject) {
      know -= count;
      continue;
    }
    if (count <= most) continue;
    most = count;
    label.object = entry.object;
  }
  if (most < none) {
    label.object = kNoSceneObject;
    most = none;
  }
  if (know > 0) label.probability = static_cast<float>(most) / static_cast<float>(know);
  return label;
}

SurfaceLayer::SurfaceLayer(const SurfaceConfig& config, const DepthNoise& noise)
    : config_(config), noise_(noise), quantum_m_(config.voxel_m / kQuantaPerVoxel) {
  CHECK(config.voxel_m > 0 && config.truncation_voxels >= 1 && config.truncation_sigmas >= 0);
}

void SurfaceLayer::find_touched(const PreparedView& view, const SE3& T_world_camera,
                                BlockSet& touched) const {
  CHECK(T_world_camera.is_finite());
  constexpr int kMostBlocks = kBlockBias / 2;  // away from the origin
  CHECK(T_world_camera.t().cwiseAbs().maxCoeff() < kMostBlocks * (kBlockSide * config_.voxel_m));
  const Pinhole& camera = view.camera();
  const double block_m = kBlockSide * config_.voxel_m;
  const Eigen::Matrix3f R = (T_world_camera.R() / block_m).cast<float>();
  const Eigen::Matrix3f spread = R.cwiseAbs();
  // Blocks are counted from the camera's own, so that floats are exact enough anywhere.
  const Vec3 t_blocks = T_world_camera.t() / block_m;
  const Eigen::Vector3i camera_block = t_blocks.array().floor().cast<int>();
  const Eigen::Vector3f t = (t_blocks - camera_block.cast<double>()).cast<float>();
  const auto least_m = static_cast<float>(config_.truncation_voxels * config_.voxel_m);
  const auto sigmas = static_cast<float>(config_.truncation_sigmas);
  const NoiseModel noise(noise_);
  constexpr float kHalfTile_px = 0.5F * DepthPyramid::kTile_px;
  const Eigen::Vector2f per_px(static_cast<float>(1 / camera.fx),
                               static_cast<float>(1 / camera.fy));
  touched.clear();
  Eigen::Vector3i last_low(0, 0, 0), last_high(-1, -1, -1);
  const auto touch = [&](const Eigen::Vector3f& ray, float near_m, float far_m,
                         const Eigen::Vector3f& normal_camera) {
    const float middle_m = 0.5F * (near_m + far_m);
    const float band_m = std::max(least_m, sigmas * noise.sigma_m(far_m));
    // The tile's pixels lie in a box in the camera's axes, the band adds a bit along the normal.
    const Eigen::Vector3f half(kHalfTile_px * per_px.x() * far_m, kHalfTile_px * per_px.y() * far_m,
                               0.5F * (far_m - near_m));
    const Eigen::Vector3f middle = R * (ray * middle_m) + t;
    const Eigen::Vector3f extent = spread * half + (R * normal_camera).cwiseAbs() * band_m;
    const Eigen::Vector3i low = (middle - extent).array().floor().cast<int>();
    const Eigen::Vector3i high = (middle + extent).array().floor().cast<int>();
    if (low == last_low && high == last_high) return;
    last_low = low;
    last_high = high;
    for (int z = low.z(); z <= high.z(); ++z)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int x = low.x(); x <= high.x(); ++x)
          touched.insert(block_key(camera_block + Eigen::Vector3i(x, y, z)));
  };
  for (const SurfaceTile& tile : view.surface_tiles()) {
    const Eigen::Vector3f ray((tile.middle_px.x() - static_cast<float>(camera.cx)) * per_px.x(),
                              (tile.middle_px.y() - static_cast<float>(camera.cy)) * per_px.y(), 1);
    touch(ray, tile.near_m, tile.far_m, tile.normal_camera);
  }
}

void SurfaceLayer::fuse(const PreparedView& view, const SE3& T_world_camera, int sign,
                        int threads) {
  find_touched(view, T_world_camera, touched_);
  ++revision_;
  fuse_blocks(view, T_world_camera, sign, threads, touched_.keys());
}

void SurfaceLayer::exchange(const PreparedView& old, const PreparedView& now,
                            const SE3& T_world_camera, int threads) {
  find_touched(old, T_world_camera, touched_before_);
  find_touched(now, T_world_camera, touched_);
  reached_.clear();
  add_reached(old, now, {T_world_camera, config_, noise_}, reached_);
  ++revision_;
  const auto changed = [&](const BlockSet& its, const BlockSet& others) {
    std::vector<BlockKey> keys;
    for (const BlockKey key : its.keys())
      if (reached_.contains(key) || !others.contains(key)) keys.push_back(key);
    return keys;
  };
  fuse_blocks(old, T_world_camera, -1, threads, changed(touched_before_, touched_));
  fuse_blocks(now, T_world_camera, 1, threads, changed(touched_, touched_before_));
}

void SurfaceLayer::fuse_blocks(const PreparedView& view, const SE3& T_world_camera, int sign,
                               int threads, std::span<const BlockKey> touched) {
  CHECK(sign == 1 || sign == -1);
  std::vector<BlockKey> keys;
  std::vector<SurfaceBlock*> blocks;
  for (const BlockKey key : touched) {
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
      if (fuse_block(projection, keys[i], sign, bricks_, *blocks[i]))
        blocks[i]->revision = revision_;
    }
  });
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (!blocks[i]->empty()) continue;
    blocks[i]->revision = 0;
    blocks_.release(keys[i]);
  }
}

void SurfaceLayer::clear() {
  for (const BlockKey key : blocks_.keys()) {
    SurfaceBlock& block = *blocks_.find(key);
    for (SurfaceBrick* brick : block.bricks) {
      if (brick == nullptr) continue;
      *brick = {};
      bricks_.release(brick);
    }
    block = {};
    blocks_.release(key);
  }
  ++revision_;
}

std::optional<Voxel> SurfaceLayer::voxel(const Eigen::Vector3i& index) const {
  const SurfaceBlock* block =
      blocks_.find(block_key({index.x() >> 3, index.y() >> 3, index.z() >> 3}));
  if (block == nullptr) return std::nullopt;
  const VoxelPlace place = voxel_place(index.x() & 7, index.y() & 7, index.z() & 7);
  const SurfaceBrick* brick = block->bricks[place.brick];
  const auto i = static_cast<std::size_t>(place.voxel);
  if (brick == nullptr || brick->views[i] == 0) return std::nullopt;
  Voxel voxel;
  voxel.distance_m =
      static_cast<float>(quantum_m_ * brick->weighted_distance[i] / brick->weight[i]);
  voxel.views = brick->views[i];
  voxel.colour = brick->mean_colour(place.voxel);
  voxel.label = block->label(cell_offset(index.x() & 7, index.y() & 7, index.z() & 7), voxel.views);
  return voxel;
}

std::size_t SurfaceLayer::memory_bytes() const {
  std::size_t bytes = blocks_.memory_bytes() + bricks_.memory_bytes();
  for (const BlockKey key : blocks_.keys())
    bytes += blocks_.find(key)->votes.capacity() * sizeof(ObjectVotes);
  return bytes;
}

std::uint64_t SurfaceLayer::fingerprint() const {
  ContentHash hash;
  for (const BlockKey key : blocks_.keys()) {
    const SurfaceBlock& block = *blocks_.find(key);
    hash.add(key);
    for (std::size_t i = 0; i < block.bricks.size(); ++i) {
      if (block.bricks[i] == nullptr) continue;
      hash.add(i);
      hash.add_all(block.bricks[i]->weighted_distance);
      hash.add_all(block.bricks[i]->weight);
      hash.add_all(block.bricks[i]->views);
      hash.add_all(block.bricks[i]->colour);
    }
    for (const ObjectVotes& entry : block.votes) {
      hash.add(static_cast<std::uint64_t>(entry.object));
      hash.add_all(entry.votes);
    }
  }
  return hash.value();
}

}  // namespace ygslam
