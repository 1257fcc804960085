#include "volume/space_scan.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "core/parallel.hpp"
#include "volume/space_kernel.hpp"

namespace ygslam {
namespace {

constexpr int kHitStride_px = 2;
// Cells from the camera are counted up from here, so that rounding towards 0 rounds down.
constexpr int kCellBias = 1 << 13;
constexpr double kLeastCell_m = 0.005;
constexpr int kScannedAtOnce = 16;

}  // namespace

SpaceScan::SpaceScan(const SpaceConfig& config, const DepthNoise& noise)
    : config_(config), noise_(noise) {
  CHECK(config.cell_m >= kLeastCell_m && config.margin_sigmas >= 0 && config.margin_cells >= 0);
}

void SpaceScan::find_hits(const PreparedView& view, const SE3& T_world_camera) {
  for (const BlockKey key : hit_cells_.keys()) {
    *hit_cells_.find(key) = {};
    hit_cells_.release(key);
  }
  const Pinhole& camera = view.camera();
  const Eigen::Matrix3f R = (T_world_camera.R() / config_.cell_m).cast<float>();
  const Vec3 t_cells = T_world_camera.t() / config_.cell_m;
  // Cells are counted from the camera's own, so that floats are exact enough anywhere.
  const Eigen::Vector3i camera_cell = t_cells.array().floor().cast<int>();
  const Eigen::Vector3f t = (t_cells - camera_cell.cast<double>()).cast<float>();
  const Eigen::Vector3i base = camera_cell - Eigen::Vector3i::Constant(kCellBias);
  const auto unit_m = static_cast<float>(DepthView::kUnit_m);
  const Eigen::Vector3f right = R.col(0) * static_cast<float>(kHitStride_px / camera.fx);
  const auto samples = static_cast<std::size_t>((camera.width + kHitStride_px - 1) / kHitStride_px);
  std::vector<float> depths_m(samples);
  std::array<std::vector<int>, 3> cells;  // of a row's samples, from the camera's; by axis
  for (auto& along : cells) along.resize(samples);
  Eigen::Vector3i last_block = Eigen::Vector3i::Constant(kBlockBias);
  CellMask* mask = nullptr;
  for (int v = 0; v < camera.height; v += kHitStride_px) {
    const Eigen::Vector3f row_ray = R.col(1) * static_cast<float>((v - camera.cy) / camera.fy) +
                                    R.col(2) - R.col(0) * static_cast<float>(camera.cx / camera.fx);
    const std::uint32_t* geometry = view.geometry() + v * camera.width;
    for (std::size_t i = 0; i < samples; ++i)
      depths_m[i] =
          static_cast<float>(static_cast<int>(geometry[i * kHitStride_px] & 0xffffU)) * unit_m;
    for (int axis = 0; axis < 3; ++axis) {
      const float first = row_ray[axis], step = right[axis], from = t[axis] + kCellBias;
      int* along = cells[static_cast<std::size_t>(axis)].data();
      for (std::size_t i = 0; i < samples; ++i) {
        const float ray = first + static_cast<float>(static_cast<int>(i)) * step;
        along[i] = static_cast<int>(ray * depths_m[i] + from);
      }
    }
    for (std::size_t i = 0; i < samples; ++i) {
      if (geometry[i * kHitStride_px] >> 24 == 0) continue;
      const Eigen::Vector3i cell = Eigen::Vector3i(cells[0][i], cells[1][i], cells[2][i]) + base;
      const Eigen::Vector3i block(cell.x() >> 3, cell.y() >> 3, cell.z() >> 3);
      if (block != last_block) {
        mask = &hit_cells_.obtain(block_key(block));
        last_block = block;
      }
      mask->set(cell.x() & 7, cell.y() & 7, cell.z() & 7);
    }
  }
}

void SpaceScan::find_visible(const PreparedView& view, const SE3& T_world_camera) {
  touched_.clear();
  for (const BlockKey key : hit_cells_.keys()) touched_.insert(key);
  const Pinhole& camera = view.camera();
  const double block_m = kBlockSide * config_.cell_m;
  const double farthest_m = view.farthest_m();
  Vec3 low = T_world_camera.t(), high = low;
  for (const double u : {-0.5, camera.width - 0.5}) {
    for (const double v : {-0.5, camera.height - 0.5}) {
      const Vec3 ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1);
      const Vec3 corner = T_world_camera * (ray * farthest_m);
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  }
  const Eigen::Vector3i first = (low / block_m).array().floor().cast<int>();
  const Eigen::Vector3i last = (high / block_m).array().floor().cast<int>();
  // A block whose ball lies outside one of the four sides of what the camera sees is left out.
  const double radius_m = 0.5 * std::sqrt(3.0) * block_m;
  const SE3 T_camera_world = T_world_camera.inverse();
  const auto side = [](double focal_px, double edge_px) {
    return Vec2(focal_px, edge_px).normalized();
  };
  const Vec2 left = side(camera.fx, camera.cx + 0.5);
  const Vec2 right = side(camera.fx, camera.width - 0.5 - camera.cx);
  const Vec2 top = side(camera.fy, camera.cy + 0.5);
  const Vec2 bottom = side(camera.fy, camera.height - 0.5 - camera.cy);
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        const Vec3 middle = (Vec3(x, y, z) + Vec3::Constant(0.5)) * block_m;
        const Vec3 p = T_camera_world * middle;
        if (p.z() < -radius_m || p.z() > farthest_m + radius_m) continue;
        if (left.x() * p.x() + left.y() * p.z() < -radius_m) continue;
        if (-right.x() * p.x() + right.y() * p.z() < -radius_m) continue;
        if (top.x() * p.y() + top.y() * p.z() < -radius_m) continue;
        if (-bottom.x() * p.y() + bottom.y() * p.z() < -radius_m) continue;
        const double front_m = p.z() - radius_m;
        if (front_m > 0.1) {  // hidden behind everything that was seen in its direction?
          const Vec2 tangent(p.x() / p.z(), p.y() / p.z());
          const Vec2 reach = (Vec2::Ones() + tangent.cwiseAbs()) * (radius_m / front_m);
          const Vec2 focal(camera.fx, camera.fy), centre(camera.cx, camera.cy);
          if (view.farthest_m(focal.cwiseProduct(tangent - reach) + centre,
                              focal.cwiseProduct(tangent + reach) + centre) < front_m)
            continue;
        }
        touched_.insert(block_key({x, y, z}));
      }
    }
  }
}

