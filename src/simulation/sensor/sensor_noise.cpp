#include "simulation/sensor/sensor_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/parallel.hpp"
#include "core/rng.hpp"
#include "image/depth.hpp"

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

/// A well-mixed number for each of a row's counters: without a chain from one to the next, so that
/// many are made at once (the finaliser of MurmurHash3, Appleby 2011).
std::uint32_t mixed(std::uint32_t x) {
  x ^= x >> 16U;
  x *= 0x85ebca6bU;
  x ^= x >> 13U;
  x *= 0xc2b2ae35U;
  x ^= x >> 16U;
  return x;
}

/// Nearly normal, standard deviation 1: the sum of four bytes.
float bell(std::uint32_t bits) {
  const auto sum = static_cast<std::int32_t>((bits & 0xffU) + (bits >> 8U & 0xffU) +
                                             (bits >> 16U & 0xffU) + (bits >> 24U));
  constexpr float kScale = 1 / 147.8F;  // sqrt(4 (256^2 - 1) / 12)
  return static_cast<float>(sum - 510) * kScale;
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
  /// The values of an image row.
  void row(int v, std::vector<float>& out) const {
    const float b = static_cast<float>(v % kCell) / kCell;
    const float* top = values_.data() + static_cast<std::size_t>(v / kCell) * columns_;
    const float* low = top + columns_;
    const int width = static_cast<int>(out.size());
    for (int u = 0, i = 0; u < width; ++i) {
      // Interpolation lowers the variance to about (2/3)^2.
      const float left = 1.5F * ((1 - b) * top[i] + b * low[i]);
      const float right = 1.5F * ((1 - b) * top[i + 1] + b * low[i + 1]);
      for (int k = 0; k < kCell && u < width; ++k, ++u) {
        const float share = static_cast<float>(k) / kCell;
        out[static_cast<std::size_t>(u)] = (1 - share) * left + share * right;
      }
    }
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
  const auto min_m = static_cast<float>(config.min_m);
  const auto max_m = static_cast<float>(config.max_m);
  const SmoothNoise smooth(width, height, seed);
  const SmoothNoise patch(width, height, seed ^ 0x5bd1e995);
  constexpr int kRows = 8;
  parallel_for((height + kRows - 1) / kRows, threads, [&](int block) {
    const auto n = static_cast<std::size_t>(width);
    std::vector<float> nearest, common(n), patches(n), threshold(n), own(n);
    std::vector<std::uint8_t> shadow(n);
    std::vector<std::int16_t> du(n), dv(n);
    for (int v = block * kRows; v < std::min(height, (block + 1) * kRows); ++v) {
      const std::uint64_t both = row_seed(seed, v);
      mark_shadow(view.depth_m.row(v), width, fb, nearest, shadow);
      smooth.row(v, common);
      patch.row(v, patches);
      for (std::size_t u = 0; u < n; ++u) {
        const auto counter = static_cast<std::uint32_t>(3 * u);
        const auto base = static_cast<std::uint32_t>(both);
        du[u] = static_cast<std::int16_t>(nearest_int(lateral * bell(mixed(base + counter))));
        dv[u] = static_cast<std::int16_t>(nearest_int(lateral * bell(mixed(base + counter + 1))));
        own[u] = 0.75F * common[u] + 0.66F * bell(mixed(base + counter + 2));
        threshold[u] = 0.075F + 0.02F * patches[u];
      }
      for (int u = 0; u < width; ++u) {
        const auto i = static_cast<std::size_t>(u);
        const int su = std::clamp(u + du[i], 0, width - 1);
        const int sv = std::clamp(v + dv[i], 0, height - 1);
        const float depth_m = view.depth_m.at(su, sv);
        if (depth_m <= 0 || shadow[i] != 0) continue;
        const float range = depth_m / 4;
        const float signal =
            view.ir_return.at(su, sv) * view.facing.at(su, sv) / (1 + range * range);
        if (signal < threshold[i]) continue;
        const auto sigma_d =
            static_cast<float>(kinect_depth_sigma_m(depth_m)) * fb / (depth_m * depth_m);
        const float disparity = std::floor((fb / depth_m + sigma_d * own[i]) / step + 0.5F) * step;
        if (disparity <= 0) continue;
        const float measured_m = fb / disparity;
        if (measured_m >= min_m && measured_m <= max_m) noisy.at(u, v) = measured_m;
      }
    }
  });
  return noisy;
}

namespace {

/// The code values of a row as the lens delivers them: blended with a 3x3 binomial blur, the first
/// and the last row and column repeated.
class SoftRow {
 public:
  explicit SoftRow(int width) : sums_(static_cast<std::size_t>(3 * width) + 6) {}
  void read(const ColourImage& colour, int v, float blend, std::vector<float>& values) {
    const auto bytes = [&](int row) {
      return reinterpret_cast<const std::uint8_t*>(
          colour.row(std::clamp(row, 0, colour.height() - 1)));
    };
    const int n = 3 * colour.width();
    const std::uint8_t* __restrict above = bytes(v - 1);
    const std::uint8_t* __restrict here = bytes(v);
    const std::uint8_t* __restrict below = bytes(v + 1);
    std::uint16_t* __restrict sums = sums_.data() + 3;
    for (int j = 0; j < n; ++j)
      sums[j] = static_cast<std::uint16_t>(above[j] + 2 * here[j] + below[j]);
    for (int c = 0; c < 3; ++c) {
      sums_[static_cast<std::size_t>(c)] = sums[c];
      sums[n + c] = sums[n - 3 + c];
    }
    const float share = blend / 16;
    float* __restrict out = values.data();
    for (int j = 0; j < n; ++j) {
      const int nine = sums[j - 3] + 2 * sums[j] + sums[j + 3];
      out[j] = (1 - blend) * static_cast<float>(here[j]) + share * static_cast<float>(nine);
    }
  }

 private:
  std::vector<std::uint16_t> sums_;
};

/// Noise of standard deviation 1 for the three channels of each pixel, a part of it shared.
void colour_noise(std::uint64_t seed, std::vector<float>& noise) {
  const auto of_pixel = static_cast<std::uint32_t>(seed);
  const auto of_channel = static_cast<std::uint32_t>(seed >> 32U);
  const auto n = static_cast<std::uint32_t>(noise.size());
  float* __restrict out = noise.data();
  for (std::uint32_t j = 0; j < n; ++j) {
    const std::uint32_t pixel = j / 3;
    out[j] = 0.6F * bell(mixed(of_pixel + pixel)) + 0.8F * bell(mixed(of_channel + j));
  }
}

}  // namespace

ColourImage noisy_colour(const ColourImage& colour, const ColourNoiseConfig& config,
                         std::uint64_t seed, int threads) {
  const int width = colour.width();
  const int height = colour.height();
  ColourImage noisy(width, height);
  const auto blend = static_cast<float>(config.optics);
  const auto sigma = static_cast<float>(config.sigma);
  constexpr int kRows = 8;
  parallel_for((height + kRows - 1) / kRows, threads, [&](int block) {
    const int n = 3 * width;
    SoftRow soft(width);
    std::vector<float> values(static_cast<std::size_t>(n));
    std::vector<float> noise(static_cast<std::size_t>(n));
    for (int v = block * kRows; v < std::min(height, (block + 1) * kRows); ++v) {
      soft.read(colour, v, blend, values);
      colour_noise(row_seed(seed, v), noise);
      auto* __restrict out = reinterpret_cast<std::uint8_t*>(noisy.row(v));
      const float* __restrict clean = values.data();
      const float* __restrict by = noise.data();
      for (int j = 0; j < n; ++j) {
        const float code = clean[j] + sigma * (0.6F + (0.8F / 255) * clean[j]) * by[j] + 0.5F;
        const float held = code > 0 ? (code < 255 ? code : 255.0F) : 0.0F;
        out[j] = static_cast<std::uint8_t>(static_cast<std::int32_t>(held));
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
