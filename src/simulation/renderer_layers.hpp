// What the passes of the renderer hand to each other. For the renderer*.cpp files.
#pragma once

#include <vector>

#include "simulation/renderer.hpp"

namespace ygslam::sim {

inline constexpr float kReach_m = 60;  ///< nothing is seen farther away
inline constexpr int kTile = 4;        ///< pixels whose rays travel together: kTile x kTile
static_assert(kTile * kTile == kPacket);
inline constexpr int kLightBlock = 16;  ///< pixels whose light samples travel together, a side

/// What became of the light sample of a pixel.
enum LightState : std::uint8_t {
  kFixedLets = 1,    ///< the fixed scene lets it through
  kFixedBlocks = 2,  ///< or not
  kMoversLet = 4,    ///< the movers let it through
  kMoversBlock = 8,  ///< or not
};

/// How a pixel of the static layer differs from the layer with movers.
enum Change : std::uint8_t { kSame = 0, kOtherSurface = 1, kOtherLight = 2 };

struct Renderer::Layer {
  std::vector<RayHit> hits;
  std::vector<SurfacePoint> surfaces;
  std::vector<Vec3f> points;
  std::vector<float> weight;          // unshadowed light of this pixel's sample
  std::vector<float> arrived;         // the same, 0 if something is in the way
  std::vector<float> light;           // unshadowed light of all lamps
  std::vector<std::uint8_t> state;    // LightState bits; 0 = no sample
  std::vector<std::uint8_t> near;     // those of the pixels around
  std::vector<std::uint8_t> changed;  // static layer: Change from the layer with movers
  std::vector<std::uint8_t> shade;    // to be shaded; otherwise its colour is known
  explicit Layer(std::size_t n)
      : hits(n),
        surfaces(n),
        points(n),
        weight(n),
        arrived(n),
        light(n),
        state(n),
        near(n),
        changed(n),
        shade(n, 1) {}
};

struct Renderer::Frame {
  std::vector<Eigen::Matrix3f> R;  // per row, or one
  std::vector<Vec3f> origin;
  Eigen::Matrix3f R_before_world;
  Vec3f t_before_world;
  int video_frame;
  [[nodiscard]] std::size_t row(int v) const {
    return R.size() == 1 ? 0 : static_cast<std::size_t>(v);
  }
};

}  // namespace ygslam::sim
