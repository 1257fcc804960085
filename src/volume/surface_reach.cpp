#include "volume/surface_reach.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/check.hpp"
#include "volume/surface_kernel.hpp"

namespace ygslam {
namespace {

constexpr int kSide_px = DepthPyramid::kTile_px;
constexpr float kRounding_px = 0.05F;
constexpr float kRoundingBlocks = 1e-3F;

std::uint32_t weight_of(std::uint32_t geometry) { return geometry >> 24; }

/// Of each number in DepthView::object, whether it stands for another object now.
std::array<bool, 256> renumbered(const PreparedView& old, const PreparedView& now) {
  std::array<bool, 256> is_other{};
  const auto of = [](const PreparedView& view, std::size_t number) {
    return number - 1 < view.objects().size() ? view.objects()[number - 1] : kNoSceneObject;
  };
  for (std::size_t number = 1; number < is_other.size(); ++number)
    is_other[number] = of(old, number) != of(now, number);
  return is_other;
}

/// What the pixels of a tile that differ reach.
struct Reach {
  float near_m = std::numeric_limits<float>::max(), far_m = 0;
  float slope = 1;  // the least

  void add(std::uint32_t geometry) {
    if (weight_of(geometry) == 0) return;
    const float depth_m =
        static_cast<float>(geometry & 0xffffU) * static_cast<float>(DepthView::kUnit_m);
    near_m = std::min(near_m, depth_m);
    far_m = std::max(far_m, depth_m);
    slope =
        std::min(slope, static_cast<float>((geometry >> 16) & 0xffU) * PreparedView::kSlopeUnit);
  }
};

/// Inserts the blocks within reach of a tile's pixels: along their rays.
class BlockFinder {
 public:
  BlockFinder(const Pinhole& camera, const ReachConfig& config, BlockSet& reached)
      : camera_(camera),
        noise_(config.noise),
        least_m_(static_cast<float>(config.surface.truncation_voxels * config.surface.voxel_m)),
        sigmas_(static_cast<float>(config.surface.truncation_sigmas)),
        reached_(reached) {
    const double block_m = kBlockSide * config.surface.voxel_m;
    R_ = (config.T_world_camera.R() / block_m).cast<float>();
    // Counted from the camera's own block, so that floats are exact enough anywhere.
    const Vec3 t_blocks = config.T_world_camera.t() / block_m;
    camera_block_ = t_blocks.array().floor().cast<int>();
    t_ = (t_blocks - camera_block_.cast<double>()).cast<float>();
  }

  void insert(int column, int row, const Reach& reach) {
    constexpr float kMiddle_px = 0.5F * (kSide_px - 1), kHalf_px = 0.5F * kSide_px + kRounding_px;
    const auto fx = static_cast<float>(camera_.fx), fy = static_cast<float>(camera_.fy);
    const Eigen::Vector3f ray(
        (static_cast<float>(column * kSide_px) + kMiddle_px - static_cast<float>(camera_.cx)) / fx,
        (static_cast<float>(row * kSide_px) + kMiddle_px - static_cast<float>(camera_.cy)) / fy, 1);
    const float sigma_m = std::max(noise_.sigma_m(reach.near_m), noise_.sigma_m(reach.far_m));
    const float band_m = std::max(least_m_, sigmas_ * sigma_m);
    const float along_m = band_m * std::min(kLongestReach, 1 / std::max(reach.slope, 1e-3F));
    const float farthest_m = reach.far_m + along_m;
    const Eigen::Vector3f across(kHalf_px / fx * farthest_m, kHalf_px / fy * farthest_m, 0);
    const Eigen::Vector3f middle = R_ * (ray * (0.5F * (reach.near_m + reach.far_m))) + t_;
    const Eigen::Vector3f extent =
        R_.cwiseAbs() * across +
        (R_ * ray).cwiseAbs() * (0.5F * (reach.far_m - reach.near_m) + along_m) +
        Eigen::Vector3f::Constant(kRoundingBlocks);
    const Eigen::Vector3i low = (middle - extent).array().floor().cast<int>();
    const Eigen::Vector3i high = (middle + extent).array().floor().cast<int>();
    for (int z = low.z(); z <= high.z(); ++z)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int x = low.x(); x <= high.x(); ++x)
          reached_.insert(block_key(camera_block_ + Eigen::Vector3i(x, y, z)));
  }

 private:
  const Pinhole& camera_;
  NoiseModel noise_;
  float least_m_, sigmas_;
  BlockSet& reached_;
  Eigen::Matrix3f R_;
  Eigen::Vector3f t_;
  Eigen::Vector3i camera_block_;
};

}  // namespace

void add_reached(const PreparedView& old, const PreparedView& now, const ReachConfig& config,
                 BlockSet& reached) {
  const Pinhole& camera = old.camera();
  CHECK(camera.width == now.camera().width && camera.height == now.camera().height);
  const std::array<bool, 256> is_other = renumbered(old, now);
  BlockFinder blocks(camera, config, reached);
  const auto width = static_cast<std::size_t>(camera.width);
  std::vector<Reach> of_tile((width + kSide_px - 1) / kSide_px);
  for (int row = 0; row * kSide_px < camera.height; ++row) {
    std::fill(of_tile.begin(), of_tile.end(), Reach{});
    for (int v = row * kSide_px; v < std::min((row + 1) * kSide_px, camera.height); ++v) {
      const std::size_t first = static_cast<std::size_t>(v) * width;
      for (std::size_t u = 0; u < width; ++u) {
        const std::uint32_t before = old.geometry()[first + u], after = now.geometry()[first + u];
        const std::uint32_t seen = old.appearance()[first + u];
        if (before == after && seen == now.appearance()[first + u] && !is_other[seen >> 24])
          continue;
        of_tile[u / kSide_px].add(before);
        of_tile[u / kSide_px].add(after);
      }
    }
    for (std::size_t column = 0; column < of_tile.size(); ++column)
      if (of_tile[column].far_m > 0) blocks.insert(static_cast<int>(column), row, of_tile[column]);
  }
}

}  // namespace ygslam
