// What the passes of the renderer hand to each other. For the renderer*.cpp files.
#pragma once

#include <cstring>
#include <vector>

#include "simulation/render/renderer.hpp"

namespace ygslam::sim {

inline constexpr float kReach_m = 150;  ///< nothing is seen farther away
inline constexpr int kTile = 4;         ///< pixels whose rays travel together: kTile x kTile
static_assert(kTile * kTile == kLanes);
inline constexpr int kBlock = 16;  ///< pixels whose light samples travel together, a side
static_assert(kBlock == kLanes);   // and a row of a block is shaded at once

/// Where in a 4x4 tile of pixels each of the 16 light samples is taken (u + 4 v), so that any part
/// of the tile holds well-spread samples, and the first half of them is a chessboard.
inline constexpr int kPlace[kLanes] = {0, 10, 2, 8, 5, 15, 7, 13, 1, 11, 3, 9, 4, 14, 6, 12};

/// What became of the light sample of a pixel.
enum LightState : std::uint8_t {
  kFixedLets = 1,    ///< the fixed scene lets it through
  kFixedBlocks = 2,  ///< or not
  kMoversLet = 4,    ///< the movers let it through
  kMoversBlock = 8,  ///< or not
};

/// One value per pixel, with a margin on all sides and whole blocks, so that nobody who looks at
/// neighbours has to ask whether they exist.
template <typename T>
class Plane {
 public:
  static constexpr int kMargin = kLanes;
  static constexpr int kMarginRows = 2;
  Plane(int width, int height, T fill)
      : stride_((width + kBlock - 1) / kBlock * kBlock + 2 * kMargin),
        values_(static_cast<std::size_t>(stride_) *
                    ((height + kBlock - 1) / kBlock * kBlock + 2 * kMarginRows),
                fill) {}
  [[nodiscard]] T* row(int v) {
    return values_.data() + static_cast<std::ptrdiff_t>(v + kMarginRows) * stride_ + kMargin;
  }
  [[nodiscard]] const T* row(int v) const {
    return values_.data() + static_cast<std::ptrdiff_t>(v + kMarginRows) * stride_ + kMargin;
  }

 private:
  std::ptrdiff_t stride_;
  std::vector<T> values_;
};

/// What is seen by 16 rays, and the lamps' light on it.
struct Renderer::Seen {
  Hits16 hits;
  Surfaces16 surfaces;
  Vectors16 point;
  Floats16 light;   // unshadowed, of all lamps
  Floats16 weight;  // unshadowed, of the lane's own light sample
  Ints16 zone;
};

/// A layer of the picture, a plane for each of its quantities.
struct Renderer::Layer {
  Plane<std::int32_t> object, triangle, material, zone;
  Plane<float> distance, nx, ny, nz, px, py, pz, u, v;
  Plane<float> light;                       // unshadowed light of all lamps
  Plane<float> weight;                      // unshadowed light of this pixel's sample
  Plane<float> arrived;                     // the same, 0 if something is in the way
  Plane<std::uint8_t> state_first;          // LightState bits of the first half of the samples
  Plane<std::uint8_t> state;                // of all; 0 = no light to ask for
  Plane<std::uint8_t> changed;              // static layer: other than the layer with movers
  std::vector<std::uint8_t> segment_mover;  // per row of a block: a smoothing ray met a mover
  std::vector<std::uint8_t> block_mover;    // per block: a mover, or its shadow
  Layer(int w, int h)
      : object(w, h, Hits16::kNothing),
        triangle(w, h, 0),
        material(w, h, 0),
        zone(w, h, 0),
        distance(w, h, 0),
        nx(w, h, 0),
        ny(w, h, 0),
        nz(w, h, 0),
        px(w, h, 0),
        py(w, h, 0),
        pz(w, h, 0),
        u(w, h, 0),
        v(w, h, 0),
        light(w, h, 0),
        weight(w, h, 0),
        arrived(w, h, 0),
        state_first(w, h, 0),
        state(w, h, 0),
        changed(w, h, 0) {
    const auto columns = static_cast<std::size_t>((w + kBlock - 1) / kBlock);
    const auto rows = static_cast<std::size_t>((h + kBlock - 1) / kBlock);
    segment_mover.assign(columns * rows * kBlock, 0);
    block_mover.assign(columns * rows, 0);
  }
};

struct Renderer::Frame {
  std::vector<Eigen::Matrix3f> R;  // per row, or one
  std::vector<Vec3f> origin;
  Eigen::Matrix3f R_before_world;
  Vec3f t_before_world;
  int video_frame;
  View* view;
  [[nodiscard]] std::size_t row(int v) const {
    return R.size() == 1 ? 0 : static_cast<std::size_t>(v);
  }
};

/// The bits of a pixel and of all within two pixels of it, for a row of a block.
struct BitsAround {
  std::uint8_t bits[kBlock];
  BitsAround(const Plane<std::uint8_t>& plane, int u0, int row) {
    // 20 columns from u0 - 2 on, eight at a time.
    std::uint64_t column[3] = {0, 0, 0};
    for (int v = row - 2; v <= row + 2; ++v) {
      std::uint64_t words[3];
      std::memcpy(words, plane.row(v) + u0 - 2, sizeof(words));
      for (int j = 0; j < 3; ++j) column[j] |= words[j];
    }
    std::uint8_t bytes[sizeof(column)];
    std::memcpy(bytes, column, sizeof(column));
    for (int k = 0; k < kBlock; ++k) {
      bits[k] = static_cast<std::uint8_t>(bytes[k] | bytes[k + 1] | bytes[k + 2] | bytes[k + 3] |
                                          bytes[k + 4]);
    }
  }
  [[nodiscard]] bool any(std::uint8_t mask) const {
    std::uint8_t all = 0;
    for (const std::uint8_t b : bits) all = static_cast<std::uint8_t>(all | b);
    return (all & mask) != 0;
  }
};

}  // namespace ygslam::sim
