#include "map/projection_matcher.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace ygslam {
namespace {

constexpr int kRotationBins = 30;

struct Best {
  int distance = 257;
  int octave = -1;
  std::uint32_t feature = 0;
};

int rotation_bin(float from_rad, float to_rad) {
  constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;
  float difference = to_rad - from_rad;
  if (difference < 0) difference += kTurn;
  return std::min(kRotationBins - 1,
                  static_cast<int>(difference / kTurn * static_cast<float>(kRotationBins)));
}

std::optional<PointMatch> find_one(const SearchPoint& point, const Features& features,
                                   std::span<const std::uint32_t> candidates,
                                   std::span<const std::uint8_t> usable,
                                   const ProjectionMatcherConfig& config) {
  Best best;
  Best second;
  for (const std::uint32_t i : candidates) {
    if (!usable[i]) continue;
    const int d = distance(*point.descriptor, features.descriptors[i]);
    if (d < best.distance) {
      second = best;
      best = {d, features.points[i].octave, i};
    } else if (d < second.distance) {
      second = {d, features.points[i].octave, i};
    }
  }
  if (best.distance > config.max_distance) return std::nullopt;
  if (second.octave == best.octave && best.distance > config.ratio * second.distance) {
    return std::nullopt;
  }
  return PointMatch{point.source, best.feature, best.distance};
}

}  // namespace

std::vector<PointMatch> match_by_projection(const Camera& camera, const SE3& T_camera_world,
                                            std::span<const SearchPoint> points,
                                            const Features& features, const FeatureGrid& grid,
                                            std::span<const std::uint8_t> usable,
                                            const ProjectionMatcherConfig& config) {
  // The nearer descriptor wins a feature that two points claim.
  std::vector<std::int32_t> claim(features.size(), -1);
  std::vector<PointMatch> claims;
  std::vector<std::uint32_t> candidates;
  for (const SearchPoint& point : points) {
    const Vec3 p_camera = T_camera_world * point.p_world;
    if (p_camera.z() < 0.05) continue;
    const Vec2 ideal_px = camera.project(p_camera);
    if (!camera.sees(ideal_px)) continue;
    grid.in_radius(ideal_px.cast<float>(), static_cast<float>(point.radius_px), point.min_octave,
                   point.max_octave, candidates);
    const auto match = find_one(point, features, candidates, usable, config);
    if (!match) continue;
    std::int32_t& owner = claim[match->feature];
    if (owner >= 0 && claims[owner].distance <= match->distance) continue;
    if (owner >= 0) claims[owner].distance = -1;
    owner = static_cast<std::int32_t>(claims.size());
    claims.push_back(*match);
  }
  std::erase_if(claims, [](const PointMatch& m) { return m.distance < 0; });
  if (config.check_orientation) keep_dominant_rotations(claims, points, features);
  return claims;
}

void keep_dominant_rotations(std::vector<PointMatch>& matches, std::span<const SearchPoint> points,
                             const Features& features) {
  std::array<int, kRotationBins> histogram{};
  std::vector<int> bin(matches.size(), -1);
  // Sources may be any number of the caller's: find each match's point by walking both in step.
  std::size_t p = 0;
  for (std::size_t m = 0; m < matches.size(); ++m) {
    while (points[p].source != matches[m].source) ++p;
    if (points[p].angle_rad < 0) continue;
    bin[m] = rotation_bin(points[p].angle_rad, features.points[matches[m].feature].angle_rad);
    ++histogram[bin[m]];
  }
  std::array<int, kRotationBins> order{};
  for (int i = 0; i < kRotationBins; ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return histogram[a] > histogram[b]; });
  std::array<bool, kRotationBins> kept{};
  for (int i = 0; i < 3; ++i) {
    if (10 * histogram[order[i]] >= histogram[order[0]]) kept[order[i]] = true;
  }
  std::size_t out = 0;
  for (std::size_t m = 0; m < matches.size(); ++m) {
    if (bin[m] < 0 || kept[bin[m]]) matches[out++] = matches[m];
  }
  matches.resize(out);
}

}  // namespace ygslam
