// The baked people: one mesh topology with skin weights, several body shapes, a skeleton.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "simulation/surface/mesh.hpp"

namespace ygslam::sim {

/// Bones in the order of the asset; a parent stands before its children.
enum class Bone : std::uint8_t {
  kHips,
  kLowerBack,
  kSpine,
  kChest,
  kNeck,
  kNeck1,
  kHead,
  kLeftShoulder,
  kLeftArm,
  kLeftForeArm,
  kLeftHand,
  kLeftFingers,
  kLeftFingerTips,
  kLeftThumb,
  kRightShoulder,
  kRightArm,
  kRightForeArm,
  kRightHand,
  kRightFingers,
  kRightFingerTips,
  kRightThumb,
  kLeftThigh,
  kLeftShin,
  kLeftFoot,
  kLeftToes,
  kRightThigh,
  kRightShin,
  kRightFoot,
  kRightToes,
};
inline constexpr std::size_t kBones = 29;
[[nodiscard]] constexpr std::size_t index(Bone bone) { return static_cast<std::size_t>(bone); }

/// A body of one shape, standing with its arms held out; body frame: x forward, y left, z up,
/// soles on z = 0 [m].
struct BodyShape {
  std::string name;
  std::array<Vec3, kBones> joints;  ///< where each bone begins
  std::vector<Vec3f> points;
};

struct BodyModel {
  struct Weights {
    std::array<std::uint8_t, 4> bone;
    std::array<std::uint8_t, 4> share;  ///< sum 255
  };
  std::vector<std::string> parts;   ///< names of the regions: "skin", "shirt", ...
  std::vector<Triangle> triangles;  ///< `material` holds the part's index
  std::vector<Vec2f> uv;            ///< [m] on the surface
  std::vector<Weights> weights;
  std::vector<std::uint32_t> twin;   ///< first vertex at the same place (seams have two)
  std::array<int, kBones> parent{};  ///< -1 for the root
  std::vector<BodyShape> shapes;
};

/// @param bytes the baked asset. @return kInput if it is damaged.
[[nodiscard]] Result<BodyModel> parse_bodies(std::string_view bytes);

}  // namespace ygslam::sim
