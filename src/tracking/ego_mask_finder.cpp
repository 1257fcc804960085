#include "tracking/ego_mask_finder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace ygslam {
namespace {

constexpr std::uint8_t kYes = 255;
constexpr int kPassed = 4, kMostPassed = 12;  // samples
constexpr float kAsFar = 0.85F;               // of a depth

template <typename Pixel, typename Visit>
void visit_square(const Image<Pixel>& image, int u, int v, int radius, const Visit& visit) {
  for (int y = std::max(0, v - radius); y <= std::min(image.height() - 1, v + radius); ++y)
    for (int x = std::max(0, u - radius); x <= std::min(image.width() - 1, u + radius); ++x)
      visit(x, y);
}

void fill_square(GreyImage& image, int u, int v, int radius) {
  visit_square(image, u, v, radius, [&](int x, int y) { image.at(x, y) = kYes; });
}

/// Every pixel of the image takes that of the smaller one; what is left over at the edges its
/// neighbour's.
GreyImage enlarged(const GreyImage& small, int scale, int width, int height) {
  GreyImage image(width, height);
  for (int v = 0; v < height; ++v) {
    std::uint8_t* to = image.row(v);
    if (v % scale != 0 || v / scale >= small.height()) {
      std::copy_n(image.row(v - 1), width, to);
      continue;
    }
    const std::uint8_t* from = small.row(v / scale);
    for (int u = 0; u < small.width(); ++u) std::fill_n(to + u * scale, scale, from[u]);
    std::fill(to + small.width() * scale, to + width, from[small.width() - 1]);
  }
  return image;
}

}  // namespace

PixelMaskPtr EgoMaskFinder::step(const RgbdFrame& frame) {
  if (!config_.enabled || frame.grey.empty()) return mask_;
  const bool is_later = edges_.samples() >= config_.first_samples;
  const double interval_s = is_later ? config_.later_interval_s : config_.interval_s;
  if (last_ && seconds_between(frame.stamp, *last_) < interval_s) return mask_;
  last_ = frame.stamp;
  if (!edges_.step(frame.grey)) {
    if (mask_ && !mask_->same_size(frame.grey)) mask_.reset();
    return mask_;
  }
  depth_.step(frame.depth_m, edges_);
  const Cells corners = this->corners();
  publish(painted(corners, surfaces(corners)), frame.grey);
  return mask_;
}

/// Whether fixed edges about a cell run in two directions. In one alone they could be of the world
/// and the camera move along them (the aperture problem).
bool EgoMaskFinder::has_corner(int u, int v) const {
  FixedEdges::Cell about;
  int fixed = 0;
  visit_square(edges_.cells(), u, v, 1, [&](int x, int y) {
    const FixedEdges::Cell& cell = edges_.cells().at(x, y);
    fixed += cell.fixed;
    for (std::size_t i = 0; i < 3; ++i) about.direction[i] += cell.direction[i];
  });
  if (fixed < config_.least_edges) return false;
  const auto& [xx, xy, yy] = about.direction;  // trace: the number of pixels
  const double weaker = 0.5 * (xx + yy - std::hypot(xx - yy, 2 * xy));
  return weaker >= config_.corner * fixed;
}

/// A mover that fills the view of a standing camera leaves a background that stays, too. But that
/// keeps its depth, and nothing moves on beside it that is as far away, as it does behind text.
bool EgoMaskFinder::is_background(int u, int v) const {
  if (!depth_.stands(u, v) || is_near(u, v)) return false;
  constexpr int kReach = 10;
  const float as_far_m = kAsFar * depth_.shown_m(u, v);
  int passing = 0, standing = 0;
  visit_square(edges_.cells(), u, v, kReach, [&](int x, int y) {
    if (depth_.passing_m(x, y) > as_far_m) ++passing;
    if (edges_.cells().at(x, y).fixed > 0 && depth_.stands(x, y)) ++standing;
  });
  return passing < standing;
}

