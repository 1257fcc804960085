#include "loop/map_straightening.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "core/statistics.hpp"
#include "core/trace.hpp"
#include "loop/loop_graph.hpp"
#include "map/map_gravity.hpp"
#include "optim/stop_flag.hpp"

namespace ygslam {
namespace {

constexpr double kPiece_s = 2;            // of turns that a bias is looked for in
constexpr std::size_t kFewestPieces = 8;  // that say what it is
constexpr int kRounds = 30;
// What vision errs between two keyframes grows with the root of the way [m] and of the turn [rad],
// about as bench/nees.py finds; at least as two views of the same differ.
constexpr double kWalk_m = 0.0024, kWalk_rad = 0.0005;
constexpr double kLeast_m = 0.001, kLeast_rad = 1e-4;
constexpr double kDisagreement = 3;      // standard deviations from which a turn is vision's error
constexpr double kBiasStd_radps = 1e-4;  // of what is found
constexpr double kMostBias_radps = 0.2;  // of any sensor

/// Keyframes that follow each other in one series, in order of time. Those of a submap that is not
/// joined are apart: how it lies to the rest is not known.
std::vector<std::vector<const Keyframe*>> series_of(const Map& map) {
  const std::map<KeyframeId, KeyframeId> root_of = map.roots();
  std::map<std::pair<KeyframeId, std::uint32_t>, std::vector<const Keyframe*>> by_submap;
  for (const auto& [id, keyframe] : map.keyframes())
    if (const auto& turn = keyframe.data->turn)
      by_submap[{root_of.at(id), turn->series}].push_back(&keyframe);
  std::vector<std::vector<const Keyframe*>> all;
  for (auto& [key, series] : by_submap) all.push_back(std::move(series));
  return all;
}

Mat3 turn_by_map(const Keyframe& before, const Keyframe& after) {
  return after.T_camera_world.R() * before.T_camera_world.R().transpose();
}
Mat3 turn_by_gyro(const Keyframe& before, const Keyframe& after) {
  return after.data->turn->R_camera_start * before.data->turn->R_camera_start.transpose();
}
/// What the gyroscope says beyond the map, in the axes of `after`.
Vec3 disagreement(const Keyframe& before, const Keyframe& after) {
  return so3_log(turn_by_gyro(before, after) * turn_by_map(before, after).transpose());
}

/// Per second, of pieces of some seconds each.
std::vector<Vec3> rates_of_disagreement(const Map& map) {
  std::vector<Vec3> rates;
  for (const auto& series : series_of(map)) {
    const Keyframe* from = nullptr;
    Vec3 sum = Vec3::Zero();
    const Keyframe* begin = series.front();
    for (const Keyframe* keyframe : series) {
      if (from != nullptr) sum += disagreement(*from, *keyframe);
      from = keyframe;
      const double seconds = seconds_between(keyframe->data->stamp, begin->data->stamp);
      if (seconds < kPiece_s) continue;
      rates.push_back(sum / seconds);
      sum.setZero();
      begin = keyframe;
    }
  }
  return rates;
}

Vec3 medians(const std::vector<Vec3>& values) {
  Vec3 result;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (const Vec3& value : values) along.push_back(value[axis]);
    result[axis] = median(std::move(along));
  }
  return result;
}

/// Cauchy's kernel, as wide as the values scatter.
Vec3 robust_mean(const std::vector<Vec3>& values) {
  Vec3 mean = medians(values);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> off;
    for (const Vec3& value : values) off.push_back((value - mean).norm());
    const double width = 2 * median(std::vector(off)) + 1e-12;
    double weights = 0;
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double weight = 1 / (1 + std::pow(off[i] / width, 2));
      weights += weight;
      sum += weight * values[i];
    }
    mean = sum / weights;
  }
  return mean;
}

double extent_m(const Map& map) {
  double extent_m = 0;
  for (const auto& [id, root] : map.roots())
    extent_m = std::max(
        extent_m, (map.keyframe(id).position_world() - map.keyframe(root).position_world()).norm());
  return extent_m;
}

class Straightening {
 public:
  Straightening(const Map& map, const Vec3& gyro_bias, int min_shared)
      : map_(map), gyro_bias_(gyro_bias), graph_(make_map_graph(map, min_shared)) {}

