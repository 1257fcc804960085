#include "volume/volume.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"

namespace ygslam {
namespace {

// Furniture adds this much to the area of walls, floor and ceiling.
constexpr double kFurnished = 1.6;
// Noise and edges reach into more bricks than a smooth surface does.
constexpr double kRagged = 1.5;
// Blocks of space that reach into walls.
constexpr double kSpaceBorder = 1.5;

}  // namespace

Volume::Volume(const VolumeConfig& config)
    : config_(config),
      surface_(config.surface, config.preparation.noise),
      space_(config.space),
      scan_(config.space, config.preparation.noise) {
  CHECK(config.threads >= 1);
}

const SeenSpace& Volume::integrate(const DepthView& view, const SE3& T_world_camera) {
  prepared_.assign(view, config_.preparation);
  return fuse(T_world_camera, 1);
}

void Volume::deintegrate(const DepthView& view, const SE3& T_world_camera) {
  prepared_.assign(view, config_.preparation);
  fuse(T_world_camera, -1);
}

void Volume::deintegrate(const DepthView& view, const SE3& T_world_camera, const SeenSpace& seen) {
  CHECK(views_ > 0);
  --views_;
  prepared_.assign(view, config_.preparation);
  surface_.fuse(prepared_, T_world_camera, -1, config_.threads);
  space_.count(seen, prepared_.spared(), -1, config_.threads);
}

void Volume::move(const DepthView& view, const SE3& T_world_camera_old,
                  const SE3& T_world_camera_new) {
  prepared_.assign(view, config_.preparation);
  fuse(T_world_camera_old, -1);
  fuse(T_world_camera_new, 1);
}

const SeenSpace& Volume::exchange(const DepthView& old, const SeenSpace& seen, const DepthView& now,
                                  const SE3& T_world_camera) {
  CHECK(views_ > 0);
  prepared_before_.assign(old, config_.preparation);
  const bool has_same_depth =
      std::equal(old.depth.begin(), old.depth.end(), now.depth.begin(), now.depth.end());
  prepared_.assign(now, config_.preparation, has_same_depth ? &prepared_before_ : nullptr);
  surface_.exchange(prepared_before_, prepared_, T_world_camera, config_.threads);
  space_.count(seen, prepared_before_.spared(), -1, config_.threads);
  const SeenSpace& seen_now = scan_.step(prepared_, T_world_camera, config_.threads);
  space_.count(seen_now, prepared_.spared(), 1, config_.threads);
  return seen_now;
}

void Volume::clear() {
  surface_.clear();
  space_.clear();
  views_ = 0;
}

void Volume::exchange_spared(const SeenSpace& seen, const std::vector<Eigen::Vector3i>& old,
                             const std::vector<Eigen::Vector3i>& now) {
  space_.count(seen, now, 1, config_.threads);
  space_.count(seen, old, -1, config_.threads);
}

const SeenSpace& Volume::observe(const DepthView& view, const SE3& T_world_camera) {
  prepared_.assign(view, config_.preparation);
  return scan_.step(prepared_, T_world_camera, config_.threads);
}

const SeenSpace& Volume::fuse(const SE3& T_world_camera, int sign) {
  CHECK(sign > 0 ? views_ < kMaxViews : views_ > 0);
  views_ += sign;
  surface_.fuse(prepared_, T_world_camera, sign, config_.threads);
  const SeenSpace& seen = scan_.step(prepared_, T_world_camera, config_.threads);
  space_.count(seen, prepared_.spared(), sign, config_.threads);
  return seen;
}

std::size_t Volume::memory_bytes() const { return surface_.memory_bytes() + space_.memory_bytes(); }

std::uint64_t Volume::fingerprint() const {
  return surface_.fingerprint() * 31 + space_.fingerprint();
}

double estimated_bytes(const VolumeConfig& config, double surface_m2, double space_m3) {
  const double brick_m = kBrickSide * config.surface.voxel_m;
  const double band_m = 2 * config.surface.truncation_voxels * config.surface.voxel_m;
  // A surface at any angle: so many bricks lie within the band about it.
  const double bricks =
      kRagged * surface_m2 * (band_m + 1.5 * brick_m) / (brick_m * brick_m * brick_m);
  const double space_blocks = space_m3 / std::pow(kBlockSide * config.space.cell_m, 3);
  return bricks * (sizeof(SurfaceBrick) + sizeof(SurfaceBlock) / 4.0) +
         kSpaceBorder * space_blocks * sizeof(SpaceBlock);
}

double estimated_bytes(const VolumeConfig& config, const Vec3& room_m) {
  const double sides_m2 =
      room_m.x() * room_m.y() + room_m.y() * room_m.z() + room_m.z() * room_m.x();
  return estimated_bytes(config, 2 * kFurnished * sides_m2, room_m.prod());
}

}  // namespace ygslam
