#include "features/scale_space.hpp"

#include <array>
#include <cmath>
#include <vector>

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#endif

namespace ygslam {

namespace {

constexpr int kWeightBits = 6;
constexpr int kWeightOne = 1 << kWeightBits;

struct Tap {
  int index;
  int weight;  // of index + 1, in 1/64
};

Tap tap(int target, double ratio) {
  const double at = target * ratio;
  const int index = static_cast<int>(at);
  return {index, static_cast<int>(std::lround((at - index) * kWeightOne))};
}

std::uint8_t mix(int first, int second, int weight) {
  return static_cast<std::uint8_t>(
      (first * (kWeightOne - weight) + second * weight + kWeightOne / 2) >> kWeightBits);
}

// Resamples rows; eight pixels at a time where the processor can: their sixteen sources lie within
// sixteen bytes, because the ratio is at most 2.
class RowReducer {
 public:
  RowReducer(int width, double ratio) {
    for (int u = 0; u < width; ++u) taps_.push_back(tap(u, ratio));
    for (int u = 0; u + 8 <= width; u += 8) {
      Block block{taps_[u].index, {}, {}};
      for (int i = 0; i < 8; ++i) {
        const Tap& t = taps_[u + i];
        block.order[2 * i] = static_cast<std::uint8_t>(t.index - block.first);
        block.order[2 * i + 1] = static_cast<std::uint8_t>(t.index - block.first + 1);
        block.weights[2 * i] = static_cast<std::int8_t>(kWeightOne - t.weight);
        block.weights[2 * i + 1] = static_cast<std::int8_t>(t.weight);
      }
      blocks_.push_back(block);
    }
  }
  [[nodiscard]] int source_width() const { return taps_.back().index + 2; }

  // Reads up to 16 bytes beyond the row.
  void operator()(const std::uint8_t* row, std::uint8_t* out) const {
    std::size_t u = 0;
#if defined(__AVX2__)
    const __m128i half = _mm_set1_epi16(kWeightOne / 2);
    for (const Block& b : blocks_) {
      const __m128i source = _mm_loadu_si128(reinterpret_cast<const __m128i*>(row + b.first));
      const __m128i pairs =
          _mm_shuffle_epi8(source, _mm_load_si128(reinterpret_cast<const __m128i*>(b.order)));
      const __m128i sum =
          _mm_maddubs_epi16(pairs, _mm_load_si128(reinterpret_cast<const __m128i*>(b.weights)));
      const __m128i pixels = _mm_srli_epi16(_mm_add_epi16(sum, half), kWeightBits);
      _mm_storel_epi64(reinterpret_cast<__m128i*>(out + u), _mm_packus_epi16(pixels, pixels));
      u += 8;
    }
#elif defined(__ARM_NEON)
    for (const Block& b : blocks_) {
      const uint8x16_t pairs = vqtbl1q_u8(vld1q_u8(row + b.first), vld1q_u8(b.order));
      const uint8x16_t weights = vreinterpretq_u8_s8(vld1q_s8(b.weights));
      const uint16x8_t low = vmull_u8(vget_low_u8(pairs), vget_low_u8(weights));
      const uint16x8_t sum = vpaddq_u16(low, vmull_high_u8(pairs, weights));
      vst1_u8(out + u, vrshrn_n_u16(sum, kWeightBits));
      u += 8;
    }
#endif
    for (; u < taps_.size(); ++u) {
      const Tap& t = taps_[u];
      out[u] = mix(row[t.index], row[t.index + 1], t.weight);
    }
  }

 private:
  struct Block {
    int first;
    alignas(16) std::uint8_t order[16];
    alignas(16) std::int8_t weights[16];
  };
  std::vector<Tap> taps_;
  std::vector<Block> blocks_;
};

// 18 33 49 56 49 33 18: sigma 2, sum 256, so that all sums fit 16 bits.
void weighted_sum(const std::array<const std::uint8_t*, 7>& p, int count,
                  std::uint8_t* __restrict out) {
  const auto word = [](int x) { return static_cast<std::uint16_t>(x); };
  for (int u = 0; u < count; ++u) {
    const std::uint16_t centre = word(56 * p[3][u] + 128);
    const std::uint16_t near = word(49 * word(p[2][u] + p[4][u]));
    const std::uint16_t middle = word(33 * word(p[1][u] + p[5][u]));
    const std::uint16_t far = word(18 * word(p[0][u] + p[6][u]));
    out[u] = static_cast<std::uint8_t>(word(word(centre + near) + word(middle + far)) >> 8);
  }
}

// The blurred image is made this far beyond the image, for patches that reach across its border.
constexpr int kReach = 8;

}  // namespace

void reduce(const PaddedImage& source, double ratio, int width, int height, PaddedImage& target) {
  target.resize(width, height, source.border_px());
  const RowReducer reduce_row(width, ratio);
  const int source_width = reduce_row.source_width();
  std::vector<std::uint8_t> mixed(static_cast<std::size_t>(source_width) + 16);
  for (int v = 0; v < height; ++v) {
    const Tap vertical = tap(v, ratio);
    const std::uint8_t* const above = source.row(vertical.index);
    const std::uint8_t* const below = source.row(vertical.index + 1);
    const int weight = vertical.weight;
    std::uint8_t* const out = mixed.data();
    for (int u = 0; u < source_width; ++u) out[u] = mix(above[u], below[u], weight);
    reduce_row(mixed.data(), target.row(v));
  }
  target.mirror_border();
}

void blur_7x7(const PaddedImage& source, PaddedImage& target) {
  target.resize(source.width(), source.height(), source.border_px());
  const int begin = -kReach;
  const int count = source.width() + 2 * kReach;
  std::vector<std::uint8_t> columns(static_cast<std::size_t>(count) + 6);
  for (int v = -kReach; v < source.height() + kReach; ++v) {
    std::array<const std::uint8_t*, 7> rows{};
    for (int i = 0; i < 7; ++i) rows[i] = source.row(v - 3 + i) + begin - 3;
    weighted_sum(rows, count + 6, columns.data());
    for (int i = 0; i < 7; ++i) rows[i] = columns.data() + i;
    weighted_sum(rows, count, target.row(v) + begin);
  }
}

}  // namespace ygslam