  [[nodiscard]] std::optional<MapPatch> patch(const std::atomic<bool>* abort) {
    for (const auto& [id, T_camera_world] : graph_.T_camera_world) {
      node_[id] = static_cast<std::uint32_t>(problem_.T_camera_world.size());
      problem_.T_camera_world.push_back(T_camera_world);
      const bool is_of_this_run = map_.keyframe(id).data->frame != kNoFrame;
      problem_.fixed.push_back(graph_.roots.contains(id) || !is_of_this_run ? 1 : 0);
    }
    for (const MapGraph::Edge& edge : graph_.edges) add_tie(edge);
    for (const auto& series : series_of(map_))
      for (std::size_t i = 1; i < series.size(); ++i) add_turn(*series[i - 1], *series[i]);
    for (auto [id, direction] : graph_.gravity) {
      direction.pose = node_.at(id);
      problem_.directions.push_back(direction);
    }
    const PoseGraphResult solved = optimize_pose_graph(problem_, {}, abort);
    if (is_stopped(abort)) return std::nullopt;
    if (!(solved.cost < solved.initial_cost)) return std::nullopt;  // nor a number
    MapPatch patch = map_.start_patch();
    for (const auto& [id, i] : node_)
      patch.poses.push_back(
          {id, problem_.T_camera_world[i], solved.T_camera_world[i].normalized()});
    return patch;
  }

 private:
  [[nodiscard]] SE3 between(KeyframeId from, KeyframeId to) const {
    return graph_.T_camera_world.at(to) * graph_.T_camera_world.at(from).inverse();
  }
  /// Of the gyroscope against the map, its bias taken out.
  [[nodiscard]] Vec3 wrong_turn(const Keyframe& before, const Keyframe& after) const {
    return disagreement(before, after) - seconds(before, after) * gyro_bias_;
  }
  static double seconds(const Keyframe& before, const Keyframe& after) {
    return seconds_between(after.data->stamp, before.data->stamp);
  }
  static double turn_variance(const Keyframe& before, const Keyframe& after) {
    return kLeast_rad * kLeast_rad + after.data->turn->variance_rad2 -
           before.data->turn->variance_rad2;
  }

  /// As the map has it, but for turns that the gyroscope contradicts.
  void add_tie(const MapGraph::Edge& edge) {
    const SE3 T_to_from = between(edge.from, edge.to);
    if (edge.covariance) {
      problem_.edges.push_back(
          {node_.at(edge.from), node_.at(edge.to), T_to_from, edge.covariance->inverse()});
      return;
    }
    const double way = T_to_from.t().norm() + T_to_from.angle();
    const double variance_m2 = kLeast_m * kLeast_m + kWalk_m * kWalk_m * way;
    double variance_rad2 = kLeast_rad * kLeast_rad + kWalk_rad * kWalk_rad * way;
    const Keyframe &from = map_.keyframe(edge.from), &to = map_.keyframe(edge.to);
    const auto &before = from.data->turn, &after = to.data->turn;
    if (before && after && before->series == after->series) {
      const double wrong2 = wrong_turn(from, to).squaredNorm() / 3;
      const double by_bias = seconds(from, to) * kBiasStd_radps;
      const double expected2 = variance_rad2 + turn_variance(from, to) + by_bias * by_bias;
      if (wrong2 > kDisagreement * kDisagreement * expected2) variance_rad2 += wrong2;
    }
    PoseGraphEdge tie{node_.at(edge.from), node_.at(edge.to), T_to_from, Mat6::Zero()};
    tie.information.diagonal() << Vec3::Constant(edge.information / variance_m2),
        Vec3::Constant(edge.information / variance_rad2);
    problem_.edges.push_back(tie);
  }

  void add_turn(const Keyframe& before, const Keyframe& after) {
    const KeyframeId from = before.data->id, to = after.data->id;
    const Mat3 R_to_from =
        so3_exp(-seconds(before, after) * gyro_bias_) * turn_by_gyro(before, after);
    PoseGraphEdge turn{
        node_.at(from), node_.at(to), {R_to_from, between(from, to).t()}, Mat6::Zero()};
    turn.information.diagonal().tail<3>().setConstant(1 / turn_variance(before, after));
    problem_.edges.push_back(turn);
  }

  const Map& map_;
  Vec3 gyro_bias_;
  MapGraph graph_;
  PoseGraph problem_;
  std::map<KeyframeId, std::uint32_t> node_;
};

}  // namespace

std::optional<Vec3> left_gyro_bias(const Map& map) {
  const std::vector<Vec3> rates = rates_of_disagreement(map);
  if (rates.size() < kFewestPieces) return std::nullopt;
  const Vec3 bias = robust_mean(rates);
  return bias.norm() < kMostBias_radps ? std::optional(bias) : std::nullopt;
}

std::optional<MapPatch> straightened(const Map& map, int min_shared, double least_extent_m,
                                     const std::atomic<bool>* abort) {
  const trace::Span span("straighten the map");
  if (extent_m(map) < least_extent_m) return std::nullopt;
  const auto gyro_bias = left_gyro_bias(map);
  if (!gyro_bias) return std::nullopt;
  return Straightening(map, *gyro_bias, min_shared).patch(abort);
}

}  // namespace ygslam
