#include "features/fast.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <utility>

#ifdef __AVX2__
#include <immintrin.h>
#endif

#include "core/check.hpp"

namespace ygslam {

namespace {

constexpr std::array<std::pair<int, int>, 16> kCircle = {{{0, -3},
                                                          {1, -3},
                                                          {2, -2},
                                                          {3, -1},
                                                          {3, 0},
                                                          {3, 1},
                                                          {2, 2},
                                                          {1, 3},
                                                          {0, 3},
                                                          {-1, 3},
                                                          {-2, 2},
                                                          {-3, 1},
                                                          {-3, 0},
                                                          {-3, -1},
                                                          {-2, -2},
                                                          {-1, -3}}};

std::array<std::ptrdiff_t, 16> circle_offsets(int stride) {
  std::array<std::ptrdiff_t, 16> offsets{};
  for (int i = 0; i < 16; ++i) {
    offsets[i] = kCircle[i].first + static_cast<std::ptrdiff_t>(kCircle[i].second) * stride;
  }
  return offsets;
}

#ifdef __AVX2__

// max over the 16 arcs of the min over their 9 entries. Two arcs that share the eight entries
// d[i+1] .. d[i+8] are handled together: min(shared, max(d[i], d[i+9])).
__m256i best_arc(const __m256i* d) {
  __m256i pair[8];
  __m256i quad[8];
  for (int k = 0; k < 8; ++k) {
    pair[k] = _mm256_min_epu8(d[(2 * k + 1) % 16], d[(2 * k + 2) % 16]);
  }
  for (int k = 0; k < 8; ++k) quad[k] = _mm256_min_epu8(pair[k], pair[(k + 1) % 8]);
  __m256i best = _mm256_setzero_si256();
  for (int k = 0; k < 8; ++k) {
    const __m256i shared = _mm256_min_epu8(quad[k], quad[(k + 2) % 8]);
    const __m256i either = _mm256_max_epu8(d[2 * k], d[(2 * k + 9) % 16]);
    best = _mm256_max_epu8(best, _mm256_min_epu8(shared, either));
  }
  return best;
}

__m256i load(const std::uint8_t* p) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
}

// An arc of nine holds two neighbouring points of the compass: an upper bound of the score.
__m256i compass_bound(const std::uint8_t* p, const std::array<std::ptrdiff_t, 16>& at,
                      __m256i centre) {
  const __m256i n = load(p + at[0]);
  const __m256i e = load(p + at[4]);
  const __m256i s = load(p + at[8]);
  const __m256i w = load(p + at[12]);
  const __m256i high = _mm256_min_epu8(_mm256_max_epu8(n, s), _mm256_max_epu8(e, w));
  const __m256i low = _mm256_max_epu8(_mm256_min_epu8(n, s), _mm256_min_epu8(e, w));
  return _mm256_max_epu8(_mm256_subs_epu8(high, centre), _mm256_subs_epu8(centre, low));
}

void score_block(const std::uint8_t* p, const std::array<std::ptrdiff_t, 16>& at, __m256i threshold,
                 std::uint8_t* out) {
  const __m256i zero = _mm256_setzero_si256();
  const __m256i centre = load(p);
  const __m256i bound = _mm256_subs_epu8(compass_bound(p, at, centre), threshold);
  __m256i score = zero;
  if (!_mm256_testz_si256(bound, bound)) {
    __m256i brighter[16];
    __m256i darker[16];
    for (int i = 0; i < 16; ++i) {
      const __m256i ring = load(p + at[i]);
      brighter[i] = _mm256_subs_epu8(ring, centre);
      darker[i] = _mm256_subs_epu8(centre, ring);
    }
    score = _mm256_max_epu8(best_arc(brighter), best_arc(darker));
    const __m256i weak = _mm256_cmpeq_epi8(_mm256_subs_epu8(score, threshold), zero);
    score = _mm256_andnot_si256(weak, score);
  }
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(out), score);
}

#endif

}  // namespace

int fast_score(const std::uint8_t* pixel, int stride) {
  const auto at = circle_offsets(stride);
  int best = 0;
  for (int first = 0; first < 16; ++first) {
    int brighter = 255;
    int darker = 255;
    for (int i = first; i < first + 9; ++i) {
      const int difference = pixel[at[i % 16]] - pixel[0];
      brighter = std::min(brighter, difference);
      darker = std::min(darker, -difference);
    }
    best = std::max({best, brighter, darker});
  }
  return best;
}

