// Colours of surfaces a frame does not see, taken from the keyframes that do.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include "dense/background/frame_geometry.hpp"
#include "dense/background/mesh_view.hpp"
#include "dense/dense_map.hpp"
#include "image/rgbd_frame.hpp"

namespace ygslam {

/// Where a pixel of a picture comes from; the values are those of the written images.
enum class PixelSource : std::uint8_t {
  kFrame = 0,   ///< the frame's own
  kView = 64,   ///< depth of the map, colour of keyframes
  kMap = 128,   ///< depth and colour of the map
  kNever = 255  ///< hidden, and never seen: black, without depth
};

class ViewColours {
 public:
  /// @param views stay where they are as long as this lives.
  explicit ViewColours(const std::vector<DenseMap::PlacedView>& views);

  /// Gives hidden pixels with a surface their colour: that of the keyframes which see the surface
  /// from nearly the same place, as bright as the frame is beside it; else the mesh's.
  /// @param hidden not 0: not to be seen in the frame. @param colour, source written for the pixels
  /// with a surface.
  void paint(const RgbdFrame& frame, const FrameGeometry& geometry, const GreyImage& hidden,
             const SurfaceImage& surface, ColourImage& colour, GreyImage& source);

 private:
  struct View {
    const StoredView* stored = nullptr;
    Pinhole camera;
    Eigen::Matrix3f R_camera_world;
    Eigen::Vector3f t_camera_world, t_world_camera;
    Image<std::uint16_t> coarse;  // depth of a pixel of each tile, as DepthView has it; 0 = none
  };
  struct Loaded {
    std::size_t view = 0;
    DepthView images;  // no depth where excluded
  };
  struct Place {  // a hidden pixel that speaks for its tile
    Eigen::Vector3f p_world;
    float z_m = 0;         // in the frame
    float least_cost = 0;  // of the views chosen so far
  };
  struct Tile {
    Place place;
    std::vector<int> pixels;  // with a surface: offsets
  };
  struct Chosen {
    const View* view = nullptr;
    const DepthView* images = nullptr;
    float gain = 1;  // from the view's colours to the frame's
  };
  /// How unlike the frame's the view of a place is, 0 to 1; 1 if the view does not see it.
  [[nodiscard]] static float cost(const View& view, const Place& place,
                                  const Eigen::Vector3f& t_world_frame);
  [[nodiscard]] std::vector<Chosen> choose(std::vector<Tile>& tiles,
                                           const Eigen::Vector3f& t_world_frame);
  [[nodiscard]] const DepthView* load(std::size_t view);
  /// @return the view's colour of the point in `colour`; false where it does not see it.
  [[nodiscard]] static bool look(const Chosen& chosen, const Eigen::Vector3f& p_world,
                                 Eigen::Array3f& colour);
  [[nodiscard]] static std::vector<Tile> tiles_of(const FrameGeometry& geometry,
                                                  const SurfaceImage& surface);
  /// The colour of a point in the first views of the order that see it, by cost.
  /// @return false where none does.
  [[nodiscard]] static bool blend(const std::vector<std::pair<float, const Chosen*>>& order,
                                  const Eigen::Vector3f& p_world, Rgb8& colour);
  static void find_gain(const RgbdFrame& frame, const FrameGeometry& geometry,
                        const GreyImage& hidden, Chosen& chosen);

  std::vector<View> views_;
  std::deque<std::unique_ptr<Loaded>> loaded_;  // the last used first
};

}  // namespace ygslam
