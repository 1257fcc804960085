#include "simulation/sensor_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/rng.hpp"
#include "image/depth.hpp"
#include "simulation/parallel.hpp"

namespace ygslam::sim {

namespace {

constexpr int kTableBits = 12;
constexpr std::size_t kTableSize = 1U << kTableBits;

/// Standard normal draws by table look-up: five to a random number.
class NormalTable {
 public:
  NormalTable() {
    Rng rng(20231);
    for (float& value : table_) value = static_cast<float>(rng.normal());
  }
  [[nodiscard]] float operator[](std::uint64_t bits) const {
    return table_[bits & (kTableSize - 1)];
  }

 private:
  std::array<float, kTableSize> table_{};
};

const NormalTable& normals() {
  static const NormalTable table;
  return table;
}

/// Without the library call of std::lround.
int nearest_int(float x) { return static_cast<int>(std::floor(x + 0.5F)); }

/// Hashed, for neighbouring seeds of the generator give the same numbers one step apart.
std::uint64_t row_seed(std::uint64_t seed, int row) {
  return Rng(seed ^ (static_cast<std::uint64_t>(row) * 0xd1342543de82ef95ULL)).next();
}

/// A normal value for a lattice cell: equal for all pixels of the cell.
float cell_normal(std::uint64_t seed, int i, int j) {
  Rng rng(seed ^ (static_cast<std::uint64_t>(i) * 0xd6e8feb86659fd93ULL +
                  static_cast<std::uint64_t>(j) * 0xa0761d6478bd642fULL));
  return normals()[rng.next() >> 20];
}

/// Smooth noise with cells of kCell pixels, variance about 1.
class SmoothNoise {
 public:
  static constexpr int kCell = 6;
  SmoothNoise(int width, int height, std::uint64_t seed)
      : columns_(width / kCell + 2),
        values_(static_cast<std::size_t>(columns_) * (height / kCell + 2)) {
    for (std::size_t i = 0; i < values_.size(); ++i) {
      values_[i] =
          cell_normal(seed, static_cast<int>(i) % columns_, static_cast<int>(i) / columns_);
    }
  }
  [[nodiscard]] float at(int u, int v) const {
    const int i = u / kCell;
    const int j = v / kCell;
    const float a = static_cast<float>(u % kCell) / kCell;
    const float b = static_cast<float>(v % kCell) / kCell;
    const float* top = values_.data() + static_cast<std::size_t>(j) * columns_ + i;
    const float* low = top + columns_;
    // Interpolation lowers the variance to about (2/3)^2.
    return 1.5F * ((1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * low[0] + a * low[1]));
  }

