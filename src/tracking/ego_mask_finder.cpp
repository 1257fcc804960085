#include "tracking/ego_mask_finder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace ygslam {
namespace {

constexpr std::uint8_t kYes = 255;

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
    const std::uint8_t* from = small.row(std::min(v / scale, small.height() - 1));
    std::uint8_t* to = image.row(v);
    for (int u = 0; u < width; ++u) to[u] = from[std::min(u / scale, small.width() - 1)];
  }
  return image;
}

}  // namespace

PixelMaskPtr EgoMaskFinder::step(const RgbdFrame& frame) {
  if (!config_.enabled || frame.grey.empty()) return mask_;
  if (last_ && seconds_between(frame.stamp, *last_) < config_.interval_s) return mask_;
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

/// Whether what stands tells a standing camera from one that carries something: it tells nothing
/// where much of what keeps its depth moves, as a floor does.
bool EgoMaskFinder::depth_tells() const {
  int stood = 0, moved = 0;
  for (int v = 0; v < edges_.cells().height(); ++v) {
    for (int u = 0; u < edges_.cells().width(); ++u) {
      const FixedEdges::Cell& cell = edges_.cells().at(u, v);
      if (cell.edges < 3 || !depth_.stood(u, v)) continue;
      ++stood;
      if (cell.moved()) ++moved;
    }
  }
  return moved <= 0.3 * stood;
}

EgoMaskFinder::Cells EgoMaskFinder::corners() const {
  Cells corners(edges_.cells().width(), edges_.cells().height());
  const bool depth_tells = this->depth_tells();
  for (int v = 0; v < corners.height(); ++v) {
    for (int u = 0; u < corners.width(); ++u) {
      if (edges_.cells().at(u, v).fixed == 0 || !has_corner(u, v)) continue;
      // A mover that fills the view of a standing camera leaves a background that stays, too; but
      // it is farther away.
      const bool is_background = depth_tells && depth_.stood(u, v) && !is_near(u, v);
      if (!is_background) corners.at(u, v) = kYes;
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
  for (int v = 0; v < fixed.height(); ++v) {
    for (int u = 0; u < fixed.width(); ++u) {
      const int column = u / kCell_px, row = v / kCell_px;
      bool is_of_corner = false;
      if (fixed.at(u, v) != 0)
        visit_square(corners, column, row, 1,
                     [&](int x, int y) { is_of_corner |= corners.at(x, y) != 0; });
      if (is_of_corner || surfaces.at(column, row) != 0) fill_square(mask, u, v, config_.margin_px);
    }
  }
  return mask;
}

void EgoMaskFinder::publish(const GreyImage& reduced, const GreyImage& image) {
  const auto masked = std::count(reduced.begin(), reduced.end(), kYes);
  const bool is_any =
      masked > 0 && static_cast<double>(masked) <= config_.most_of_image * reduced.size();
  if (!is_any) {
    mask_.reset();
    return;
  }
  GreyImage mask = enlarged(reduced, edges_.scale(), image.width(), image.height());
  const bool is_same = mask_ && mask_->same_size(mask) && std::ranges::equal(*mask_, mask);
  if (!is_same) mask_ = std::make_shared<const GreyImage>(std::move(mask));
}

}  // namespace ygslam
