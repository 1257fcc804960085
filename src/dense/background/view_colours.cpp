#include "dense/background/view_colours.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/statistics.hpp"

namespace ygslam {
namespace {

constexpr int kOrderTile_px = 16;        // share one order of views
constexpr int kCoarse_px = 8;            // a depth of each such tile tells what a view sees
constexpr std::size_t kMostChosen = 6;   // views of a frame
constexpr std::size_t kMostLoaded = 32;  // views unpacked, 1.8 MB each at 640x480
constexpr int kMostBlended = 2;          // views of a pixel
constexpr float kLeastGain = 0.05F;      // of costs, for which a view is taken beside the others
constexpr float kMostDegrees = 60;       // between two views of a place
constexpr float kCostOfFarther = 0.3F;   // of a view from twice as far away
constexpr float kSame_m = 0.04F;         // depths of one surface differ by less than this
constexpr float kSameShare = 0.02F;      // or by less than this share of them
constexpr float kCoarseSame = 4;         // times that for the coarse depths
constexpr std::size_t kLeastPairs = 50;  // of pixels, to tell how bright a view is
constexpr int kGainStep_px = 12;         // between those pixels
constexpr float kMostGain = 2;           // and its inverse
constexpr auto kUnit_m = static_cast<float>(DepthView::kUnit_m);

float same_m(float z_m) { return std::max(kSame_m, kSameShare * z_m); }

Eigen::Vector3f in_view(const Pinhole& camera, const Eigen::Vector3f& p_camera) {
  const float inverse_z = 1 / p_camera.z();
  return {static_cast<float>(camera.fx) * p_camera.x() * inverse_z + static_cast<float>(camera.cx),
          static_cast<float>(camera.fy) * p_camera.y() * inverse_z + static_cast<float>(camera.cy),
          p_camera.z()};
}

float brightness(const Eigen::Array3f& colour) {
  return 0.299F * colour[0] + 0.587F * colour[1] + 0.114F * colour[2];
}
Eigen::Array3f as_array(Rgb8 c) {
  return {static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b)};
}
/// What is excluded has no colour to give: without a depth it agrees with no surface.
DepthView without_excluded(const StoredView& stored) {
  DepthView images = stored.restored();
  std::transform(images.depth.begin(), images.depth.end(), images.object.begin(),
                 images.depth.begin(), [](std::uint16_t depth, std::uint8_t object) {
                   return object == DepthView::kExcluded ? std::uint16_t{0} : depth;
                 });
  return images;
}

Rgb8 as_colour(const Eigen::Array3f& c) {
  const auto byte = [](float value) {
    return static_cast<std::uint8_t>(std::clamp(value + 0.5F, 0.0F, 255.0F));
  };
  return {byte(c[0]), byte(c[1]), byte(c[2])};
}

}  // namespace

ViewColours::ViewColours(const std::vector<DenseMap::PlacedView>& views) {
  for (const DenseMap::PlacedView& placed : views) {
    const DepthView images = without_excluded(*placed.view);
    const SE3 T_camera_world = placed.T_world_camera.inverse();
    View view{placed.view,
              images.camera,
              T_camera_world.R().cast<float>(),
              T_camera_world.t().cast<float>(),
              placed.T_world_camera.t().cast<float>(),
              Image<std::uint16_t>(images.depth.width() / kCoarse_px,
                                   images.depth.height() / kCoarse_px)};
    for (int v = 0; v < view.coarse.height(); ++v)
      for (int u = 0; u < view.coarse.width(); ++u)
        view.coarse.at(u, v) =
            images.depth.at(u * kCoarse_px + kCoarse_px / 2, v * kCoarse_px + kCoarse_px / 2);
    views_.push_back(std::move(view));
  }
}

