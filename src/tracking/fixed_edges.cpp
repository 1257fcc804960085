#include "tracking/fixed_edges.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

constexpr int kTileColumns = 8, kTileRows = 6;
constexpr double kEdgesOfTile = 0.02;  // of its pixels: with fewer it has no texture

/// Counts of a tile, or of several.
struct Tiles {
  int textured = 0, moved = 0;
};

}  // namespace

void FixedEdges::start(const GreyImage& image) {
  image_width_ = image.width();
  image_height_ = image.height();
  scale_ = std::max(1, static_cast<int>(std::lround(1.0 * image_width_ / config_.width_px)));
  const int width = image_width_ / scale_, height = image_height_ / scale_;
  reduced_ = score_ = fixed_ = GreyImage(width, height);
  now_ = last_ = reference_ = Gradients(width, height);
  cells_ = Image<Cell>((width + kCell_px - 1) / kCell_px, (height + kCell_px - 1) / kCell_px);
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
    Gradient* to = now_.row(v);
    for (int u = 1; u + 1 < reduced_.width(); ++u) {
      to[u] = {static_cast<std::int8_t>((here[u + 1] - here[u - 1]) / 2),
               static_cast<std::int8_t>((below[u] - above[u]) / 2)};
    }
  }
}

/// Counts in every second row, which is enough, the edges and those that are as they were.
void FixedEdges::compare_with_last() {
  const int edge2 = config_.edge * config_.edge;
  std::fill(cells_.begin(), cells_.end(), Cell{});
  for (int v = 1; v + 1 < now_.height(); v += 2) {
    const Gradient* now = now_.row(v);
    const Gradient* last = last_.row(v);
    Cell* cells = cells_.row(v / kCell_px);
    for (int u = 1; u + 1 < now_.width(); ++u) {
      if (std::max(now[u].norm2(), last[u].norm2()) < edge2) continue;
      Cell& cell = cells[u / kCell_px];
      ++cell.edges;
      if (now[u].is_like(last[u])) ++cell.stayed;
    }
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
  const int edge2 = config_.edge * config_.edge;
  for (int v = 1; v + 1 < now_.height(); ++v) {
    Cell* cells = cells_.row(v / kCell_px);
    const Gradient* now = now_.row(v);
    const std::uint8_t* score = score_.row(v);
    for (int u = 1; u + 1 < now_.width(); ++u) {
      if (score[u] == 0 && now[u].norm2() < edge2) continue;  // most of them
      judge(now[u], static_cast<std::size_t>(v) * now_.width() + u, cells[u / kCell_px]);
    }
  }
}

void FixedEdges::judge(const Gradient& now, std::size_t pixel, Cell& cell) {
  Gradient& reference = reference_.data()[pixel];
  std::uint8_t& score = score_.data()[pixel];
  if (score == 0) {
    reference = now;
    score = kGain;
    fixed_.data()[pixel] = 0;
    return;
  }
  const int now2 = now.norm2(), reference2 = reference.norm2();
  std::uint8_t& fixed = fixed_.data()[pixel];
  const bool was_fixed = fixed != 0;
  if (now.is_like(reference)) {
    score = static_cast<std::uint8_t>(std::min(score + kGain, kMost));
    ++cell.alike;
  } else {
    // Over what is as bright a fixed edge cannot be seen, but one that sways to and fro cannot
    // either.
    const bool is_none = now2 < config_.no_edge * config_.no_edge;
    const int loss = is_none && was_fixed ? kLossUnseen : kLoss;
    score = static_cast<std::uint8_t>(std::max(score - loss, 0));
    if (now2 >= config_.edge * config_.edge) ++cell.passing;
  }
  fixed = score >= kFixed || (was_fixed && score > kFree) ? 255 : 0;
  if (fixed == 0) return;
  ++cell.fixed;
  const auto x = static_cast<float>(reference.x), y = static_cast<float>(reference.y);
  const float scale = 1.0F / static_cast<float>(reference2);
  cell.direction[0] += scale * x * x;
  cell.direction[1] += scale * x * y;
  cell.direction[2] += scale * y * y;
}

}  // namespace ygslam
