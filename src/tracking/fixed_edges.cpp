#include "tracking/fixed_edges.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace ygslam {
namespace {

constexpr int kTileColumns = 8, kTileRows = 6;
constexpr double kEdgesOfTile = 0.02;  // of its pixels: with fewer it has no texture

/// Counts of a tile, or of several.
struct Tiles {
  int textured = 0, moved = 0;
};

/// Two gradients within 30 degrees and a factor of 2.5: behind letters the world is brighter here,
/// darker there. @param dot, a2, b2 their product and squares.
inline bool is_alike(int dot, int norm2_a, int norm2_b) {
  const auto both = static_cast<float>(dot), a2 = static_cast<float>(norm2_a),
             b2 = static_cast<float>(norm2_b);
  // No short cuts: the compiler takes eight pixels at a time.
  return (both > 0) & (4 * both * both >= 3 * a2 * b2) & (6.25F * a2 >= b2) & (a2 <= 6.25F * b2);
}

// Choices without branches, of which the compiler takes 32 at a time.
constexpr std::uint8_t yes_if(bool condition) { return condition ? 255 : 0; }
constexpr std::uint8_t choose(std::uint8_t yes, std::uint8_t a, std::uint8_t b) {
  return static_cast<std::uint8_t>((yes & a) | (~yes & b));
}

}  // namespace

void FixedEdges::start(const GreyImage& image) {
  image_width_ = image.width();
  image_height_ = image.height();
  scale_ = std::max(1, static_cast<int>(std::lround(1.0 * image_width_ / config_.width_px)));
  const int width = image_width_ / scale_, height = image_height_ / scale_;
  reduced_ = score_ = fixed_ = GreyImage(width, height);
  const Image<std::int8_t> none(width, height);
  now_ = last_ = reference_ = {none, none};
  cells_ = Image<Cell>((width + kCell_px - 1) / kCell_px, (height + kCell_px - 1) / kCell_px);
  const Columns columns(static_cast<std::size_t>(cells_.width()) * kCell_px);
  is_alike_ = strength_ = agrees_ = other_edge_ = edges_ = stayed_ = alike_ = passing_ =
      fixed_count_ = columns;
}

bool FixedEdges::step(const GreyImage& image) {
  const bool is_first = image.width() != image_width_ || image.height() != image_height_;
  if (is_first) start(image);
  reduce(image);
  find_gradients();
  compare_with_last();
  if (!is_first && !has_moved()) return false;
  if (!is_first) ++samples_;
  if (!is_first) judge_pixels();
  std::swap(now_, last_);
  return !is_first;
}

/// Means of squares of pixels.
void FixedEdges::reduce(const GreyImage& image) {
  std::vector<std::uint16_t> sums(static_cast<std::size_t>(reduced_.width()) * scale_);
  const std::uint32_t share = (1U << 16U) / static_cast<std::uint32_t>(scale_ * scale_);
  for (int v = 0; v < reduced_.height(); ++v) {
    std::copy_n(image.row(v * scale_), sums.size(), sums.begin());
    for (int dv = 1; dv < scale_; ++dv) {
      const std::uint8_t* row = image.row(v * scale_ + dv);
      for (std::size_t u = 0; u < sums.size(); ++u) sums[u] += row[u];
    }
    reduce_row(sums.data(), share, v);
  }
}

void FixedEdges::reduce_row(const std::uint16_t* sums, std::uint32_t share, int v) {
  std::uint8_t* to = reduced_.row(v);
  const int width = reduced_.width();
  if (scale_ == 2) {  // of the usual images: a loop that the compiler can take in wide steps
    for (int u = 0; u < width; ++u)
      to[u] = static_cast<std::uint8_t>((sums[2 * u] + sums[2 * u + 1] + 2) / 4);
    return;
  }
  for (int u = 0; u < width; ++u) {
    std::uint32_t sum = 0;
    for (int du = 0; du < scale_; ++du) sum += sums[u * scale_ + du];
    to[u] = static_cast<std::uint8_t>(sum * share >> 16U);
  }
}

/// Central differences; none at the border.
void FixedEdges::find_gradients() {
  for (int v = 1; v + 1 < reduced_.height(); ++v) {
    const std::uint8_t* above = reduced_.row(v - 1);
    const std::uint8_t* here = reduced_.row(v);
    const std::uint8_t* below = reduced_.row(v + 1);
    std::int8_t* __restrict x = now_.x.row(v);
    std::int8_t* __restrict y = now_.y.row(v);
    const int width = reduced_.width();
    for (int u = 1; u + 1 < width; ++u) {
      x[u] = static_cast<std::int8_t>((here[u + 1] - here[u - 1]) / 2);
      y[u] = static_cast<std::int8_t>((below[u] - above[u]) / 2);
    }
  }
}

