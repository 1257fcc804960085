#include "volume/prepared_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/check.hpp"

namespace ygslam {
namespace {

constexpr int kTile = DepthPyramid::kTile_px;
constexpr auto kUnit_m = static_cast<float>(DepthView::kUnit_m);

struct JumpOf {
  NoiseModel noise;
  float sigmas, least_m;
  explicit JumpOf(const PreparationConfig& config)
      : noise(config.noise),
        sigmas(static_cast<float>(config.jump_sigmas)),
        least_m(static_cast<float>(config.jump_m)) {}
  /// How far apart [m] two depths of one surface may be.
  [[nodiscard]] float limit_m(float depth_m) const {
    return sigmas * noise.sigma_m(depth_m) + least_m;
  }
};

/// Change of depth per tile from the tiles on both sides, 0 = none; at an edge the flatter side's.
float slope_per_tile(float before, float here, float after, float limit_m) {
  const float back = here - before;
  const float forth = after - here;
  if (before <= 0 && after <= 0) return 0;
  if (before <= 0) return std::abs(forth) < limit_m ? forth : 0;
  if (after <= 0) return std::abs(back) < limit_m ? back : 0;
  if (std::abs(forth - back) < limit_m) return 0.5F * (forth + back);
  return std::abs(forth) < std::abs(back) ? forth : back;
}

/// Words of a row's pixels. In 32 bit words and without branches, so that compilers take several
/// pixels at once.
class WeighRow {
 public:
  explicit WeighRow(const PreparationConfig& config)
      : jump_(config),
        max_depth_m_(static_cast<float>(config.max_depth_m)),
        min_cos_(static_cast<float>(config.min_cos_incidence)),
        pose_variance_(static_cast<float>(config.pose_sigma_m * config.pose_sigma_m)) {
    const float near_sigma_m = jump_.noise.sigma_m(1.0F);
    scale_ = PreparedView::kMaxWeight * (near_sigma_m * near_sigma_m + pose_variance_);
  }

  struct Depths {  // [m], 0 = none; of one pixel more on either side
    const float *above, *here, *below;
  };
  void step(const Depths& depths, const float* slope, const float* cosine,
            const std::uint16_t* depth, const std::uint8_t* object, int width,
            std::uint32_t* __restrict words) const {
    for (int u = 0; u < width; ++u) {
      const float z = depths.here[u];
      const float limit_m = jump_.limit_m(z);
      const std::uint32_t edge =
          jumps(z, depths.here[u - 1], limit_m) | jumps(z, depths.here[u + 1], limit_m) |
          jumps(z, depths.above[u], limit_m) | jumps(z, depths.below[u], limit_m);
      const std::uint32_t counts = bit(z > 0) & bit(z <= max_depth_m_) & (edge ^ 1U) &
                                   bit(cosine[u] >= min_cos_) &
                                   bit(object[u] != DepthView::kExcluded);
      const float sigma_m = jump_.noise.sigma_m(z);
      const float weight =
          scale_ * cosine[u] * cosine[u] / (sigma_m * sigma_m + pose_variance_) + 0.5F;
      const auto bounded = static_cast<std::uint32_t>(static_cast<int>(
          std::min(std::max(weight, 1.0F), static_cast<float>(PreparedView::kMaxWeight))));
      const auto steps = static_cast<std::uint32_t>(
          static_cast<int>(std::min(slope[u] / PreparedView::kSlopeUnit + 0.5F, 255.0F)));
      words[u] = depth[u] | (steps << 16) | ((bounded & (0U - counts)) << 24);
    }
  }

 private:
  static std::uint32_t bit(bool is) { return is ? 1U : 0U; }
  static std::uint32_t jumps(float z, float other, float limit_m) {
    return bit(other > 0) & bit(std::abs(other - z) > limit_m);
  }

