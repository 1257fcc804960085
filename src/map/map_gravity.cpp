#include "map/map_gravity.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace ygslam {
namespace {

/// What an accelerometer's scale and axes err, which its noise does not tell.
constexpr double kLeastStd_rad = 5e-3;
constexpr double kHuber = 3;  // standard deviations
constexpr int kRounds = 3;

struct Felt {
  KeyframeId keyframe;
  Mat3 R_camera_world;
  const MeasuredGravity* gravity;
  [[nodiscard]] Mat3 covariance() const {
    return gravity->covariance + kLeastStd_rad * kLeastStd_rad * Mat3::Identity();
  }
  [[nodiscard]] double variance() const { return covariance().trace() / 3; }
  [[nodiscard]] Vec3 down_world() const {
    return R_camera_world.transpose() * gravity->down_camera;
  }
  /// Huber's, of what it says against this direction.
  [[nodiscard]] double weight(const Vec3& down) const {
    const double sigmas = (down_world() - down).norm() / std::sqrt(variance());
    return sigmas <= kHuber ? 1 : kHuber / sigmas;
  }
};

Vec3 common_down(const std::vector<Felt>& all) {
  Vec3 down = Vec3::Zero();
  for (int round = 0; round < kRounds; ++round) {
    Vec3 sum = Vec3::Zero();
    for (const Felt& felt : all)
      sum += (round == 0 ? 1 : felt.weight(down)) / felt.variance() * felt.down_world();
    down = sum.normalized();
  }
  return down;
}

}  // namespace

std::map<KeyframeId, MeasuredDirection> measured_gravity(const Map& map) {
  std::map<KeyframeId, MeasuredDirection> directions;
  const auto has_it = [](const auto& entry) { return entry.second.data->gravity.has_value(); };
  if (std::ranges::none_of(map.keyframes(), has_it)) return directions;
  const std::map<KeyframeId, KeyframeId> root_of = map.roots();
  std::map<KeyframeId, std::vector<Felt>> by_root;
  for (const auto& [id, keyframe] : map.keyframes())
    if (const auto& gravity = keyframe.data->gravity)
      by_root[root_of.at(id)].push_back({id, keyframe.T_camera_world.R(), &*gravity});
  for (const auto& [root, all] : by_root) {
    const Vec3 down_world = common_down(all);
    for (const Felt& felt : all)
      directions[felt.keyframe] = {0, down_world, felt.gravity->down_camera,
                                   felt.weight(down_world) * felt.covariance().inverse()};
  }
  return directions;
}

bool forget_imu(Map& map, const ImuRetraction& retraction) {
  std::vector<std::shared_ptr<KeyframeData>> without;
  for (const auto& [id, keyframe] : map.keyframes()) {
    const KeyframeData& data = *keyframe.data;
    if ((!data.gravity && !data.turn) || data.stamp < retraction.since) continue;
    without.push_back(std::make_shared<KeyframeData>(data));
    without.back()->gravity.reset();
    without.back()->turn.reset();
  }
  for (const auto& data : without) map.set_data(data->id, data);
  return !without.empty();
}

}  // namespace ygslam