/// Of the columns of a cell; what is left of the last one stays zero.
int FixedEdges::pixels_of(const Columns& columns, int cell) const {
  static_assert(kCell_px == 4);
  std::uint32_t four = 0;
  std::memcpy(&four, columns.data() + static_cast<std::size_t>(cell) * kCell_px, sizeof four);
  return static_cast<int>(four * 0x01010101U >> 24U);  // no byte is over 16
}

/// Counts the pixels of a row that are 255.
void FixedEdges::add(const std::uint8_t* row, Columns& count) const {
  std::uint8_t* to = count.data();
  const int width = now_.x.width();
  for (int u = 0; u < width; ++u) to[u] += row[u] & 1;
}

/// Counts in every second row, which is enough, the edges and those that are as they were.
void FixedEdges::compare_with_last() {
  for (int row = 0; row < cells_.height(); ++row) {
    std::ranges::fill(edges_, 0);
    std::ranges::fill(stayed_, 0);
    const int end = std::min((row + 1) * kCell_px, now_.x.height() - 1);
    for (int v = row * kCell_px + 1; v < end; v += 2) compare_row(v);
    Cell* cells = cells_.row(row);
    for (int i = 0; i < cells_.width(); ++i) {
      cells[i] = {};
      cells[i].edges = static_cast<std::uint8_t>(pixels_of(edges_, i));
      cells[i].stayed = static_cast<std::uint8_t>(pixels_of(stayed_, i));
    }
  }
}

void FixedEdges::compare_row(int v) {
  const int edge2 = config_.edge * config_.edge;
  const std::int8_t *x = now_.x.row(v), *y = now_.y.row(v);
  const std::int8_t *last_x = last_.x.row(v), *last_y = last_.y.row(v);
  std::uint8_t *edges = edges_.data(), *stayed = stayed_.data();
  const int width = now_.x.width();  // at its borders there are no gradients
  for (int u = 0; u < width; ++u) {
    const int now2 = x[u] * x[u] + y[u] * y[u];
    const int last2 = last_x[u] * last_x[u] + last_y[u] * last_y[u];
    const bool is_edge = std::max(now2, last2) >= edge2;
    edges[u] += is_edge ? 1 : 0;
    stayed[u] += (is_edge & is_alike(x[u] * last_x[u] + y[u] * last_y[u], now2, last2)) ? 1 : 0;
  }
}

/// Whether most of the image that shows anything has, and not at one place alone.
bool FixedEdges::has_moved() const {
  std::array<Tiles, 4> quarters;
  Tiles all;
  for (int row = 0; row < kTileRows; ++row) {
    for (int column = 0; column < kTileColumns; ++column) {
      const int u0 = column * cells_.width() / kTileColumns, v0 = row * cells_.height() / kTileRows;
      const int u1 = (column + 1) * cells_.width() / kTileColumns,
                v1 = (row + 1) * cells_.height() / kTileRows;
      int edges = 0, stayed = 0;
      for (int v = v0; v < v1; ++v) {
        for (int u = u0; u < u1; ++u) {
          edges += cells_.at(u, v).edges;
          stayed += cells_.at(u, v).stayed;
        }
      }
      const double pixels = 0.5 * (u1 - u0) * (v1 - v0) * kCell_px * kCell_px;
      if (edges <= kEdgesOfTile * pixels) continue;
      Tiles& quarter = quarters[2 * (2 * row / kTileRows) + 2 * column / kTileColumns];
      for (Tiles* tiles : {&quarter, &all}) {
        ++tiles->textured;
        if (2 * stayed < edges) ++tiles->moved;
      }
    }
  }
  const auto quarters_moved = std::count_if(quarters.begin(), quarters.end(), [&](const Tiles& q) {
    return q.moved > 0 && q.moved >= config_.moved_in_quarter * q.textured;
  });
  return all.textured >= config_.textured_tiles * kTileRows * kTileColumns &&
         all.moved >= config_.moved_tiles * all.textured && quarters_moved >= 3;
}

