#include "features/fast.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "core/check.hpp"
#include "features/bytes.hpp"

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

// max over the 16 arcs of the min over their 9 entries. Two arcs that share the eight entries
// d[i+1] .. d[i+8] are handled together: min(shared, max(d[i], d[i+9])).
Bytes best_arc(const Bytes* d) {
  Bytes pair[8];
  Bytes quad[8];
  for (int k = 0; k < 8; ++k) pair[k] = min(d[(2 * k + 1) % 16], d[(2 * k + 2) % 16]);
  for (int k = 0; k < 8; ++k) quad[k] = min(pair[k], pair[(k + 1) % 8]);
  Bytes best = Bytes::zero();
  for (int k = 0; k < 8; ++k) {
    const Bytes shared = min(quad[k], quad[(k + 2) % 8]);
    const Bytes either = max(d[2 * k], d[(2 * k + 9) % 16]);
    best = max(best, min(shared, either));
  }
  return best;
}

// An arc of nine holds two neighbouring points of the compass: an upper bound of the score.
Bytes compass_bound(const std::uint8_t* p, const std::array<std::ptrdiff_t, 16>& at, Bytes centre) {
  const Bytes n = Bytes::load(p + at[0]);
  const Bytes e = Bytes::load(p + at[4]);
  const Bytes s = Bytes::load(p + at[8]);
  const Bytes w = Bytes::load(p + at[12]);
  const Bytes high = min(max(n, s), max(e, w));
  const Bytes low = max(min(n, s), min(e, w));
  return max(excess(high, centre), excess(centre, low));
}

void score_block(const std::uint8_t* p, const std::array<std::ptrdiff_t, 16>& at, Bytes threshold,
                 std::uint8_t* out) {
  const Bytes centre = Bytes::load(p);
  Bytes score = Bytes::zero();
  if (excess(compass_bound(p, at, centre), threshold).any()) {
    Bytes brighter[16];
    Bytes darker[16];
    for (int i = 0; i < 16; ++i) {
      const Bytes ring = Bytes::load(p + at[i]);
      brighter[i] = excess(ring, centre);
      darker[i] = excess(centre, ring);
    }
    score = max(best_arc(brighter), best_arc(darker));
    score = score.where_greater(score, threshold);
  }
  score.store(out);
}

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
  const auto at = circle_offsets(stride);
  const Bytes limit = Bytes::all(static_cast<std::uint8_t>(threshold));
  for (int u = begin; u < end; u += Bytes::kCount)
    score_block(row + u, at, limit, scores + (u - begin));
}

// Of equal neighbours the first in raster order stays.
void FastDetector::suppress_row(int v, int begin, int count, std::vector<Corner>& corners) {
  const std::uint8_t* const above = rows_[0].data();
  const std::uint8_t* const here = rows_[1].data();
  const std::uint8_t* const below = rows_[2].data();
  const auto add = [&](int i) {
    corners.push_back({static_cast<std::int16_t>(begin + i), static_cast<std::int16_t>(v),
                       static_cast<float>(here[i])});
  };
  int i = 1;
  for (; i + Bytes::kCount <= count - 1; i += Bytes::kCount) {
    const auto at = [i](const std::uint8_t* row, int right) {
      return Bytes::load(row + i + right);
    };
    const Bytes s = at(here, 0);
    if (!s.any()) continue;
    const Bytes before = max(max(at(above, -1), at(above, 0)), max(at(above, 1), at(here, -1)));
    const Bytes after = max(max(at(below, -1), at(below, 0)), max(at(below, 1), at(here, 1)));
    s.where_greater(s, before).where_at_most(after, s).for_each_set([&](int k) { add(i + k); });
  }
  for (; i < count - 1; ++i) {
    const int s = here[i];
    if (s == 0) continue;
    const int before = std::max({above[i - 1], above[i], above[i + 1], here[i - 1]});
    const int after = std::max({here[i + 1], below[i - 1], below[i], below[i + 1]});
    if (s > before && s >= after) add(i);
  }
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
