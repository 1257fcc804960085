// The parts of a map, field by field, for an ArchiveWriter or an ArchiveReader. Read numbers are
// checked for what they can be by themselves; how the parts fit together checks MapAssembly.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "map/archive.hpp"
#include "map/map.hpp"

namespace ygslam::map_fields {

inline constexpr double kMostShutterTime_s = 1;
// Beyond these nothing is but numbers that would not stay finite when they are reckoned with.
inline constexpr double kFarthest_m = 1e7;
inline constexpr double kFastest = 1e6;       // m/s, rad/s
inline constexpr int kMostCounted = 1 << 30;  // of frames
inline constexpr const char* kTooFar = "a position is farther than any place";
inline constexpr std::uint32_t kMostBlocks = 4096;  // of a free-space image, in a row or column

template <typename Archive, typename Vector>
void coefficients(Archive& archive, Vector& v) {
  for (Eigen::Index i = 0; i < v.size(); ++i) archive.number(v.data()[i]);
}

inline void pose(ArchiveWriter& archive, const SE3& T) {
  coefficients(archive, T.R());
  coefficients(archive, T.t());
}
inline void pose(ArchiveReader& archive, SE3& T) {
  Mat3 R = Mat3::Identity();
  Vec3 t = Vec3::Zero();
  coefficients(archive, R);
  coefficients(archive, t);
  archive.check((R.transpose() * R - Mat3::Identity()).norm() < 1e-6 && R.determinant() > 0,
                "a pose is no rotation");
  archive.check(t.cwiseAbs().maxCoeff() < kFarthest_m, kTooFar);
  if (archive.ok()) T = SE3(R, t);
}

template <typename Archive>
void read_out(Archive& archive, auto& r) {  // a ReadOut
  for (auto* time_s :
       {&r.times.colour_readout_s, &r.times.depth_readout_s, &r.times.depth_delay_s}) {
    archive.number(*time_s);
    archive.check(std::abs(*time_s) < kMostShutterTime_s, "a shutter time is too long");
  }
  coefficients(archive, r.body_velocity);
  archive.check(r.body_velocity.cwiseAbs().maxCoeff() < kFastest, "a camera is too fast");
}

template <typename Archive>
void removed_keyframe(Archive& archive, auto& removed) {  // a RemovedKeyframe
  archive.number(removed.id);
  archive.number(removed.parent);
  auto& T = removed.T_camera_parent;
  for (auto& q : T.q_xyzw) archive.number(q);
  for (auto& t : T.t) {
    archive.number(t);
    archive.check(std::abs(t) < kFarthest_m, kTooFar);
  }
  archive.check(std::abs(Eigen::Vector4d(T.q_xyzw.data()).norm() - 1) < 1e-6,
                "a pose is no rotation");
}

/// Without lens distortion and rolling shutter ideal_px equals uv_px: what differs is kept.
template <typename Archive>
void difference(Archive& archive, std::size_t n, auto&& value, auto&& base) {
  std::vector<std::uint32_t> bits(n);
  if constexpr (!Archive::kReads) {
    for (std::size_t i = 0; i < n; ++i)
      bits[i] = std::bit_cast<std::uint32_t>(value(i)) ^ std::bit_cast<std::uint32_t>(base(i));
  }
  archive.template column<std::uint32_t>(n, [&](std::size_t i) -> auto& { return bits[i]; });
  if constexpr (Archive::kReads) {
    bool finite = true;
    for (std::size_t i = 0; i < n; ++i) {
      const auto v = std::bit_cast<float>(bits[i] ^ std::bit_cast<std::uint32_t>(base(i)));
      finite = finite && std::isfinite(v);
      value(i) = v;
    }
    archive.check(finite, "a number is not finite");
  }
}

template <typename Archive>
void features(Archive& archive, auto& features) {
  constexpr std::size_t kBytesEach = 62;
  archive.count(features.points, kBytesEach);
  auto& points = features.points;
  const std::size_t n = points.size();
  if constexpr (Archive::kReads) features.descriptors.resize(n);
  const auto u = [&](std::size_t i) -> auto& { return points[i].uv_px.x(); };
  const auto v = [&](std::size_t i) -> auto& { return points[i].uv_px.y(); };
  archive.template column<float>(n, u);
  archive.template column<float>(n, v);
  difference(
      archive, n, [&](std::size_t i) -> auto& { return points[i].ideal_px.x(); }, u);
  difference(
      archive, n, [&](std::size_t i) -> auto& { return points[i].ideal_px.y(); }, v);
  archive.template column<float>(n, [&](std::size_t i) -> auto& { return points[i].depth_m; });
  archive.template column<float>(n, [&](std::size_t i) -> auto& { return points[i].angle_rad; });
  archive.template column<float>(n, [&](std::size_t i) -> auto& { return points[i].response; });
  archive.template column<std::uint8_t>(n,
                                        [&](std::size_t i) -> auto& { return points[i].octave; });
  std::vector<std::uint8_t> edge(n);
  if constexpr (!Archive::kReads)
    for (std::size_t i = 0; i < n; ++i) edge[i] = points[i].on_depth_edge ? 1 : 0;
  archive.template column<std::uint8_t>(n, [&](std::size_t i) -> auto& { return edge[i]; });
  if constexpr (Archive::kReads) {
    for (std::size_t i = 0; i < n; ++i) {
      points[i].on_depth_edge = edge[i] != 0;
      archive.check(points[i].depth_m >= 0, "a depth is negative");
    }
  }
  for (auto& descriptor : features.descriptors)
    for (auto& bits : descriptor.bits) archive.number(bits);
}

/// The unit [m] of which all depths are whole multiples, as images of depth have it; 0 if none of
/// the usual ones. Exact: the same numbers come back.
inline float depth_unit_m(const DepthImage& depth_m) {
  for (const double per_metre : {5000.0, 1000.0}) {
    const auto unit_m = static_cast<float>(1.0 / per_metre);
    const auto is_multiple = [&](float m) {
      const float k = std::round(m / unit_m);
      return k >= 0 && k <= 65535 && k * unit_m == m;
    };
    if (std::all_of(depth_m.begin(), depth_m.end(), is_multiple)) return unit_m;
  }
  return 0;
}

/// Depths as they are, or in whole units, each as what it has more than the one before.
template <typename Archive>
void depths(Archive& archive, auto& depth_m) {  // a DepthImage
  float unit_m = 0;
  if constexpr (!Archive::kReads) unit_m = depth_unit_m(depth_m);
  archive.number(unit_m);
  archive.check(unit_m >= 0 && unit_m < 1, "a free-space image of no unit");
  const std::size_t n = depth_m.size();
  const auto at = [&](std::size_t i) -> auto& {
    return depth_m.begin()[static_cast<std::ptrdiff_t>(i)];
  };
  if (unit_m == 0) return archive.template column<float>(n, at);
  std::vector<std::uint16_t> more(n);
  std::uint16_t before = 0;
  if constexpr (!Archive::kReads) {
    for (std::size_t i = 0; i < n; ++i) {
      const auto units = static_cast<std::uint16_t>(std::round(at(i) / unit_m));
      more[i] = static_cast<std::uint16_t>(units - before);
      before = units;
    }
  }
  archive.template column<std::uint16_t>(n, [&](std::size_t i) -> auto& { return more[i]; });
  if constexpr (Archive::kReads) {
    for (std::size_t i = 0; i < n; ++i) {
      before = static_cast<std::uint16_t>(before + more[i]);
      at(i) = static_cast<float>(before) * unit_m;
    }
  }
}

template <typename Archive>
void free_space(Archive& archive, auto& data) {  // a KeyframeData
  std::uint32_t width = static_cast<std::uint32_t>(data.free_space.blocks_m().width());
  std::uint32_t height = static_cast<std::uint32_t>(data.free_space.blocks_m().height());
  archive.number(width);
  archive.number(height);
  if constexpr (Archive::kReads) {
    archive.check(width <= kMostBlocks && height <= kMostBlocks &&
                      std::size_t{width} * height <= archive.remaining() / sizeof(std::uint16_t),
                  "a free-space image is larger than its bytes");
    if (!archive.ok()) return;
    DepthImage blocks_m(static_cast<int>(width), static_cast<int>(height));
    depths(archive, blocks_m);
    data.free_space = FreeSpaceImage::of_blocks(std::move(blocks_m));
  } else {
    depths(archive, data.free_space.blocks_m());
  }
}

/// What a keyframe saw, without its number and time.
inline void seen(ArchiveWriter& archive, const KeyframeData& data) {
  features(archive, *data.features);
  free_space(archive, data);
  read_out(archive, data.read_out);
}
inline void seen(ArchiveReader& archive, KeyframeData& data) {
  auto points = std::make_shared<Features>();
  features(archive, *points);
  data.features = std::move(points);
  free_space(archive, data);
  read_out(archive, data.read_out);
}

template <typename Archive>
void static_weight(Archive& archive, auto& weight) {  // a vector of float
  archive.count(weight, sizeof(float));
  archive.template column<float>(weight.size(), [&](std::size_t i) -> auto& { return weight[i]; });
  if constexpr (Archive::kReads)
    for (const float w : weight) archive.check(w >= 0 && w <= 1, "a weight is not in 0..1");
}

/// Access to element i of a list of landmarks or of pointers to them.
inline Landmark& at(std::vector<Landmark>& landmarks, std::size_t i) { return landmarks[i]; }
inline const Landmark& at(const std::vector<const Landmark*>& landmarks, std::size_t i) {
  return *landmarks[i];
}

/// Landmarks without their observations.
template <typename Archive>
void landmarks(Archive& archive, auto& list) {
  constexpr std::size_t kBytesEach = 112;
  archive.count(list, kBytesEach);
  const std::size_t n = list.size();
  archive.template column<LandmarkId>(n, [&](std::size_t i) -> auto& { return at(list, i).id; });
  for (Eigen::Index k = 0; k < 3; ++k)
    archive.template column<double>(n,
                                    [&](std::size_t i) -> auto& { return at(list, i).p_world[k]; });
  for (Eigen::Index k = 0; k < 3; ++k)
    archive.template column<double>(
        n, [&](std::size_t i) -> auto& { return at(list, i).normal_world[k]; });
  archive.template column<double>(
      n, [&](std::size_t i) -> auto& { return at(list, i).min_distance_m; });
  archive.template column<double>(
      n, [&](std::size_t i) -> auto& { return at(list, i).max_distance_m; });
  archive.template column<KeyframeId>(
      n, [&](std::size_t i) -> auto& { return at(list, i).first_keyframe; });
  archive.template column<int>(n, [&](std::size_t i) -> auto& { return at(list, i).visible; });
  archive.template column<int>(n, [&](std::size_t i) -> auto& { return at(list, i).found; });
  for (std::size_t i = 0; i < n; ++i)
    for (auto& bits : at(list, i).descriptor.bits) archive.number(bits);
  for (std::size_t i = 0; i < n && Archive::kReads; ++i) {
    const Landmark& l = at(list, i);
    archive.check(l.p_world.cwiseAbs().maxCoeff() < kFarthest_m, kTooFar);
    archive.check(l.visible >= 1 && l.found >= 0 && l.found <= l.visible,
                  "a landmark was found more often than it was visible");
    archive.check(l.visible <= kMostCounted, "a landmark was visible too often");
    archive.check(l.min_distance_m >= 0 && l.min_distance_m <= l.max_distance_m,
                  "a landmark has no range of distances");
    const double length = l.normal_world.norm();
    archive.check(length == 0 || std::abs(length - 1) < 1e-3, "a normal has not length 1");
  }
}

/// The observations of landmarks: how many each has, then all keyframes, then all features.
template <typename Archive>
void observations(Archive& archive, auto& list) {
  const std::size_t n = list.size();
  std::vector<std::uint32_t> counts(n);
  if constexpr (!Archive::kReads)
    for (std::size_t i = 0; i < n; ++i)
      counts[i] = static_cast<std::uint32_t>(at(list, i).observations.size());
  archive.template column<std::uint32_t>(n, [&](std::size_t i) -> auto& { return counts[i]; });
  std::size_t total = 0;
  for (const std::uint32_t count : counts) total += count;
  if constexpr (Archive::kReads) {
    archive.check(total <= archive.remaining() / sizeof(LandmarkObservation), "cut short");
    if (!archive.ok()) return;
  }
  std::vector<std::uint32_t> keyframe(total);
  std::vector<std::uint32_t> feature(total);
  // Of each landmark the first keyframe, then steps from one to the next: small numbers.
  const auto each = [&](auto&& visit) {
    std::size_t k = 0;
    for (std::size_t i = 0; i < n; ++i) {
      std::uint32_t before = 0;
      for (auto& o : at(list, i).observations) visit(o, before, k++);
    }
  };
  if constexpr (!Archive::kReads) {
    each([&](const LandmarkObservation& o, std::uint32_t& before, std::size_t k) {
      keyframe[k] = index(o.keyframe) - before;
      before = index(o.keyframe);
      feature[k] = o.feature;
    });
  }
  archive.template column<std::uint32_t>(total,
                                         [&](std::size_t k) -> auto& { return keyframe[k]; });
  archive.template column<std::uint32_t>(total, [&](std::size_t k) -> auto& { return feature[k]; });
  if constexpr (Archive::kReads) {
    for (std::size_t i = 0; i < n; ++i) at(list, i).observations.resize(counts[i]);
    each([&](LandmarkObservation& o, std::uint32_t& before, std::size_t k) {
      before += keyframe[k];
      o = {KeyframeId{before}, feature[k]};
    });
  }
}

}  // namespace ygslam::map_fields