void fast_score_row(const std::uint8_t* row, int stride, int begin, int end, int threshold,
                    std::uint8_t* scores) {
#ifdef __AVX2__
  const auto at = circle_offsets(stride);
  const __m256i limit = _mm256_set1_epi8(static_cast<char>(threshold));
  for (int u = begin; u < end; u += 32) score_block(row + u, at, limit, scores + (u - begin));
#else
  for (int u = begin; u < end; ++u) {
    const int score = fast_score(row + u, stride);
    scores[u - begin] = static_cast<std::uint8_t>(score > threshold ? score : 0);
  }
#endif
}

// Of equal neighbours the first in raster order stays.
void FastDetector::suppress_row(int v, int begin, int count, std::vector<Corner>& corners) {
  const std::uint8_t* const above = rows_[0].data();
  const std::uint8_t* const here = rows_[1].data();
  const std::uint8_t* const below = rows_[2].data();
  const auto keep = [&](int i) {
    const int s = here[i];
    if (s == 0) return;
    const int before = std::max({above[i - 1], above[i], above[i + 1], here[i - 1]});
    const int after = std::max({here[i + 1], below[i - 1], below[i], below[i + 1]});
    if (s > before && s >= after) {
      corners.push_back({static_cast<std::int16_t>(begin + i), static_cast<std::int16_t>(v),
                         static_cast<float>(s)});
    }
  };
  int i = 1;
#ifdef __AVX2__
  for (; i + 32 <= count - 1; i += 32) {
    const __m256i s = load(here + i);
    if (_mm256_testz_si256(s, s)) continue;
    const __m256i before =
        _mm256_max_epu8(_mm256_max_epu8(load(above + i - 1), load(above + i)),
                        _mm256_max_epu8(load(above + i + 1), load(here + i - 1)));
    const __m256i after = _mm256_max_epu8(_mm256_max_epu8(load(below + i - 1), load(below + i)),
                                          _mm256_max_epu8(load(below + i + 1), load(here + i + 1)));
    const __m256i zero = _mm256_setzero_si256();
    const __m256i not_above = _mm256_cmpeq_epi8(_mm256_subs_epu8(s, before), zero);
    const __m256i at_least = _mm256_cmpeq_epi8(_mm256_subs_epu8(after, s), zero);
    auto bits =
        static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_andnot_si256(not_above, at_least)));
    for (; bits != 0; bits &= bits - 1) {
      const int j = i + std::countr_zero(bits);
      corners.push_back({static_cast<std::int16_t>(begin + j), static_cast<std::int16_t>(v),
                         static_cast<float>(here[j])});
    }
  }
#endif
  for (; i < count - 1; ++i) keep(i);
}

void FastDetector::detect(const PaddedImage& image, int margin_px, int cell_px, int threshold,
                          int low_threshold, std::vector<Corner>& corners) {
  CHECK(margin_px >= 4 && cell_px > 0 && low_threshold <= threshold);
  corners.clear();
  const int begin = margin_px - 1;  // one more on each side for the suppression
  const int count = image.width() - 2 * begin;
  const int inner_height = image.height() - 2 * margin_px;
  if (count < 3 || inner_height < 1) return;
  for (auto& row : rows_) row.resize(static_cast<std::size_t>(count) + 64);

  const auto score = [&](int v, std::vector<std::uint8_t>& into) {
    fast_score_row(image.row(v), image.stride(), begin, begin + count, low_threshold, into.data());
  };
  score(margin_px - 1, rows_[0]);
  score(margin_px, rows_[1]);
  for (int v = margin_px; v < margin_px + inner_height; ++v) {
    score(v + 1, rows_[2]);
    suppress_row(v, begin, count, corners);
    std::swap(rows_[0], rows_[1]);
    std::swap(rows_[1], rows_[2]);
  }

  const int columns = std::max(1, (count - 2) / cell_px);
  const int rows = std::max(1, inner_height / cell_px);
  const auto cell = [&](const Corner& c) {
    return (c.v - margin_px) * rows / inner_height * columns +
           (c.u - margin_px) * columns / (count - 2);
  };
  const auto strong = [&](const Corner& c) { return c.score > static_cast<float>(threshold); };
  cell_has_strong_.assign(static_cast<std::size_t>(columns) * rows, 0);
  for (const Corner& c : corners) {
    if (strong(c)) cell_has_strong_[cell(c)] = 1;
  }
  std::erase_if(corners, [&](const Corner& c) { return !strong(c) && cell_has_strong_[cell(c)]; });
}

}  // namespace ygslam
