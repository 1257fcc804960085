// The smallest map: for tests of what is written of frames.
#pragma once

#include <memory>

#include "map/map.hpp"

namespace ygslam::testing {

/// Of the frame `frame`, at 100 s.
inline Map map_of_one_keyframe(FrameId frame = FrameId{0}) {
  Map map({8, 1.2});
  map.add_keyframe(
      std::make_shared<KeyframeData>(KeyframeData{
          KeyframeId{0}, frame, {to_ns(100)}, std::make_shared<Features>(), FeatureGrid()}),
      SE3(), kNoKeyframe, {});
  return map;
}

}  // namespace ygslam::testing