/// Before a surface without much texture text looks like a background for a while: what has passed
/// for the camera's own more often stays it until its edges go.
EgoMaskFinder::Cells EgoMaskFinder::corners() {
  Cells corners(edges_.cells().width(), edges_.cells().height());
  if (!passed_.same_size(corners)) passed_ = Cells(corners.width(), corners.height());
  for (int v = 0; v < corners.height(); ++v) {
    for (int u = 0; u < corners.width(); ++u) {
      std::uint8_t& passed = passed_.at(u, v);
      if (edges_.cells().at(u, v).fixed == 0 || !has_corner(u, v)) {
        passed = 0;
        continue;
      }
      const bool passes = !is_background(u, v);
      passed = static_cast<std::uint8_t>(std::clamp(passed + (passes ? 1 : -1), 0, kMostPassed));
      if (passes || passed >= kPassed) corners.at(u, v) = kYes;
    }
  }
  return corners;
}

/// Near enough to be carried by the camera.
bool EgoMaskFinder::is_near(int u, int v) const {
  return depth_.depth_m(u, v) < config_.nearer * depth_.scene_m();
}

/// What hangs together in depth with corners that keep theirs, and keeps it, too.
EgoMaskFinder::Cells EgoMaskFinder::surfaces(const Cells& corners) const {
  Cells found(corners.width(), corners.height());
  std::vector<std::pair<int, int>> open;
  const auto take = [&](int u, int v) {
    const FixedEdges::Cell& cell = edges_.cells().at(u, v);
    if (found.at(u, v) != 0 || !depth_.is_fixed(u, v) || !is_near(u, v)) return;
    if (cell.moved() || cell.passing > cell.fixed + 2) return;
    found.at(u, v) = kYes;
    open.emplace_back(u, v);
  };
  for (int v = 0; v < corners.height(); ++v)
    for (int u = 0; u < corners.width(); ++u)
      if (corners.at(u, v) != 0) take(u, v);
  constexpr float kJump = 0.05F, kLeastJump_m = 0.01F;
  while (!open.empty()) {
    const auto [u, v] = open.back();
    open.pop_back();
    const float m = depth_.depth_m(u, v);
    visit_square(found, u, v, 1, [&, u = u, v = v](int x, int y) {
      const bool is_beside = (x == u) != (y == v);
      if (is_beside && std::abs(depth_.depth_m(x, y) - m) <= kLeastJump_m + kJump * m) take(x, y);
    });
  }
  return found;
}

/// In pixels of the reduced image, with a margin.
GreyImage EgoMaskFinder::painted(const Cells& corners, const Cells& surfaces) const {
  constexpr int kCell_px = FixedEdges::kCell_px;
  const GreyImage& fixed = edges_.fixed();
  GreyImage mask(fixed.width(), fixed.height());
  const auto paint = [&](int column, int row, bool all) {
    for (int v = row * kCell_px; v < std::min(fixed.height(), (row + 1) * kCell_px); ++v)
      for (int u = column * kCell_px; u < std::min(fixed.width(), (column + 1) * kCell_px); ++u)
        if (all || fixed.at(u, v) != 0) fill_square(mask, u, v, config_.margin_px);
  };
  for (int row = 0; row < corners.height(); ++row) {
    for (int column = 0; column < corners.width(); ++column) {
      const bool is_surface = surfaces.at(column, row) != 0;
      bool is_of_corner = false;
      if (!is_surface && edges_.cells().at(column, row).fixed > 0)
        visit_square(corners, column, row, 1,
                     [&](int x, int y) { is_of_corner |= corners.at(x, y) != 0; });
      if (is_surface || is_of_corner) paint(column, row, is_surface);
    }
  }
  return mask;
}

void EgoMaskFinder::publish(GreyImage reduced, const GreyImage& image) {
  if (mask_ && mask_->same_size(image) && std::ranges::equal(reduced, reduced_)) return;
  const auto masked = std::count(reduced.begin(), reduced.end(), kYes);
  const bool is_any =
      masked > 0 && static_cast<double>(masked) <= config_.most_of_image * reduced.size();
  if (!is_any) {
    mask_.reset();
    return;
  }
  mask_ = std::make_shared<const GreyImage>(
      enlarged(reduced, edges_.scale(), image.width(), image.height()));
  reduced_ = std::move(reduced);
}

}  // namespace ygslam