void FixedEdges::judge_pixels() {
  for (int row = 0; row < cells_.height(); ++row) {
    for (Columns* columns : {&alike_, &passing_, &fixed_count_}) std::ranges::fill(*columns, 0);
    const int end = std::min((row + 1) * kCell_px, now_.x.height() - 1);
    for (int v = std::max(1, row * kCell_px); v < end; ++v) {
      hold_against_reference(v);
      take_references(v);
      judge_row(v);
      add(agrees_.data(), alike_);
      add(other_edge_.data(), passing_);
      add(fixed_.row(v), fixed_count_);
      add_directions(v);
    }
    Cell* cells = cells_.row(row);
    for (int i = 0; i < cells_.width(); ++i) {
      cells[i].alike = static_cast<std::uint8_t>(pixels_of(alike_, i));
      cells[i].passing = static_cast<std::uint8_t>(pixels_of(passing_, i));
      cells[i].fixed = static_cast<std::uint8_t>(pixels_of(fixed_count_, i));
    }
  }
}

void FixedEdges::hold_against_reference(int v) {
  const int edge2 = config_.edge * config_.edge, no_edge2 = config_.no_edge * config_.no_edge;
  const std::int8_t *x = now_.x.row(v), *y = now_.y.row(v);
  const std::int8_t *old_x = reference_.x.row(v), *old_y = reference_.y.row(v);
  std::uint8_t *alike = is_alike_.data(), *strength = strength_.data();
  const int width = now_.x.width();
  for (int u = 0; u < width; ++u) {
    const int now2 = x[u] * x[u] + y[u] * y[u];
    const int old2 = old_x[u] * old_x[u] + old_y[u] * old_y[u];
    alike[u] = yes_if(is_alike(x[u] * old_x[u] + y[u] * old_y[u], now2, old2));
    strength[u] = static_cast<std::uint8_t>((now2 >= no_edge2 ? 1 : 0) + (now2 >= edge2 ? 1 : 0));
  }
}

/// What is seen where nothing was becomes what later samples are held against.
void FixedEdges::take_references(int v) {
  const std::int8_t *x = now_.x.row(v), *y = now_.y.row(v);
  std::int8_t *old_x = reference_.x.row(v), *old_y = reference_.y.row(v);
  const std::uint8_t* score = score_.row(v);
  const int width = now_.x.width();
  for (int u = 0; u < width; ++u) {
    const std::uint8_t is_known = yes_if(score[u] > 0);
    old_x[u] = static_cast<std::int8_t>(choose(is_known, old_x[u], x[u]));
    old_y[u] = static_cast<std::int8_t>(choose(is_known, old_y[u], y[u]));
  }
}

void FixedEdges::judge_row(int v) {
  std::uint8_t *scores = score_.row(v), *fixed = fixed_.row(v);
  const std::uint8_t *alike = is_alike_.data(), *strength = strength_.data();
  std::uint8_t *agrees = agrees_.data(), *other_edge = other_edge_.data();
  const int width = now_.x.width();
  for (int u = 0; u < width; ++u) {
    const std::uint8_t score = scores[u];
    const std::uint8_t is_known = yes_if(score > 0), is_edge = yes_if(strength[u] == 2);
    const std::uint8_t does_agree = is_known & alike[u];
    // Over what is as bright a fixed edge cannot be seen, but one that sways to and fro cannot
    // either.
    const std::uint8_t is_unseen = fixed[u] & yes_if(strength[u] == 0);
    const std::uint8_t loss = choose(is_unseen, kLossUnseen, kLoss);
    const std::uint8_t more = std::min<std::uint8_t>(score, kMost - kGain) + kGain;
    const std::uint8_t less = std::max(score, loss) - loss;
    const std::uint8_t now =
        choose(is_known, choose(does_agree, more, less), is_edge & std::uint8_t{kGain});
    scores[u] = now;
    fixed[u] = is_known & (yes_if(now >= kFixed) | (fixed[u] & yes_if(now > kFree)));
    agrees[u] = does_agree;
    other_edge[u] = is_known & ~does_agree & is_edge;
  }
}

/// Of the pixels that are fixed, which are few.
void FixedEdges::add_directions(int v) {
  const std::uint8_t* fixed = fixed_.row(v);
  Cell* cells = cells_.row(v / kCell_px);
  const auto next = [&](int from) {
    const auto left = static_cast<std::size_t>(fixed_.width() - from);
    const void* found = left > 0 ? std::memchr(fixed + from, 255, left) : nullptr;
    return found ? static_cast<int>(static_cast<const std::uint8_t*>(found) - fixed) : -1;
  };
  for (int u = next(0); u >= 0; u = next(u + 1)) {
    const auto x = static_cast<float>(reference_.x.at(u, v)),
               y = static_cast<float>(reference_.y.at(u, v));
    const float scale = 1.0F / (x * x + y * y);
    auto& direction = cells[u / kCell_px].direction;
    direction[0] += scale * x * x;
    direction[1] += scale * x * y;
    direction[2] += scale * y * y;
  }
}

}  // namespace ygslam