const SeenSpace& SpaceScan::step(const PreparedView& view, const SE3& T_world_camera, int threads) {
  CHECK(T_world_camera.is_finite());
  CHECK(T_world_camera.t().cwiseAbs().maxCoeff() / config_.cell_m < kBlockBias);
  find_hits(view, T_world_camera);
  find_visible(view, T_world_camera);
  std::vector<BlockKey> keys = touched_.keys();
  std::sort(keys.begin(), keys.end());
  through_.resize(keys.size());
  const SpaceProjection projection(view, T_world_camera, config_, noise_);
  const int count = static_cast<int>(keys.size());
  parallel_for((count + kScannedAtOnce - 1) / kScannedAtOnce, threads, [&](int chunk) {
    const int end = std::min((chunk + 1) * kScannedAtOnce, count);
    for (int k = chunk * kScannedAtOnce; k < end; ++k) {
      const auto i = static_cast<std::size_t>(k);
      through_[i] = cells_seen_through(projection, keys[i]);
    }
  });
  seen_.clear();
  const CellMask none;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const CellMask* hits = hit_cells_.find(keys[i]);
    if (hits != nullptr)
      for (std::size_t row = 0; row < hits->rows.size(); ++row)
        through_[i].rows[row] = static_cast<std::uint8_t>(through_[i].rows[row] & ~hits->rows[row]);
    seen_.add(keys[i], hits != nullptr ? *hits : none, through_[i]);
  }
  return seen_;
}

}  // namespace ygslam
