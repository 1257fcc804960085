#include "dense/background/background.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace ygslam {
namespace {

constexpr int kStep_px = 4;         // between the pixels that are looked at
constexpr double kLeastNew = 0.02;  // share of a frame's surface
constexpr int kLeastThrough = 3;    // views through a place that is known to be free
constexpr std::size_t kLeastCells =
    40;  // of kStep_px a side: smaller ones are thin objects of the room

/// Free, and nothing of the room in the cells around it.
bool is_known_free(const SpaceLayer& space, const Eigen::Vector3i& cell) {
  const SpaceCounts here = space.counts(cell);
  if (here.through < kLeastThrough || here.state() != SpaceState::kFree) return false;
  for (int i = 0; i < 27; ++i) {
    const Eigen::Vector3i beside(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    if (space.counts(cell + beside).state() == SpaceState::kOccupied) return false;
  }
  return true;
}

/// Clears parts that hang together by their sides and have fewer than kLeastCells.
void drop_small(GreyImage& cells) {
  GreyImage done(cells.width(), cells.height());
  std::vector<int> part;
  for (int start = 0; start < static_cast<int>(cells.size()); ++start) {
    if (cells.data()[start] == 0 || done.data()[start] != 0) continue;
    part.assign(1, start);
    done.data()[start] = 1;
    for (std::size_t next = 0; next < part.size(); ++next) {
      const int u = part[next] % cells.width(), v = part[next] / cells.width();
      for (const auto& [x, y] : {std::pair{u - 1, v}, {u + 1, v}, {u, v - 1}, {u, v + 1}}) {
        if (!cells.contains(x, y) || cells.at(x, y) == 0 || done.at(x, y) != 0) continue;
        done.at(x, y) = 1;
        part.push_back(y * cells.width() + x);
      }
    }
    if (part.size() >= kLeastCells) continue;
    for (const int cell : part) cells.data()[cell] = 0;
  }
}

/// 255 where something stands in space that the map knows as free, with nothing of the room near;
/// what is small is left out.
GreyImage intruders(const DepthImage& depth_m, const FrameGeometry& geometry,
                    const Volume& volume) {
  const double cell_m = volume.space().config().cell_m;
  const double farthest_m = volume.config().preparation.max_depth_m;
  GreyImage cells(depth_m.width() / kStep_px, depth_m.height() / kStep_px);
  for (int v = 0; v < cells.height(); ++v) {
    for (int u = 0; u < cells.width(); ++u) {
      const int at_u = u * kStep_px + kStep_px / 2, at_v = v * kStep_px + kStep_px / 2;
      const float z_m = depth_m.at(at_u, at_v);
      if (!(z_m > 0 && z_m < farthest_m)) continue;
      const Vec3 p_world = geometry.unproject(at_u, at_v, z_m).cast<double>();
      if (is_known_free(volume.space(), (p_world / cell_m).array().floor().cast<int>()))
        cells.at(u, v) = 255;
    }
  }
  drop_small(cells);
  GreyImage mask(depth_m.width(), depth_m.height());
  for (int v_px = 0; v_px < cells.height() * kStep_px; ++v_px)
    for (int u = 0; u < cells.width(); ++u)
      if (cells.at(u, v_px / kStep_px) != 0)
        std::fill_n(&mask.at(u * kStep_px, v_px), kStep_px, std::uint8_t{255});
  return mask;
}

}  // namespace

GreyImage hidden_pixels(const RgbdFrame& frame, const GreyImage& movers,
                        const FrameGeometry& geometry, const DenseMap& map) {
  GreyImage hidden = intruders(frame.depth_m, geometry, map.volume());
  if (!movers.empty()) {
    CHECK(movers.same_size(hidden));
    std::transform(hidden.begin(), hidden.end(), movers.begin(), hidden.begin(),
                   [](std::uint8_t a, std::uint8_t b) { return std::max(a, b); });
  }
  return dilated(hidden, map.config().margin_px);
}

bool add_what_is_new(const RgbdFrame& frame, const GreyImage& hidden, const FrameGeometry& geometry,
                     const ReadOut& read_out, DenseMap& map) {
  const VolumeConfig& config = map.volume().config();
  const DepthView view =
      make_depth_view({frame.depth_m, frame.colour, {}, hidden}, geometry.camera(), read_out);
  const SurfaceSample sample(view, config.preparation, kStep_px);
  const double is_new = sample.share_seen_less(map.config().reading.min_views,
                                               geometry.T_world_camera(), map.volume().surface());
  return is_new > kLeastNew && map.add(view, geometry.T_world_camera());
}

Background::Background(DenseMap& map)
    : mesh_(map.mesh()), thin_(map.views(), mesh_), colours_(map.views()) {}

BackgroundPicture Background::step(const RgbdFrame& frame, const GreyImage& hidden,
                                   const FrameGeometry& geometry) {
  SurfaceImage surface = mesh_.draw(geometry, hidden);
  thin_.draw(geometry, hidden, surface);
  BackgroundPicture picture{frame.colour, frame.depth_m,
                            GreyImage(hidden.width(), hidden.height())};
  for (std::size_t i = 0; i < hidden.size(); ++i) {
    if (hidden.data()[i] == 0) continue;
    picture.depth_m.data()[i] = surface.depth_m.data()[i];
    picture.colour.data()[i] = {};
    picture.source.data()[i] = static_cast<std::uint8_t>(PixelSource::kNever);
  }
  colours_.paint(frame, geometry, hidden, surface, picture.colour, picture.source);
  return picture;
}

}  // namespace ygslam
