#include "motion/flow/image_pyramid.hpp"

#include <algorithm>
#include <array>
#include <utility>

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#endif

#include "motion/flow/flow_patch.hpp"
#include "motion/flow/image_pyramid_levels.hpp"

namespace ygslam {
namespace {

/// 1 4 6 4 1 down the columns; sums in 1/16.
void sum_columns(const std::array<const std::uint8_t*, 5>& rows, int count,
                 std::uint16_t* __restrict sums) {
  const auto word = [](int x) { return static_cast<std::uint16_t>(x); };
  for (int u = 0; u < count; ++u) {
    const std::uint16_t outer = word(rows[0][u] + rows[4][u]);
    const std::uint16_t inner = word(rows[1][u] + rows[3][u]);
    sums[u] = word(word(outer + word(4 * inner)) + word(6 * rows[2][u]));
  }
}

/// 1 4 6 4 1 along the row at every second entry; sums[0] lies two left of the first pixel. Reads
/// up to 16 entries beyond the last one needed.
void sum_rows(const std::uint16_t* sums, int count, std::uint8_t* out) {
  int u = 0;
#if defined(__AVX2__)
  const auto load = [](const std::uint16_t* p) {
    return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
  };
  const __m256i first = _mm256_set1_epi32(1 | 4 << 16);
  const __m256i second = _mm256_set1_epi32(6 | 4 << 16);
  const __m256i third = _mm256_set1_epi32(1);
  const __m256i half = _mm256_set1_epi32(128);
  for (; u + 8 <= count; u += 8) {
    const std::uint16_t* p = sums + 2 * static_cast<std::ptrdiff_t>(u);
    const __m256i a = _mm256_madd_epi16(load(p), first);
    const __m256i b = _mm256_madd_epi16(load(p + 2), second);
    const __m256i c = _mm256_madd_epi16(load(p + 4), third);
    const __m256i sum =
        _mm256_srli_epi32(_mm256_add_epi32(_mm256_add_epi32(a, b), _mm256_add_epi32(c, half)), 8);
    const __m128i words =
        _mm_packus_epi32(_mm256_castsi256_si128(sum), _mm256_extracti128_si256(sum, 1));
    _mm_storel_epi64(reinterpret_cast<__m128i*>(out + u), _mm_packus_epi16(words, words));
  }
#elif defined(__ARM_NEON)
  for (; u + 8 <= count; u += 8) {  // 16 * 16 * 255 fits 16 bits
    const std::uint16_t* p = sums + 2 * static_cast<std::ptrdiff_t>(u);
    const uint16x8x2_t first = vld2q_u16(p);
    const uint16x8x2_t second = vld2q_u16(p + 2);
    const uint16x8_t outer = vaddq_u16(first.val[0], vld2q_u16(p + 4).val[0]);
    const uint16x8_t inner = vaddq_u16(first.val[1], second.val[1]);
    uint16x8_t sum = vmlaq_n_u16(outer, second.val[0], 6);
    sum = vaddq_u16(sum, vshlq_n_u16(inner, 2));
    vst1_u8(out + u, vrshrn_n_u16(sum, 8));
  }
#endif
  for (; u < count; ++u) {
    const std::uint16_t* p = sums + 2 * static_cast<std::ptrdiff_t>(u);
    out[u] = static_cast<std::uint8_t>((p[0] + p[4] + 4 * (p[1] + p[3]) + 6 * p[2] + 128) >> 8);
  }
}

/// Gaussian reduction (Burt and Adelson 1983): pixel (u, v) of the result lies at (2u, 2v).
PaddedImage halved(const PaddedImage& fine) {
  PaddedImage coarse((fine.width() + 1) / 2, (fine.height() + 1) / 2, fine.border_px());
  const int count = 2 * coarse.width() + 3;  // at most 4 beyond the fine image
  std::vector<std::uint16_t> sums(static_cast<std::size_t>(count) + 16);
  for (int v = 0; v < coarse.height(); ++v) {
    std::array<const std::uint8_t*, 5> rows{};
    for (int i = 0; i < 5; ++i) rows[i] = fine.row(2 * v - 2 + i) - 2;
    sum_columns(rows, count, sums.data());
    sum_rows(sums.data(), coarse.width(), coarse.row(v));
  }
  coarse.mirror_border();
  return coarse;
}

}  // namespace

ImagePyramid::ImagePyramid(const GreyImage& image, int levels, int window_px) {
  CHECK(!image.empty() && levels >= 0 && window_px >= 3);
  auto built = std::make_shared<Levels>();
  built->window_px = window_px;
  built->level.reserve(static_cast<std::size_t>(levels) + 1);
  built->level.emplace_back().assign(image, FlowPatch::reach_px(window_px));
  for (int i = 0; i < levels; ++i) {
    const PaddedImage& last = built->level.back();
    // Where the window covers the whole image it says nothing.
    if (std::min(last.width(), last.height()) <= 2 * window_px) break;
    built->level.push_back(halved(last));
  }
  levels_ = std::move(built);
}

int ImagePyramid::width() const { return empty() ? 0 : levels_->level[0].width(); }
int ImagePyramid::height() const { return empty() ? 0 : levels_->level[0].height(); }

}  // namespace ygslam
