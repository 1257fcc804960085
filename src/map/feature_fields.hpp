// A keyframe's features and their weights, field by field, for an ArchiveWriter or an
// ArchiveReader.
#pragma once

#include <cmath>
#include <numbers>

#include "features/feature.hpp"
#include "geometry/camera.hpp"
#include "map/number_columns.hpp"

namespace ygslam::map_fields {

inline constexpr std::size_t kMostFeatures = 1U << 20;  // of a keyframe: rows are no larger

/// Angles are kept in this many parts of a turn: within 0.7 degrees. They vote for rotations that
/// are twelve degrees wide (map/projection_matcher), and those of keyframes for none.
inline constexpr double kAngleParts = 256;

[[nodiscard]] inline std::uint8_t angle_code(float angle_rad) {
  const double turns = std::fmod(angle_rad / (2 * std::numbers::pi), 1.0);
  return static_cast<std::uint8_t>(std::lround(turns * kAngleParts) & 0xff);
}
[[nodiscard]] inline float angle_of(std::uint8_t code) {
  return static_cast<float>(code * (2 * std::numbers::pi / kAngleParts));
}

/// Without its strength, which is of use only where features are chosen.
/// @param camera null: whoever reads has none. Where features lie without lens distortion follows
/// from it; what a rolling shutter adds is kept.
template <typename Archive>
void features(Archive& archive, auto& features, const Camera* camera) {  // a Features
  constexpr std::size_t kBytesEach = 52;
  constexpr std::uint8_t kOnEdge = 0x80;  // the rest is the pyramid level
  constexpr std::uint8_t kOnPlane = 0x40;
  archive.count(features.points, kBytesEach, kMostFeatures);
  auto& points = features.points;
  const std::size_t n = points.size();
  if constexpr (Archive::kReads) features.descriptors.resize(n);
  archive.template column<float>(n, [&](std::size_t i) -> auto& { return points[i].uv_px.x(); });
  archive.template column<float>(n, [&](std::size_t i) -> auto& { return points[i].uv_px.y(); });
  if (!archive.ok()) return;
  std::vector<Eigen::Vector2f> straight_px(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2f& uv_px = points[i].uv_px;
    straight_px[i] = camera == nullptr
                         ? uv_px
                         : camera->undistort(uv_px.template cast<double>()).template cast<float>();
  }
  for (const Eigen::Index k : {0, 1})
    guessed_column(
        archive, n, [&](std::size_t i) -> auto& { return points[i].ideal_px[k]; },
        [&](std::size_t i) { return straight_px[i][k]; });
  depths(archive, n, Order::kMixed, [&](std::size_t i) -> auto& { return points[i].depth_m; });
  std::vector<std::uint8_t> angle(n);
  std::vector<std::uint8_t> level(n);
  if constexpr (!Archive::kReads) {
    for (std::size_t i = 0; i < n; ++i) {
      angle[i] = angle_code(points[i].angle_rad);
      level[i] =
          static_cast<std::uint8_t>(points[i].octave | (points[i].on_depth_edge ? kOnEdge : 0) |
                                    (points[i].on_plane ? kOnPlane : 0));
    }
  }
  archive.template column<std::uint8_t>(n, [&](std::size_t i) -> auto& { return angle[i]; });
  archive.template column<std::uint8_t>(n, [&](std::size_t i) -> auto& { return level[i]; });
  if constexpr (Archive::kReads) {
    for (std::size_t i = 0; i < n; ++i) {
      points[i].angle_rad = angle_of(angle[i]);
      points[i].octave = level[i] & static_cast<std::uint8_t>(~(kOnEdge | kOnPlane));
      points[i].on_depth_edge = (level[i] & kOnEdge) != 0;
      points[i].on_plane = (level[i] & kOnPlane) != 0;
      archive.check(points[i].depth_m >= 0, "a depth is negative");
    }
  }
  for (auto& descriptor : features.descriptors)
    for (auto& bits : descriptor.bits) archive.number(bits);
}

inline constexpr const char* kNoWeight = "a weight is not in 0..1";

/// Nearly all weights are 0 or 1: one byte each, then the others.
template <typename Archive>
void static_weight(Archive& archive, auto& weight) {  // a vector of float
  enum Kind : std::uint8_t { kNone, kWhole, kOther };
  archive.count(weight, 1, kMostFeatures);
  std::vector<std::uint8_t> kind(weight.size());
  if constexpr (!Archive::kReads)
    for (std::size_t i = 0; i < kind.size(); ++i)
      kind[i] = weight[i] == 1 ? kWhole : weight[i] == 0 ? kNone : kOther;
  archive.template column<std::uint8_t>(kind.size(),
                                        [&](std::size_t i) -> auto& { return kind[i]; });
  std::vector<std::size_t> others;
  for (std::size_t i = 0; i < kind.size(); ++i) {
    archive.check(kind[i] <= kOther, "a weight of no kind");
    if (kind[i] == kOther) others.push_back(i);
    if constexpr (Archive::kReads) weight[i] = kind[i] == kWhole ? 1.0F : 0.0F;
  }
  archive.template column<float>(others.size(),
                                 [&](std::size_t k) -> auto& { return weight[others[k]]; });
  if constexpr (Archive::kReads)
    for (const float w : weight) archive.check(w >= 0 && w <= 1, kNoWeight);
}

}  // namespace ygslam::map_fields