 private:
  int columns_;
  std::vector<float> values_;
};

/// Marks where the projector does not reach because something nearer is in its way.
void mark_shadow(const float* depth_m, int width, float focal_times_baseline,
                 std::vector<float>& nearest, std::vector<std::uint8_t>& shadow) {
  constexpr int kMargin = 160;
  nearest.assign(static_cast<std::size_t>(width) + kMargin + 2,
                 std::numeric_limits<float>::infinity());
  const auto column = [&](int u) {
    const float shift = std::min(static_cast<float>(kMargin), focal_times_baseline / depth_m[u]);
    return static_cast<std::size_t>(static_cast<float>(u + kMargin) - shift + 0.5F);
  };
  for (int u = 0; u < width; ++u) {
    if (depth_m[u] <= 0) continue;
    const std::size_t c = column(u);
    nearest[c] = std::min(nearest[c], depth_m[u]);
    nearest[c + 1] = std::min(nearest[c + 1], depth_m[u]);
  }
  for (int u = 0; u < width; ++u) {
    shadow[u] = depth_m[u] > 0 && nearest[column(u)] < 0.94F * depth_m[u] ? 1 : 0;
  }
}

}  // namespace

DepthImage kinect_depth(const View& view, const Camera& camera, const DepthNoiseConfig& config,
                        std::uint64_t seed, int threads) {
  const int width = view.depth_m.width();
  const int height = view.depth_m.height();
  DepthImage noisy(width, height);
  const auto fb = static_cast<float>(camera.fx() * config.baseline_m);
  // Disparity is quantised by the sensor's own pixels, whatever the size of the output.
  const auto step = static_cast<float>(config.disparity_step_px * camera.fx() / 535.4);
  const auto lateral = static_cast<float>(config.lateral_sigma_px);
  const SmoothNoise smooth(width, height, seed);
  const SmoothNoise patch(width, height, seed ^ 0x5bd1e995);
  const NormalTable& normal = normals();
  parallel_for(height, threads, [&](int v) {
    Rng rng(row_seed(seed, v));
    std::vector<float> nearest;
    std::vector<std::uint8_t> shadow(static_cast<std::size_t>(width));
    mark_shadow(view.depth_m.row(v), width, fb, nearest, shadow);
    for (int u = 0; u < width; ++u) {
      const std::uint64_t bits = rng.next();
      const int du = nearest_int(lateral * normal[bits]);
      const int dv = nearest_int(lateral * normal[bits >> 12U]);
      const int su = std::clamp(u + du, 0, width - 1);
      const int sv = std::clamp(v + dv, 0, height - 1);
      const float depth_m = view.depth_m.at(su, sv);
      if (depth_m <= 0 || shadow[u] != 0) continue;
      const float range = depth_m / 4;
      const float signal = view.ir_return.at(su, sv) * view.facing.at(su, sv) / (1 + range * range);
      if (signal < 0.075F + 0.02F * patch.at(u, v)) continue;
      const auto sigma_d =
          static_cast<float>(kinect_depth_sigma_m(depth_m)) * fb / (depth_m * depth_m);
      const float noise = 0.75F * smooth.at(u, v) + 0.66F * normal[bits >> 24U];
      const float disparity = std::floor((fb / depth_m + sigma_d * noise) / step + 0.5F) * step;
      if (disparity <= 0) continue;
      const float measured_m = fb / disparity;
      if (measured_m >= config.min_m && measured_m <= config.max_m) noisy.at(u, v) = measured_m;
    }
  });
  return noisy;
}

ColourImage noisy_colour(const ColourImage& colour, const ColourNoiseConfig& config,
                         std::uint64_t seed, int threads) {
  const int width = colour.width();
  const int height = colour.height();
  ColourImage noisy(width, height);
  const auto blend = static_cast<float>(config.optics);
  const auto sigma = static_cast<float>(config.sigma);
  const NormalTable& normal = normals();
  const auto bytes = [&](int v) {
    return reinterpret_cast<const std::uint8_t*>(colour.row(std::clamp(v, 0, height - 1)));
  };
  parallel_for(height, threads, [&](int v) {
    Rng rng(row_seed(seed, v));
    const std::uint8_t* above = bytes(v - 1);
    const std::uint8_t* here = bytes(v);
    const std::uint8_t* below = bytes(v + 1);
    // Sums down the columns, with the first and the last pixel repeated.
    std::vector<std::uint16_t> column(3 * static_cast<std::size_t>(width + 2));
    std::uint16_t* sums = column.data() + 3;
    for (int j = 0; j < 3 * width; ++j)
      sums[j] = static_cast<std::uint16_t>(above[j] + 2 * here[j] + below[j]);
    for (int c = 0; c < 3; ++c) {
      column[c] = sums[c];
      sums[3 * width + c] = sums[3 * (width - 1) + c];
    }
    auto* out = reinterpret_cast<std::uint8_t*>(noisy.row(v));
    for (int u = 0; u < width; ++u) {
      std::uint64_t bits = rng.next();
      const float common = 0.6F * normal[bits >> 36U];
      for (int j = 3 * u; j < 3 * u + 3; ++j, bits >>= 12U) {
        const float soft = static_cast<float>(sums[j - 3] + 2 * sums[j] + sums[j + 3]) / 16;
        const float value = (1 - blend) * static_cast<float>(here[j]) + blend * soft;
        const float own = common + 0.8F * normal[bits];
        const float k = sigma * (0.6F + 0.8F * value / 255);
        out[j] = static_cast<std::uint8_t>(std::clamp(value + k * own + 0.5F, 0.0F, 255.0F));
      }
    }
  });
  return noisy;
}

ColourImage motion_blurred(const ColourImage& colour, const Image<Eigen::Vector2f>& flow_px,
                           double share, int threads) {
  const int width = colour.width();
  const int height = colour.height();
  ColourImage blurred(width, height);
  parallel_for(height, threads, [&](int v) {
    for (int u = 0; u < width; ++u) {
      const Eigen::Vector2f path = static_cast<float>(share) * flow_px.at(u, v);
      const float length = path.norm();
      if (length < 0.7F) {
        blurred.at(u, v) = colour.at(u, v);
        continue;
      }
      const int taps = std::clamp(static_cast<int>(length + 1.5F), 2, 15);
      int r = 0, g = 0, b = 0;
      for (int k = 0; k < taps; ++k) {
        const float s = (static_cast<float>(k) + 0.5F) / static_cast<float>(taps) - 0.5F;
        const int x = std::clamp(nearest_int(static_cast<float>(u) + s * path.x()), 0, width - 1);
        const int y = std::clamp(nearest_int(static_cast<float>(v) + s * path.y()), 0, height - 1);
        const Rgb8& p = colour.at(x, y);
        r += p.r;
        g += p.g;
        b += p.b;
      }
      const auto mean = [&](int sum) { return static_cast<std::uint8_t>((sum + taps / 2) / taps); };
      blurred.at(u, v) = {mean(r), mean(g), mean(b)};
    }
  });
  return blurred;
}

}  // namespace ygslam::sim