  JumpOf jump_;
  float max_depth_m_, min_cos_, pose_variance_, scale_;
};

void join_appearance(const Rgb8* colour, const std::uint8_t* object, int width,
                     std::uint32_t* __restrict words) {
  for (int u = 0; u < width; ++u)
    words[u] = colour[u].r | (static_cast<std::uint32_t>(colour[u].g) << 8) |
               (static_cast<std::uint32_t>(colour[u].b) << 16) |
               (static_cast<std::uint32_t>(object[u]) << 24);
}

}  // namespace

void PreparedView::assign(const DepthView& view, const PreparationConfig& config,
                          const PreparedView* of_same_depth) {
  CHECK(view.depth.width() == view.camera.width && view.depth.height() == view.camera.height);
  CHECK(view.colour.same_size(view.depth) && view.object.same_size(view.depth));
  camera_ = view.camera;
  spared_ = view.spared;
  objects_ = view.objects;
  objects_.resize(DepthView::kUnsure, kNoSceneObject);
  objects_.back() = kUnsureObject;
  if (of_same_depth != nullptr) {
    tiles_ = of_same_depth->tiles_;
  } else {
    find_tile_depths(view, config);
    find_tile_slopes(config);
  }
  weigh_pixels(view, config);
  find_surface_tiles(config);
}

void PreparedView::find_tile_depths(const DepthView& view, const PreparationConfig& config) {
  const int width = camera_.width;
  tiles_.columns = (width + kTile - 1) / kTile;
  tiles_.rows = (camera_.height + kTile - 1) / kTile;
  const auto tiles =
      static_cast<std::size_t>(tiles_.columns) * static_cast<std::size_t>(tiles_.rows);
  tiles_.nearest_depth.resize(tiles);
  tiles_.depth_m.resize(tiles);
  const JumpOf jump(config);
  const auto padded = static_cast<std::size_t>(tiles_.columns) * kTile;
  std::vector<std::uint16_t> nearest(padded), limit(padded), count(padded);
  std::vector<std::uint32_t> sum(padded);
  tiles_.field_columns = (tiles_.columns + kFieldTiles - 1) / kFieldTiles;
  tiles_.field_rows = (tiles_.rows + kFieldTiles - 1) / kFieldTiles;
  tiles_.field_farthest_m.assign(static_cast<std::size_t>(tiles_.field_columns * tiles_.field_rows),
                                 0);
  std::vector<std::uint16_t> farthest(padded);
  for (int row = 0; row < tiles_.rows; ++row) {
    std::fill(farthest.begin(), farthest.end(), std::uint16_t{0});
    const int v0 = row * kTile;
    const int v1 = std::min(v0 + kTile, camera_.height);
    // One less than the depth, so that none is the farthest.
    std::fill(nearest.begin(), nearest.end(), DepthPyramid::kNone);
    for (int v = v0; v < v1; ++v) {
      const std::uint16_t* depth = view.depth.row(v);
      for (int u = 0; u < width; ++u) {
        const auto i = static_cast<std::size_t>(u);
        nearest[i] = std::min(nearest[i], static_cast<std::uint16_t>(depth[u] - 1));
        farthest[i] = std::max(farthest[i], depth[u]);
      }
    }
    for (std::size_t column = 0; column < static_cast<std::size_t>(tiles_.columns); ++column) {
      const auto first = nearest.begin() + static_cast<std::ptrdiff_t>(column * kTile);
      const std::uint16_t least = *std::min_element(first, first + kTile);
      const bool none = least == DepthPyramid::kNone;
      const auto depth = static_cast<std::uint16_t>(none ? DepthPyramid::kNone : least + 1);
      tiles_.nearest_depth[static_cast<std::size_t>(row * tiles_.columns) + column] = depth;
      const float reach = none ? 0 : depth + jump.limit_m(depth * kUnit_m) / kUnit_m;
      const auto last = static_cast<std::uint16_t>(std::min(reach, 65534.0F));
      std::fill_n(limit.begin() + static_cast<std::ptrdiff_t>(column * kTile), kTile, last);
    }
    for (int field = 0; field < tiles_.field_columns; ++field) {
      const int first = field * kFieldTiles * kTile;
      const int last = std::min(first + kFieldTiles * kTile, tiles_.columns * kTile);
      const std::uint16_t most =
          *std::max_element(farthest.begin() + first, farthest.begin() + last);
      float& most_m = tiles_.field_farthest_m[static_cast<std::size_t>(
          row / kFieldTiles * tiles_.field_columns + field)];
      most_m = std::max(most_m, static_cast<float>(most) * kUnit_m);
    }
    std::fill(sum.begin(), sum.end(), 0U);
    std::fill(count.begin(), count.end(), std::uint16_t{0});
    for (int v = v0; v < v1; ++v) {
      const std::uint16_t* depth = view.depth.row(v);
      for (int u = 0; u < width; ++u) {
        const auto i = static_cast<std::size_t>(u);
        const bool counts = (depth[u] != 0) & (depth[u] <= limit[i]);
        sum[i] += counts ? depth[u] : 0U;
        count[i] = static_cast<std::uint16_t>(count[i] + (counts ? 1 : 0));
      }
    }
    for (std::size_t column = 0; column < static_cast<std::size_t>(tiles_.columns); ++column) {
      std::uint32_t total = 0, n = 0;
      for (std::size_t i = column * kTile; i < (column + 1) * kTile; ++i) {
        total += sum[i];
        n += count[i];
      }
      tiles_.depth_m[static_cast<std::size_t>(row * tiles_.columns) + column] =
          n == 0 ? 0 : static_cast<float>(total) / static_cast<float>(n) * kUnit_m;
    }
  }
  tiles_.farthest_m =
      std::min(*std::max_element(tiles_.field_farthest_m.begin(), tiles_.field_farthest_m.end()),
               static_cast<float>(config.max_depth_m));
  tiles_.nearest.assign(tiles_.columns, tiles_.rows, tiles_.nearest_depth);
}

float PreparedView::farthest_m(const Vec2& low_px, const Vec2& high_px) const {
  constexpr double kField_px = kFieldTiles * kTile;
  const auto field = [](double px, int count) {
    return static_cast<int>(std::clamp((px + 0.5) / kField_px, 0.0, count - 1.0));
  };
  float farthest_m = 0;
  const int last_column = field(high_px.x(), tiles_.field_columns);
  const int last_row = field(high_px.y(), tiles_.field_rows);
  for (int row = field(low_px.y(), tiles_.field_rows); row <= last_row; ++row)
    for (int column = field(low_px.x(), tiles_.field_columns); column <= last_column; ++column)
      farthest_m = std::max(
          farthest_m,
          tiles_.field_farthest_m[static_cast<std::size_t>(row * tiles_.field_columns + column)]);
  return farthest_m;
}

void PreparedView::find_tile_slopes(const PreparationConfig& config) {
  const JumpOf jump(config);
  tiles_.slope.assign(tiles_.depth_m.size(), 0);
  tiles_.cos.assign(tiles_.depth_m.size(), 0);
  tiles_.normals.assign(tiles_.depth_m.size(), Eigen::Vector3f(0, 0, -1));
  const auto fx = static_cast<float>(camera_.fx) / kTile;
  const auto fy = static_cast<float>(camera_.fy) / kTile;
  constexpr float kMiddle_px = 0.5F * (kTile - 1);
  for (int row = 0; row < tiles_.rows; ++row) {
    const float y =
        (static_cast<float>(row * kTile) + kMiddle_px - static_cast<float>(camera_.cy)) /
        static_cast<float>(camera_.fy);
    for (int column = 0; column < tiles_.columns; ++column) {
      const auto i = static_cast<std::size_t>(row * tiles_.columns + column);
      const auto at = [&](int c, int r) {
        return c < 0 || r < 0 || c >= tiles_.columns || r >= tiles_.rows
                   ? 0
                   : tiles_.depth_m[static_cast<std::size_t>(r * tiles_.columns + c)];
      };
      const float z = tiles_.depth_m[i];
      if (z <= 0) continue;
      const float x =
          (static_cast<float>(column * kTile) + kMiddle_px - static_cast<float>(camera_.cx)) /
          static_cast<float>(camera_.fx);
      const float limit_m = jump.limit_m(z);
      const float z_u = fx * slope_per_tile(at(column - 1, row), z, at(column + 1, row), limit_m);
      const float z_v = fy * slope_per_tile(at(column, row - 1), z, at(column, row + 1), limit_m);
      // The plane's tangents are z_u r + z e_x and z_v r + z e_y, r the ray: this is their cross
      // product, whose product with r is z.
      const Eigen::Vector3f across(-z_u, -z_v, z + x * z_u + y * z_v);
      const float slope = z / across.norm();
      tiles_.slope[i] = slope;
      tiles_.cos[i] = slope / std::sqrt(x * x + y * y + 1);
      tiles_.normals[i] = -across.normalized();
    }
  }
}

void PreparedView::weigh_pixels(const DepthView& view, const PreparationConfig& config) {
  const WeighRow weigh(config);
  const int width = camera_.width;
  const int height = camera_.height;
  geometry_.resize(view.depth.size());
  appearance_.resize(view.depth.size());

  // Three rows of depths [m] with a border of none, so that neighbours need no case of their own.
  const auto padded = static_cast<std::size_t>(width) + 2;
  std::array<std::vector<float>, 3> depths;
  for (auto& row : depths) row.assign(padded, 0);
  const auto load = [&](int v, std::vector<float>& row) {
    if (v >= height) {
      std::fill(row.begin(), row.end(), 0.0F);
      return;
    }
    const std::uint16_t* from = view.depth.row(v);
    for (int u = 0; u < width; ++u) row[static_cast<std::size_t>(u) + 1] = from[u] * kUnit_m;
  };
  const auto tiled = static_cast<std::size_t>(tiles_.columns) * kTile;
  std::vector<float> slope(tiled), cosine(tiled);
  load(0, depths[1]);
  for (int v = 0; v < height; ++v) {
    const float* above = depths[static_cast<std::size_t>(v % 3)].data() + 1;
    const float* here = depths[static_cast<std::size_t>((v + 1) % 3)].data() + 1;
    load(v + 1, depths[static_cast<std::size_t>((v + 2) % 3)]);
    const float* below = depths[static_cast<std::size_t>((v + 2) % 3)].data() + 1;
    if (v % kTile == 0) {
      const std::size_t first = static_cast<std::size_t>(v / kTile * tiles_.columns);
      for (std::size_t i = 0; i < tiled; ++i) {
        slope[i] = tiles_.slope[first + i / kTile];
        cosine[i] = tiles_.cos[first + i / kTile];
      }
    }
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(v) * width;
    weigh.step({above, here, below}, slope.data(), cosine.data(), view.depth.row(v),
               view.object.row(v), width, geometry_.data() + first);
    join_appearance(view.colour.row(v), view.object.row(v), width, appearance_.data() + first);
  }
}

void PreparedView::find_surface_tiles(const PreparationConfig& config) {
  constexpr float kMiddle_px = 0.5F * (kTile - 1);
  surface_tiles_.clear();
  const auto width = static_cast<std::size_t>(camera_.width);
  constexpr int kNever = 0xffff;
  std::vector<int> low(static_cast<std::size_t>(tiles_.columns) * kTile), high(low.size());
  const JumpOf jump(config);
  for (int row = 0; row < tiles_.rows; ++row) {
    std::fill(low.begin(), low.end(), kNever);
    std::fill(high.begin(), high.end(), 0);
    const int v1 = std::min((row + 1) * kTile, camera_.height);
    for (int v = row * kTile; v < v1; ++v) {
      const std::uint32_t* geometry = geometry_.data() + static_cast<std::size_t>(v) * width;
      for (std::size_t u = 0; u < width; ++u) {
        const int depth = static_cast<int>(geometry[u] & 0xffffU);
        const bool counts = static_cast<int>(geometry[u]) >= 1 << 24;
        low[u] = std::min(low[u], counts ? depth : kNever);
        high[u] = std::max(high[u], counts ? depth : 0);
      }
    }
    for (int column = 0; column < tiles_.columns; ++column) {
      const int* l = low.data() + column * kTile;
      const int* h = high.data() + column * kTile;
      static_assert(kTile == 4);
      const int nearest = std::min(std::min(l[0], l[1]), std::min(l[2], l[3]));
      const int farthest = std::max(std::max(h[0], h[1]), std::max(h[2], h[3]));
      if (farthest == 0) continue;
      SurfaceTile tile;
      tile.middle_px = {static_cast<float>(column * kTile) + kMiddle_px,
                        static_cast<float>(row * kTile) + kMiddle_px};
      tile.normal_camera = tiles_.normals[static_cast<std::size_t>(row * tiles_.columns + column)];
      tile.near_m = static_cast<float>(nearest) * kUnit_m;
      tile.far_m = static_cast<float>(farthest) * kUnit_m;
      // Noise alone spreads a tile's depths by more than the limit between two neighbours.
      const float gap_m = 2 * jump.limit_m(tile.far_m);
      if (tile.far_m - tile.near_m > gap_m)
        add_parts(tile, column * kTile, row * kTile, gap_m);
      else
        surface_tiles_.push_back(tile);
    }
  }
}

void PreparedView::add_parts(SurfaceTile tile, int u0, int v0, float gap_m) {
  std::array<float, kTile * kTile> depths_m{};
  std::size_t count = 0;
  for (int v = v0; v < std::min(v0 + kTile, camera_.height); ++v) {
    for (int u = u0; u < std::min(u0 + kTile, camera_.width); ++u) {
      const std::uint32_t geometry = geometry_[static_cast<std::size_t>(v * camera_.width + u)];
      if (geometry >> 24 != 0) depths_m[count++] = static_cast<float>(geometry & 0xffffU) * kUnit_m;
    }
  }
  std::sort(depths_m.begin(), depths_m.begin() + static_cast<std::ptrdiff_t>(count));
  tile.near_m = depths_m[0];
  for (std::size_t i = 1; i <= count; ++i) {
    if (i < count && depths_m[i] - depths_m[i - 1] <= gap_m) continue;
    tile.far_m = depths_m[i - 1];
    surface_tiles_.push_back(tile);
    if (i < count) tile.near_m = depths_m[i];
  }
}

}  // namespace ygslam
