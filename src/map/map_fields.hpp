// The parts of a map, field by field, for an ArchiveWriter or an ArchiveReader. Read numbers are
// checked for what they can be by themselves; how the parts fit together checks MapAssembly.
#pragma once

#include <cmath>
#include <cstdint>
#include <utility>

#include "map/archive.hpp"
#include "map/feature_fields.hpp"
#include "map/landmark_fields.hpp"
#include "map/map.hpp"

namespace ygslam::map_fields {

inline constexpr double kMostShutterTime_s = 1;
inline constexpr double kFastest = 1e6;             // m/s, rad/s; beyond it nothing is
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

template <typename Archive>
void free_space(Archive& archive, auto& data) {  // a KeyframeData
  std::uint32_t width = static_cast<std::uint32_t>(data.free_space.blocks_m().width());
  std::uint32_t height = static_cast<std::uint32_t>(data.free_space.blocks_m().height());
  archive.number(width);
  archive.number(height);
  const auto in_rows = [](auto& blocks_m) {
    return [&](std::size_t i) -> auto& { return blocks_m.begin()[static_cast<std::ptrdiff_t>(i)]; };
  };
  if constexpr (Archive::kReads) {
    archive.check(width <= kMostBlocks && height <= kMostBlocks &&
                      std::size_t{width} * height <= archive.remaining() / sizeof(std::uint16_t),
                  "a free-space image is larger than its bytes");
    if (!archive.ok()) return;
    DepthImage blocks_m(static_cast<int>(width), static_cast<int>(height));
    depths(archive, blocks_m.size(), Order::kInOrder, in_rows(blocks_m));
    data.free_space = FreeSpaceImage::of_blocks(std::move(blocks_m));
  } else {
    const DepthImage& blocks_m = data.free_space.blocks_m();
    depths(archive, blocks_m.size(), Order::kInOrder, in_rows(blocks_m));
  }
}

/// What a keyframe saw, without its number and time.
/// @param camera of the map's file; null where it is not in one.
inline void seen(ArchiveWriter& archive, const KeyframeData& data, const Camera* camera) {
  features(archive, *data.features, camera);
  free_space(archive, data);
  read_out(archive, data.read_out);
}
inline void seen(ArchiveReader& archive, KeyframeData& data, const Camera* camera) {
  auto points = std::make_shared<Features>();
  features(archive, *points, camera);
  data.features = std::move(points);
  free_space(archive, data);
  read_out(archive, data.read_out);
}

}  // namespace ygslam::map_fields