float ViewColours::cost(const View& view, const Place& place,
                        const Eigen::Vector3f& t_world_frame) {
  const Eigen::Vector3f p_camera = view.R_camera_world * place.p_world + view.t_camera_world;
  if (!(p_camera.z() > kSame_m)) return 1;
  const Eigen::Vector3f seen = in_view(view.camera, p_camera);
  const int u = static_cast<int>(std::floor(seen.x() / kCoarse_px));
  const int v = static_cast<int>(std::floor(seen.y() / kCoarse_px));
  if (!(std::abs(seen.x()) < 1e6F && std::abs(seen.y()) < 1e6F) || !view.coarse.contains(u, v))
    return 1;
  const float depth_m = static_cast<float>(view.coarse.at(u, v)) * kUnit_m;
  if (std::abs(depth_m - seen.z()) > kCoarseSame * same_m(seen.z())) return 1;
  const Eigen::Vector3f a = (t_world_frame - place.p_world).normalized();
  const Eigen::Vector3f b = (view.t_world_camera - place.p_world).normalized();
  const float degrees = 57.3F * std::acos(std::clamp(a.dot(b), -1.0F, 1.0F));
  const float farther = std::max(0.0F, std::log2(seen.z() / place.z_m));
  return std::min(1.0F, degrees / kMostDegrees + kCostOfFarther * farther);
}

const DepthView* ViewColours::load(std::size_t view) {
  const auto at = std::find_if(loaded_.begin(), loaded_.end(),
                               [&](const auto& loaded) { return loaded->view == view; });
  std::unique_ptr<Loaded> found;
  if (at == loaded_.end()) {
    found = std::make_unique<Loaded>(Loaded{view, without_excluded(*views_[view].stored)});
  } else {
    found = std::move(*at);
    loaded_.erase(at);
  }
  loaded_.push_front(std::move(found));
  if (loaded_.size() > kMostLoaded) loaded_.pop_back();
  return &loaded_.front()->images;
}

std::vector<ViewColours::Chosen> ViewColours::choose(std::vector<Tile>& tiles,
                                                     const Eigen::Vector3f& t_world_frame) {
  // Each view's costs once; then the view that lowers the sum most, again and again.
  std::vector<std::pair<std::size_t, std::vector<float>>> candidates;
  for (std::size_t i = 0; i < views_.size(); ++i) {
    std::vector<float> costs;
    for (const Tile& tile : tiles) costs.push_back(cost(views_[i], tile.place, t_world_frame));
    if (std::any_of(costs.begin(), costs.end(), [](float c) { return c < 1; }))
      candidates.emplace_back(i, std::move(costs));
  }
  std::vector<Chosen> chosen;
  while (chosen.size() < std::min(kMostChosen, candidates.size())) {
    const std::vector<float>* best = nullptr;
    std::size_t best_view = 0;
    float most_gain = chosen.empty() ? 0 : kLeastGain;
    for (const auto& [view, costs] : candidates) {
      float gain = 0;
      for (std::size_t k = 0; k < tiles.size(); ++k)
        gain += std::max(0.0F, tiles[k].place.least_cost - costs[k]);
      if (gain <= most_gain) continue;
      most_gain = gain;
      best = &costs;
      best_view = view;
    }
    if (best == nullptr) break;
    for (std::size_t k = 0; k < tiles.size(); ++k)
      tiles[k].place.least_cost = std::min(tiles[k].place.least_cost, (*best)[k]);
    chosen.push_back({&views_[best_view], load(best_view)});
  }
  return chosen;
}

bool ViewColours::look(const Chosen& chosen, const Eigen::Vector3f& p_world,
                       Eigen::Array3f& colour) {
  const View& view = *chosen.view;
  const Eigen::Vector3f p_camera = view.R_camera_world * p_world + view.t_camera_world;
  if (!(p_camera.z() > kSame_m)) return false;
  const Eigen::Vector3f seen = in_view(view.camera, p_camera);
  if (!(seen.x() >= 0 && seen.y() >= 0 && seen.x() < static_cast<float>(view.camera.width - 1) &&
        seen.y() < static_cast<float>(view.camera.height - 1)))
    return false;
  const int u = static_cast<int>(seen.x()), v = static_cast<int>(seen.y());
  const float right = seen.x() - static_cast<float>(u), down = seen.y() - static_cast<float>(v);
  const float limit_m = same_m(seen.z());
  Eigen::Array3f sum = Eigen::Array3f::Zero();
  float weights = 0;
  for (int i = 0; i < 4; ++i) {
    const int x = u + (i & 1), y = v + (i >> 1);
    const float weight = ((i & 1) != 0 ? right : 1 - right) * ((i >> 1) != 0 ? down : 1 - down);
    const float depth_m = static_cast<float>(chosen.images->depth.at(x, y)) * kUnit_m;
    if (std::abs(depth_m - seen.z()) > limit_m) continue;
    sum += weight * as_array(chosen.images->colour.at(x, y));
    weights += weight;
  }
  if (weights < 0.5F) return false;
  colour = sum / weights;
  return true;
}

