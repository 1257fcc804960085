#include "dense/static_cloud.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "core/check.hpp"
#include "geometry/rolling_shutter.hpp"
#include "image/depth.hpp"

namespace ygslam {
namespace {

constexpr double kDepthUnit_m = 1e-4;
// A pixel at a depth step mixes both surfaces.
constexpr float kStepRatio = 0.03F;

struct VoxelSum {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  float r = 0, g = 0, b = 0;
  int count = 0;
};

// 21 bits an axis: +-10 km at 1 cm.
std::uint64_t voxel_key(const Vec3& p_world, double voxel_m) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell = static_cast<std::int64_t>(std::floor(p_world[axis] / voxel_m)) + (1 << 20);
    key = (key << 21) | (static_cast<std::uint64_t>(cell) & 0x1fffff);
  }
  return key;
}

/// The camera's pose when each row of the depth image was read.
std::vector<SE3> row_poses(const Camera& camera, const SE3& T_world_middle,
                           const ReadOut& read_out) {
  std::vector<SE3> rows(static_cast<std::size_t>(camera.height()), T_world_middle);
  const RollingShutter shutter(camera.height(), read_out);
  if (!shutter.is_rolling()) return rows;
  for (std::size_t v = 0; v < rows.size(); ++v)
    rows[v] = T_world_middle *
              SE3::exp(shutter.depth_time_s(static_cast<double>(v)) * read_out.body_velocity);
  return rows;
}

}  // namespace

StaticCloud::StaticCloud(const StaticCloudConfig& config, const Camera& camera)
    : config_(config), camera_(camera) {}

void StaticCloud::insert(KeyframeId keyframe, const RgbdFrame& frame, const GreyImage& dynamic,
                         const ReadOut& read_out) {
  CHECK(frame.depth_m.height() == camera_.height());
  const GreyImage blocked = dilated(dynamic, config_.margin_px);
  View& view = views_[keyframe];
  view.read_out = read_out;
  for (int v = 0; v < frame.depth_m.height(); v += config_.pixel_stride) {
    for (int u = 0; u < frame.depth_m.width(); u += config_.pixel_stride) {
      const float depth_m = frame.depth_m.at(u, v);
      if (depth_m <= 0 || depth_m > config_.max_depth_m) continue;
      if (!blocked.empty() && blocked.at(u, v)) continue;
      if (depth_range(frame.depth_m, u, v, 1).has_step(kStepRatio)) continue;
      view.samples.push_back({static_cast<std::uint16_t>(u), static_cast<std::uint16_t>(v),
                              static_cast<std::uint16_t>(std::lround(depth_m / kDepthUnit_m)),
                              frame.colour.at(u, v)});
    }
  }
}

void StaticCloud::remove(KeyframeId keyframe) { views_.erase(keyframe); }

std::vector<ColouredPoint> StaticCloud::build(
    const std::map<KeyframeId, SE3>& T_world_camera) const {
  std::unordered_map<std::uint64_t, std::uint32_t> voxel_of;
  std::vector<VoxelSum> voxels;  // in order of first touch: the output does not depend on hashing
  for (const auto& [id, view] : views_) {
    const auto pose = T_world_camera.find(id);
    if (pose == T_world_camera.end()) continue;
    const std::vector<SE3> T_world_row = row_poses(camera_, pose->second, view.read_out);
    for (const Sample& s : view.samples) {
      const Vec2 ideal_px = camera_.undistort({s.u, s.v});
      const Vec3 p_world =
          T_world_row[s.v] * camera_.unproject(ideal_px, s.depth_mm10 * kDepthUnit_m);
      const auto [it, is_new] = voxel_of.emplace(voxel_key(p_world, config_.voxel_m),
                                                 static_cast<std::uint32_t>(voxels.size()));
      if (is_new) voxels.emplace_back();
      VoxelSum& voxel = voxels[it->second];
      voxel.position += p_world.cast<float>();
      voxel.r += s.colour.r;
      voxel.g += s.colour.g;
      voxel.b += s.colour.b;
      ++voxel.count;
    }
  }
  std::vector<ColouredPoint> cloud;
  for (const VoxelSum& voxel : voxels) {
    if (voxel.count < config_.min_points) continue;
    const auto n = static_cast<float>(voxel.count);
    const auto byte = [&](float sum) { return static_cast<std::uint8_t>(std::lround(sum / n)); };
    cloud.push_back({voxel.position / n, {byte(voxel.r), byte(voxel.g), byte(voxel.b)}});
  }
  return cloud;
}

GreyImage dilated(const GreyImage& mask, int radius_px) {
  if (mask.empty() || radius_px <= 0) return mask;
  GreyImage rows(mask.width(), mask.height());
  GreyImage result(mask.width(), mask.height());
  // Separable: distance since the last set pixel, forwards and backwards.
  const auto spread = [radius_px](auto read, auto write, int n) {
    for (int i = 0, since = radius_px + 1; i < n; ++i) {
      since = read(i) ? 0 : since + 1;
      if (since <= radius_px) write(i);
    }
    for (int i = n - 1, since = radius_px + 1; i >= 0; --i) {
      since = read(i) ? 0 : since + 1;
      if (since <= radius_px) write(i);
    }
  };
  for (int v = 0; v < mask.height(); ++v) {
    spread([&](int u) { return mask.at(u, v) != 0; }, [&](int u) { rows.at(u, v) = 255; },
           mask.width());
  }
  for (int u = 0; u < mask.width(); ++u) {
    spread([&](int v) { return rows.at(u, v) != 0; }, [&](int v) { result.at(u, v) = 255; },
           mask.height());
  }
  return result;
}

}  // namespace ygslam
