// Landmarks and their observations, field by field, for an ArchiveWriter or an ArchiveReader.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "map/landmark.hpp"
#include "map/number_columns.hpp"

namespace ygslam::map_fields {

// Beyond these nothing is but numbers that would not stay finite when they are reckoned with.
inline constexpr double kFarthest_m = 1e7;
inline constexpr double kFarthestSeen_m = 1e30;  // in the largest of all pyramids
inline constexpr int kMostCounted = 1 << 30;     // of frames
inline constexpr const char* kTooFar = "a position is farther than any place";

/// Access to element i of a list of landmarks or of pointers to them.
inline Landmark& at(std::vector<Landmark>& landmarks, std::size_t i) { return landmarks[i]; }
inline const Landmark& at(const std::vector<const Landmark*>& landmarks, std::size_t i) {
  return *landmarks[i];
}

/// What a list of landmarks says beside them.
struct LandmarkExtras {
  /// Of the largest distance to the smallest: from it follows the smallest, nearly always.
  double distance_ratio = 1;
  /// Of each landmark: which of its observations has its descriptor (map/descriptor_sources).
  std::vector<std::uint8_t> sources;
  std::size_t most = std::numeric_limits<std::size_t>::max();  ///< landmarks that are read
};
/// The descriptor stands with the landmark itself.
inline constexpr std::uint8_t kOwnDescriptor = 255;

inline void check_landmark(ArchiveReader& archive, const Landmark& l) {
  archive.check(l.p_world.cwiseAbs().maxCoeff() < kFarthest_m, kTooFar);
  archive.check(l.visible >= 1 && l.found >= 0 && l.found <= l.visible,
                "a landmark was found more often than it was visible");
  archive.check(l.visible <= kMostCounted, "a landmark was visible too often");
  archive.check(l.min_distance_m >= 0 && l.min_distance_m <= l.max_distance_m &&
                    l.max_distance_m < kFarthestSeen_m,
                "a landmark has no range of distances");
  const double length = l.normal_world.norm();
  archive.check(length == 0 || std::abs(length - 1) < 1e-3, "a normal has not length 1");
}

/// Numbers of which a float is enough.
template <typename Archive>
void rounded_column(Archive& archive, std::size_t n, auto&& value) {
  std::vector<float> rounded(n);
  if constexpr (!Archive::kReads)
    for (std::size_t i = 0; i < n; ++i) rounded[i] = static_cast<float>(value(i));
  archive.template column<float>(n, [&](std::size_t i) -> auto& { return rounded[i]; });
  if constexpr (Archive::kReads)
    for (std::size_t i = 0; i < n; ++i) value(i) = rounded[i];
}

/// Where a landmark is looked for from: cosines and ranges are compared with what lies between two
/// levels of the pyramid, not with a ten-millionth part of themselves.
template <typename Archive>
void visibility(Archive& archive, auto& list, double distance_ratio) {
  const std::size_t n = list.size();
  for (Eigen::Index k = 0; k < 3; ++k)
    rounded_column(archive, n, [&](std::size_t i) -> auto& { return at(list, i).normal_world[k]; });
  rounded_column(archive, n, [&](std::size_t i) -> auto& { return at(list, i).max_distance_m; });
  std::vector<float> nearest_m(n);
  if constexpr (!Archive::kReads)
    for (std::size_t i = 0; i < n; ++i)
      nearest_m[i] = static_cast<float>(at(list, i).min_distance_m);
  guessed_column(
      archive, n, [&](std::size_t i) -> auto& { return nearest_m[i]; },
      [&](std::size_t i) {
        return static_cast<float>(at(list, i).max_distance_m) / distance_ratio;
      });
  if constexpr (Archive::kReads)
    for (std::size_t i = 0; i < n; ++i) at(list, i).min_distance_m = nearest_m[i];
}

/// Landmarks without their observations. Descriptors that stand with an observation are left as
/// they are.
template <typename Archive>
void landmarks(Archive& archive, auto& list, auto& extras) {  // a LandmarkExtras
  constexpr std::size_t kBytesEach = 61;
  archive.count(list, kBytesEach, extras.most);
  const std::size_t n = list.size();
  archive.number(extras.distance_ratio);
  archive.check(extras.distance_ratio >= 1, "a pyramid of no size");
  std::vector<std::uint32_t> step(n);  // from one number to the next
  std::uint32_t before = 0;
  if constexpr (!Archive::kReads)
    for (std::size_t i = 0; i < n; ++i) {
      step[i] = index(at(list, i).id) - before;
      before = index(at(list, i).id);
    }
  archive.template column<std::uint32_t>(n, [&](std::size_t i) -> auto& { return step[i]; });
  if constexpr (Archive::kReads)
    for (std::size_t i = 0; i < n; ++i) at(list, i).id = LandmarkId{before += step[i]};
  for (Eigen::Index k = 0; k < 3; ++k)
    archive.template column<double>(n,
                                    [&](std::size_t i) -> auto& { return at(list, i).p_world[k]; });
  visibility(archive, list, extras.distance_ratio);
  archive.template column<KeyframeId>(
      n, [&](std::size_t i) -> auto& { return at(list, i).first_keyframe; });
  archive.template column<int>(n, [&](std::size_t i) -> auto& { return at(list, i).visible; });
  archive.template column<int>(n, [&](std::size_t i) -> auto& { return at(list, i).found; });
  if constexpr (Archive::kReads) extras.sources.resize(n);
  archive.template column<std::uint8_t>(n,
                                        [&](std::size_t i) -> auto& { return extras.sources[i]; });
  for (std::size_t i = 0; i < n; ++i)
    if (extras.sources[i] == kOwnDescriptor)
      for (auto& bits : at(list, i).descriptor.bits) archive.number(bits);
  if constexpr (Archive::kReads)
    for (const Landmark& landmark : list) check_landmark(archive, landmark);
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
