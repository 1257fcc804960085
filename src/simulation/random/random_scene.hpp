// A room nobody drew, with people in it and a camera that jumps about.
#pragma once

#include <memory>
#include <vector>

#include "core/rng.hpp"
#include "image/image.hpp"
#include "simulation/people/body_model.hpp"
#include "simulation/render/scene.hpp"

namespace ygslam::sim {

/// Where the camera is in shot i, which lasts from i to i + 1 s.
struct Shot {
  SE3 T_world_camera;  ///< optical frame
  SE3 T_world_before;  ///< one frame time earlier: what blurs the picture
  double exposure = 1;
};

/// Instance ids from here on belong to things, smaller ones to people.
inline constexpr int kFirstThing = 100;

struct RandomScene {
  Scene scene;  ///< people and the chairs they sit on are its movers
  std::vector<Shot> shots;
};

/// @param album pictures with people in them, for posters and screens; may be empty.
/// @param texture_size edge of tiled bitmaps [texels].
[[nodiscard]] std::unique_ptr<RandomScene> draw_scene(const BodyModel& baked, int shots,
                                                      const std::vector<ColourImage>& album,
                                                      int texture_size, int threads, Rng& rng);

}  // namespace ygslam::sim
