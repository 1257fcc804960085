// Renders what a perfect camera sees, with the truth of every pixel.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "geometry/camera.hpp"
#include "image/image.hpp"
#include "simulation/render/ray_scene.hpp"

namespace ygslam::sim {

struct RenderConfig {
  int threads = 2;
  bool antialias = true;     ///< two more rays where surfaces meet
  bool static_view = false;  ///< also render the view without movers
  bool flow = false;         ///< also compute image motion (for motion blur)
  bool things = false;       ///< also tell which thing each pixel shows
  double moving_m = 0.005;   ///< a surface that moved this far since the previous frame moves
  double exposure = 1;
};

/// One look at the world; all images have the camera's size. Nothing here has sensor noise.
struct View {
  ColourImage colour;
  DepthImage depth_m;              ///< along the optical axis, 0 = nothing within reach
  GreyImage ids;                   ///< instance id of the mover, 0 = fixed scene
  GreyImage moving;                ///< 255 where the surface moved since the previous frame
  GreyImage things;                ///< NamedThing::id, 0 = none; empty unless asked
  Image<float> facing;             ///< cosine between surface normal and line of sight
  Image<float> ir_return;          ///< share of a depth sensor's light that comes back
  Image<Eigen::Vector2f> flow_px;  ///< image motion since the previous frame; empty unless asked
  ColourImage colour_static;       ///< without movers; empty unless asked
  DepthImage depth_static_m;
};

/// The camera's pose per image row, for rolling exposure; one entry = the same for all rows.
using RowPoses = std::vector<SE3>;

class Renderer {
 public:
  /// The scene must outlive this.
  Renderer(const Scene& scene, const Camera& camera, const RenderConfig& config);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// @param T_world_camera pose at t_s (one, or one per row).
  /// @param T_world_before pose at before_s, for flow.
  [[nodiscard]] View render(const RowPoses& T_world_camera, const SE3& T_world_before, double t_s,
                            double before_s);

  /// Changes the exposure of later frames.
  void set_exposure(double exposure) { config_.exposure = exposure; }

 private:
  struct Seen;   // what 16 rays meet
  struct Layer;  // the picture with movers, or without
  struct Frame;  // what all passes of one frame share
  static constexpr int kMaxLights = 8;
  /// The lamps of a zone, and the points of them that are sampled, spread over 4x4 pixels.
  struct Lamps {
    int count = 0;
    std::array<Vec3f, kMaxLights> centre;
    std::array<float, kMaxLights> power{};
    std::array<int, kLanes> sample_lamp{};  ///< lamp of each light sample
    std::array<Vec3f, kLanes> sample_point;
    Ints16 lane_lamp{};  ///< lamp of the sample that a pixel of a tile takes
  };
  /// A material, ready for the inner loop.
  struct Surface {
    const Texture* first = nullptr;
    const std::vector<std::uint16_t>* frames = nullptr;  ///< of a video; null otherwise
    Vec3f tint = Vec3f::Ones();
    Vec2f tiles_per_uv = Vec2f::Ones();
    float texels_per_m = 0;
    float glow = 0, shine = 0, ir_return = 0;
  };
  struct Colours16 {
    Floats16 r, g, b;  ///< linear light
  };

  [[nodiscard]] Lamps lamps_of(const LightZone& zone) const;
  [[nodiscard]] Surface surface_of(const Material& material) const;
  [[nodiscard]] int blocks_across() const { return (camera_.width() + kLanes - 1) / kLanes; }
  [[nodiscard]] int blocks_down() const { return (camera_.height() + kLanes - 1) / kLanes; }

  // Pass 1: rays from the camera, the truth of their hits, the first half of the light samples.
  void trace_blocks(const Frame& frame, int block_row);
  void aim_tile(const Frame& frame, int u0, int v0, RayPacket& packet) const;
  /// Surfaces and light at hits.
  void look_at(const RayPacket& packet, Seen& seen) const;
  void light_up(Seen& seen) const;
  static void store(const Seen& seen, int u0, int v0, Layer& layer);
  void tell_truth(const Frame& frame, const RayPacket& packet, const Seen& seen, int u0,
                  int v0) const;
  void tell_motion(const Frame& frame, const Seen& seen, int lane, int u, int v) const;

  // Pass 2: the second half of the light samples, traced only where those around disagree.
  void light_blocks(int block_row, bool first, Layer& layer) const;
  /// The rays of one sample of a block, one from each of its 16 tiles.
  /// @param around what the samples of the first half around each pixel of the block say: where
  /// they agree nothing is traced. Null for the first half itself.
  /// @param with_movers false: they neither block nor are told of.
  void light_packet(int u0, int v0, int sample, const std::uint8_t* around, bool with_movers,
                    Layer& layer) const;
  void aim_at_lamps(const Layer& layer, int u0, int v0, int sample, RayPacket& packet) const;
  // The same without movers, where movers have anything to do with it; the rest is copied.
  void light_static_blocks(int block_row, bool first) const;
  void copy_block(int u0, int v0) const;
  /// Whether a mover or its shadow is in a block, or in one this many blocks away.
  [[nodiscard]] bool is_touched(int column, int row, int radius) const;

  // Pass 3: colours.
  void shade_blocks(const Frame& frame, bool with_movers, int block_row) const;
  void shade_segment(const Frame& frame, const Layer& layer, int u0, int row, Rgb8* pixels) const;
  /// @return whether a ray met a mover.
  bool smooth_segment(const Frame& frame, const Layer& layer, bool with_movers, int u0, int row,
                      Rgb8* pixels) const;
  void share_of_light(const Layer& layer, int u0, int row, Floats16& share) const;
  /// Light that could arrive and that does, of the pixels around each that lie on its surface.
  static void sum_same_surface(const Layer& layer, int u0, int row, Floats16& weight,
                               Floats16& arrived);
  /// The share for a ray beside the middle of a pixel, by the pixels around that lie on its
  /// surface.
  [[nodiscard]] static float share_near(const Layer& layer, int u, int row, const Seen& seen,
                                        int lane);
  /// Pixels beside which another surface begins: -1, others 0.
  void find_edges(const Layer& layer, int u0, int row, Ints16& edge) const;
  /// @param right, down [px] from the middle of the pixel, less than half.
  [[nodiscard]] Vec3f ray_direction(const Frame& frame, int column, int row, float right,
                                    float down) const;
  /// @param sight from the eye to the points, not normalised.
  void radiance(const Frame& frame, const Seen& seen, const Vectors16& sight, const Floats16& share,
                Colours16& colours) const;
  void add_gloss(const Seen& seen, const Vectors16& sight, const Floats16& per_m,
                 const Floats16& share, Colours16& colours) const;

  const Scene& scene_;
  Camera camera_;
  RenderConfig config_;
  RayScene rays_;
  std::vector<Eigen::Vector2f> tangent_;  // (x, y) of every pixel's ray at z = 1, camera frame
  float pixel_angle_;                     // [rad]
  float pixel_angle_y_;                   // [rad]
  std::vector<Lamps> lamps_;              // per zone
  std::vector<Surface> surfaces_;         // per material
  std::unique_ptr<Layer> all_, fixed_;
};

}  // namespace ygslam::sim
