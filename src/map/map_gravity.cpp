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
constexpr std::size_t kFew = 1000;  // keyframes, of which all are looked at: in a millisecond
constexpr std::size_t kShare = 64;  // of more, this part has to be new

/// In a keyframe that has it.
struct Felt {
  explicit Felt(const Keyframe& of)
      : keyframe(of.data->id), R_camera_world(of.T_camera_world.R()), gravity(&*of.data->gravity) {}
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
  [[nodiscard]] MeasuredDirection direction(const Vec3& down) const {
    return {0, down, gravity->down_camera, weight(down) * covariance().inverse()};
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

/// By the root of the submap.
std::map<KeyframeId, std::vector<Felt>> felt_in_submaps(const Map& map) {
  std::map<KeyframeId, std::vector<Felt>> by_root;
  const auto has_it = [](const auto& entry) { return entry.second.data->gravity.has_value(); };
  if (std::ranges::none_of(map.keyframes(), has_it)) return by_root;
  const std::map<KeyframeId, KeyframeId> root_of = map.roots();
  for (const auto& [id, keyframe] : map.keyframes())
    if (keyframe.data->gravity) by_root[root_of.at(id)].emplace_back(keyframe);
  return by_root;
}

}  // namespace

std::map<KeyframeId, MeasuredDirection> measured_gravity(const Map& map) {
  std::map<KeyframeId, MeasuredDirection> directions;
  for (const auto& [root, all] : felt_in_submaps(map)) {
    const Vec3 down_world = common_down(all);
    for (const Felt& felt : all) directions[felt.keyframe] = felt.direction(down_world);
  }
  return directions;
}

std::map<KeyframeId, MeasuredDirection> GravityOfGrowingMap::of(
    const Map& map, std::span<const KeyframeId> keyframes) {
  std::map<KeyframeId, MeasuredDirection> directions;
  bool is_new = has_grown(map);
  for (const KeyframeId id : keyframes) {
    const Keyframe& keyframe = map.keyframe(id);
    if (!keyframe.data->gravity) continue;
    const KeyframeId root = map.root_of(id);
    if (is_new || !down_world_.contains(root)) look_at(map);
    is_new = false;
    directions[id] = Felt(keyframe).direction(down_world_.at(root));
  }
  return directions;
}

bool GravityOfGrowingMap::has_grown(const Map& map) const {
  const std::size_t come = index(map.next_keyframe_id()) - made_;
  return map.keyframes().size() <= kFew || come * kShare > map.keyframes().size();
}

void GravityOfGrowingMap::look_at(const Map& map) {
  made_ = index(map.next_keyframe_id());
  down_world_.clear();
  for (const auto& [root, all] : felt_in_submaps(map)) down_world_[root] = common_down(all);
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
