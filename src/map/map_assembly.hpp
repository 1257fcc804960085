// A map put together from parts that nobody vouches for: of a file, of another process.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "map/landmark_fields.hpp"
#include "map/map.hpp"

namespace ygslam {

/// A part is taken over or refused, never half taken over. Keyframes come first, in ascending
/// order of their ids, then landmarks; removed keyframes (ascending) at any time.
class MapAssembly {
 public:
  struct Numbers {
    std::uint32_t next_keyframe = 0;
    std::uint32_t next_landmark = 0;
    std::uint64_t version = 0;
    /// Whether there are any left for what is to come.
    [[nodiscard]] bool are_possible() const {
      return next_keyframe <= kMostIds && next_landmark <= kMostIds && version <= kMostVersions;
    }
  };
  static constexpr std::uint32_t kMostIds = 1U << 30;
  static constexpr std::uint64_t kMostVersions = std::uint64_t{1} << 62;
  static constexpr int kMostLevels = 32;
  /// Nothing if there can be no such pyramid.
  [[nodiscard]] static std::optional<PyramidScales> scales(std::uint32_t levels, double factor);

  /// @param bounds of the camera's undistorted image (Camera::ideal_bounds).
  MapAssembly(PyramidScales scales, const Numbers& numbers, const std::array<double, 4>& bounds);

  /// What is wrong with a part; nothing if it was taken over.
  using Fault = std::optional<std::string>;
  /// @param data without its grid, which is made here.
  Fault add_keyframe(std::shared_ptr<KeyframeData> data, const SE3& T_camera_world,
                     KeyframeId parent, std::vector<float> static_weight);
  Fault add_removed(const RemovedKeyframe& removed);
  /// @param source which of its observations has its descriptor (DescriptorSources).
  Fault add_landmark(Landmark landmark, std::uint8_t source = map_fields::kOwnDescriptor);

  /// Where nobody knows the numbers any more: new ids go on after the highest there are.
  void number_by_parts();

  /// The first keyframe, kept or removed, whose parent is not there or not made before it: ways
  /// through parents would not end.
  [[nodiscard]] Fault parent_fault() const;
  /// The map; to be called once, when parent_fault() has found nothing.
  [[nodiscard]] Map finish();

  /// What there is so far, without the keyframes' shared landmarks.
  [[nodiscard]] const Map& map() const { return map_; }

 private:
  void count_covisibility();

  Map map_;
  Numbers numbers_;
  std::array<double, 4> bounds_;
};

}  // namespace ygslam
