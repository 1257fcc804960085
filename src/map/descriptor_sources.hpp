// A landmark's descriptor is nearly always that of one of its observations, and need not be kept
// twice.
#pragma once

#include <unordered_map>

#include "map/landmark_fields.hpp"
#include "map/map.hpp"

namespace ygslam {

class DescriptorSources {
 public:
  /// @param map must outlive it and stay as it is.
  explicit DescriptorSources(const Map& map) {
    features_.reserve(map.keyframes().size());
    for (const auto& [id, keyframe] : map.keyframes())
      features_.emplace(index(id), keyframe.data->features.get());
    extras_.distance_ratio = map.scales().of(map.scales().levels() - 1);
  }

  /// What is to be written with the landmarks; valid until the next call.
  [[nodiscard]] const map_fields::LandmarkExtras& of(
      const std::vector<const Landmark*>& landmarks) {
    extras_.sources.clear();
    for (const Landmark* landmark : landmarks) extras_.sources.push_back(source(*landmark));
    return extras_;
  }

 private:
  /// The first observation that has the landmark's descriptor.
  [[nodiscard]] std::uint8_t source(const Landmark& landmark) const {
    const auto& seen = landmark.observations;
    for (std::uint8_t i = 0; i < map_fields::kOwnDescriptor && i < seen.size(); ++i)
      if (features_.at(index(seen[i].keyframe))->descriptors[seen[i].feature] ==
          landmark.descriptor)
        return i;
    return map_fields::kOwnDescriptor;
  }

  std::unordered_map<std::uint32_t, const Features*> features_;
  map_fields::LandmarkExtras extras_;
};

}  // namespace ygslam