void ViewColours::find_gain(const RgbdFrame& frame, const FrameGeometry& geometry,
                            const GreyImage& hidden, Chosen& chosen) {
  std::vector<float> ratios;
  for (int v = kGainStep_px / 2; v < hidden.height(); v += kGainStep_px) {
    for (int u = kGainStep_px / 2; u < hidden.width(); u += kGainStep_px) {
      const float depth_m = frame.depth_m.at(u, v);
      if (hidden.at(u, v) != 0 || !(depth_m > 0)) continue;
      Eigen::Array3f there;
      if (!look(chosen, geometry.unproject(u, v, depth_m), there)) continue;
      const float dark = brightness(there), bright = brightness(as_array(frame.colour.at(u, v)));
      if (std::min(dark, bright) > 15 && std::max(dark, bright) < 240)
        ratios.push_back(bright / dark);
    }
  }
  if (ratios.size() >= kLeastPairs)
    chosen.gain = std::clamp(median(ratios), 1 / kMostGain, kMostGain);
}

std::vector<ViewColours::Tile> ViewColours::tiles_of(const FrameGeometry& geometry,
                                                     const SurfaceImage& surface) {
  const DepthImage& depth_m = surface.depth_m;
  const int columns = (depth_m.width() + kOrderTile_px - 1) / kOrderTile_px;
  const int rows = (depth_m.height() + kOrderTile_px - 1) / kOrderTile_px;
  std::vector<Tile> tiles;
  for (int tile = 0; tile < columns * rows; ++tile) {
    const int u0 = tile % columns * kOrderTile_px, v0 = tile / columns * kOrderTile_px;
    std::vector<int> pixels;
    for (int v = v0; v < std::min(v0 + kOrderTile_px, depth_m.height()); ++v)
      for (int u = u0; u < std::min(u0 + kOrderTile_px, depth_m.width()); ++u)
        if (depth_m.at(u, v) > 0) pixels.push_back(v * depth_m.width() + u);
    if (pixels.empty()) continue;
    const int middle = pixels[pixels.size() / 2];
    const float z_m = depth_m.data()[middle];
    const Eigen::Vector3f p_world =
        geometry.unproject(middle % depth_m.width(), middle / depth_m.width(), z_m);
    tiles.push_back({{p_world, z_m, 1}, std::move(pixels)});
  }
  return tiles;
}

bool ViewColours::blend(const std::vector<std::pair<float, const Chosen*>>& order,
                        const Eigen::Vector3f& p_world, Rgb8& colour) {
  Eigen::Array3f sum = Eigen::Array3f::Zero(), there;
  float weights = 0;
  int blended = 0;
  for (const auto& [its_cost, view] : order) {
    if (!look(*view, p_world, there)) continue;
    const float weight = 1 / (0.02F + its_cost);
    sum += weight * view->gain * there;
    weights += weight;
    if (++blended == kMostBlended) break;
  }
  if (blended > 0) colour = as_colour(sum / weights);
  return blended > 0;
}

void ViewColours::paint(const RgbdFrame& frame, const FrameGeometry& geometry,
                        const GreyImage& hidden, const SurfaceImage& surface, ColourImage& colour,
                        GreyImage& source) {
  const Eigen::Vector3f t_world_frame = geometry.T_world_camera().t().cast<float>();
  std::vector<Tile> tiles = tiles_of(geometry, surface);
  std::vector<Chosen> chosen = choose(tiles, t_world_frame);
  for (Chosen& view : chosen) find_gain(frame, geometry, hidden, view);
  std::vector<std::pair<float, const Chosen*>> order;
  for (const Tile& tile : tiles) {
    order.clear();
    for (const Chosen& view : chosen)
      order.emplace_back(cost(*view.view, tile.place, t_world_frame), &view);
    std::stable_sort(order.begin(), order.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const int pixel : tile.pixels) {
      const int u = pixel % hidden.width(), v = pixel / hidden.width();
      colour.at(u, v) = surface.colour.at(u, v);
      const bool is_seen =
          blend(order, geometry.unproject(u, v, surface.depth_m.at(u, v)), colour.at(u, v));
      source.at(u, v) = static_cast<std::uint8_t>(is_seen ? PixelSource::kView : PixelSource::kMap);
    }
  }
}

}  // namespace ygslam
