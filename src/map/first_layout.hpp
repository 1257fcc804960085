// How the first format of map files laid out what the second one keeps shorter: read only.
#pragma once

#include "map/feature_fields.hpp"
#include "map/landmark_fields.hpp"

namespace ygslam::map_fields::first_layout {

/// What two numbers have in different bits.
inline void difference(ArchiveReader& archive, std::size_t n, auto&& value, auto&& base) {
  std::vector<std::uint32_t> bits(n);
  archive.column<std::uint32_t>(n, [&](std::size_t i) -> auto& { return bits[i]; });
  bool finite = true;
  for (std::size_t i = 0; i < n; ++i) {
    value(i) = std::bit_cast<float>(bits[i] ^ std::bit_cast<std::uint32_t>(base(i)));
    finite = finite && std::isfinite(value(i));
  }
  archive.check(finite, ArchiveReader::kNotFinite);
}

inline void features(ArchiveReader& archive, Features& features) {
  constexpr std::size_t kBytesEach = 62;
  archive.count(features.points, kBytesEach);
  auto& points = features.points;
  const std::size_t n = points.size();
  features.descriptors.resize(n);
  const auto u = [&](std::size_t i) -> auto& { return points[i].uv_px.x(); };
  const auto v = [&](std::size_t i) -> auto& { return points[i].uv_px.y(); };
  archive.column<float>(n, u);
  archive.column<float>(n, v);
  difference(
      archive, n, [&](std::size_t i) -> auto& { return points[i].ideal_px.x(); }, u);
  difference(
      archive, n, [&](std::size_t i) -> auto& { return points[i].ideal_px.y(); }, v);
  archive.column<float>(n, [&](std::size_t i) -> auto& { return points[i].depth_m; });
  archive.column<float>(n, [&](std::size_t i) -> auto& { return points[i].angle_rad; });
  float strength = 0;  // of no use
  archive.column<float>(n, [&](std::size_t) -> auto& { return strength; });
  archive.column<std::uint8_t>(n, [&](std::size_t i) -> auto& { return points[i].octave; });
  std::vector<std::uint8_t> edge(n);
  archive.column<std::uint8_t>(n, [&](std::size_t i) -> auto& { return edge[i]; });
  for (std::size_t i = 0; i < n; ++i) {
    points[i].on_depth_edge = edge[i] != 0;
    archive.check(points[i].depth_m >= 0, "a depth is negative");
  }
  for (auto& descriptor : features.descriptors)
    for (auto& bits : descriptor.bits) archive.number(bits);
}

/// Steps of a free-space image were kept as they are.
inline void depths(ArchiveReader& archive, std::size_t n, auto&& depth_m) {
  float unit_m = 0;
  archive.number(unit_m);
  archive.check(unit_m >= 0 && unit_m < 1, kNoUnit);
  if (unit_m == 0) return archive.column<float>(n, depth_m);
  std::vector<std::uint16_t> more(n);
  archive.column<std::uint16_t>(n, [&](std::size_t i) -> auto& { return more[i]; });
  std::uint16_t before = 0;
  for (std::size_t i = 0; i < n; ++i) {
    before = static_cast<std::uint16_t>(before + more[i]);
    depth_m(i) = static_cast<float>(before) * unit_m;
  }
}

inline void static_weight(ArchiveReader& archive, std::vector<float>& weight) {
  archive.count(weight, sizeof(float));
  archive.column<float>(weight.size(), [&](std::size_t i) -> auto& { return weight[i]; });
  for (const float w : weight) archive.check(w >= 0 && w <= 1, kNoWeight);
}

/// As it is kept now: what is accepted here can be written and read again.
inline void round_visibility(Landmark& landmark) {
  landmark.normal_world = landmark.normal_world.cast<float>().cast<double>().eval();
  landmark.min_distance_m = static_cast<float>(landmark.min_distance_m);
  landmark.max_distance_m = static_cast<float>(landmark.max_distance_m);
}

inline void landmarks(ArchiveReader& archive, std::vector<Landmark>& list) {
  constexpr std::size_t kBytesEach = 112;
  archive.count(list, kBytesEach);
  const std::size_t n = list.size();
  archive.column<LandmarkId>(n, [&](std::size_t i) -> auto& { return list[i].id; });
  for (Eigen::Index k = 0; k < 3; ++k)
    archive.column<double>(n, [&](std::size_t i) -> auto& { return list[i].p_world[k]; });
  for (Eigen::Index k = 0; k < 3; ++k)
    archive.column<double>(n, [&](std::size_t i) -> auto& { return list[i].normal_world[k]; });
  archive.column<double>(n, [&](std::size_t i) -> auto& { return list[i].min_distance_m; });
  archive.column<double>(n, [&](std::size_t i) -> auto& { return list[i].max_distance_m; });
  archive.column<KeyframeId>(n, [&](std::size_t i) -> auto& { return list[i].first_keyframe; });
  archive.column<int>(n, [&](std::size_t i) -> auto& { return list[i].visible; });
  archive.column<int>(n, [&](std::size_t i) -> auto& { return list[i].found; });
  for (Landmark& landmark : list)
    for (auto& bits : landmark.descriptor.bits) archive.number(bits);
  for (Landmark& landmark : list) {
    check_landmark(archive, landmark);
    if (!archive.ok()) return;
    round_visibility(landmark);
    check_landmark(archive, landmark);
  }
}

}  // namespace ygslam::map_fields::first_layout
