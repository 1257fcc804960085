// Strong ids: distinct types, so that a frame's number cannot be taken for a keyframe's.
#pragma once

#include <cstdint>
#include <functional>

namespace ygslam {

enum class FrameId : std::uint32_t {};
enum class KeyframeId : std::uint32_t {};
enum class LandmarkId : std::uint32_t {};
enum class ObjectId : std::uint32_t {};

inline constexpr LandmarkId kNoLandmark{0xffffffffU};
inline constexpr KeyframeId kNoKeyframe{0xffffffffU};
inline constexpr FrameId kNoFrame{0xffffffffU};
inline constexpr ObjectId kNoObject{0xffffffffU};

template <typename Id>
[[nodiscard]] constexpr std::uint32_t index(Id id) {
  return static_cast<std::uint32_t>(id);
}

}  // namespace ygslam
