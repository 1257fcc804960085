// Renders what a perfect camera sees, with the truth of every pixel.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "geometry/camera.hpp"
#include "image/image.hpp"
#include "simulation/ray_scene.hpp"

namespace ygslam::sim {

struct RenderConfig {
  int threads = 2;
  bool antialias = true;     ///< two more rays where surfaces meet
  bool static_view = false;  ///< also render the view without movers
  bool flow = false;         ///< also compute image motion (for motion blur)
  double moving_m = 0.005;   ///< a surface that moved this far since the previous frame moves
  double exposure = 1;
};

/// One look at the world; all images have the camera's size. Nothing here has sensor noise.
struct View {
  ColourImage colour;
  DepthImage depth_m;              ///< along the optical axis, 0 = nothing within reach
  GreyImage ids;                   ///< instance id of the mover, 0 = fixed scene
  GreyImage moving;                ///< 255 where the surface moved since the previous frame
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
  struct Layer;  // hits and light of one view, with or without movers
  struct Frame;  // what all passes of one frame share
  static constexpr int kMaxLights = 8;
  static constexpr int kSamples = 16;  // of the light, spread over 4x4 pixels
  using Lanes = Eigen::Array<float, kMaxLights, 1>;
  /// The lamps of a zone side by side; those that are missing have no power.
  struct Lamps {
    Lanes x = Lanes::Zero(), y = Lanes::Zero(), z = Lanes::Zero(), power = Lanes::Zero();
    int count = 0;
    Lanes on = Lanes::Zero();                 ///< 1 for a lamp, 0 for none
    std::array<int, kSamples> sample_lamp{};  ///< lane of each light sample
    std::array<Vec3f, kSamples> sample_point;
  };

  void trace_block(const Frame& frame, int block_row);
  void put_hit(const RayPacket& packet, int k, const RayHit& hit, std::size_t i,
               Layer& layer) const;
  /// Half of the light samples at a time: those of the second half are traced only where the
  /// first half left a doubt. @param with_movers for the static layer: what is known already.
  void light_block(int block_row, bool first, const Layer* with_movers, Layer& layer) const;
  /// Unshadowed light of a pixel and the ray of its sample. @return whether to trace it.
  bool prepare_light(std::size_t i, int sample, bool first, Layer& layer, RayPacket& packet,
                     int k) const;
  /// For the static layer: the light of the surfaces that are seen in both.
  void copy_light(int row, const Layer& with_movers, Layer& layer) const;
  [[nodiscard]] bool is_unchanged(const Layer& layer, int u0, int v0) const;
  void spread(const std::vector<std::uint8_t>& bits, std::vector<std::uint8_t>& around) const;
  void shade_row(const Frame& frame, const Layer& layer, int row, ColourImage& colour) const;
  void smooth_edges_row(const Frame& frame, const Layer& layer, RayTarget target, int row,
                        ColourImage& colour) const;
  /// Share of the lamps' light that reaches a surface, by the pixels around that lie on it.
  [[nodiscard]] float visibility_near(const Layer& layer, int u, int row, const RayHit& hit,
                                      const Vec3f& normal) const;
  [[nodiscard]] bool is_edge(const Layer& layer, int u, int row) const;
  void truth_row(const Frame& frame, const Layer& layer, int row, View& view) const;
  void light_layer(const Layer* with_movers, Layer& layer) const;
  void shade_layer(const Frame& frame, RayTarget target, const Layer& layer,
                   ColourImage& colour) const;
  /// A material, ready for the inner loop.
  struct Surface {
    const Texture* first = nullptr;
    const std::vector<std::uint16_t>* frames = nullptr;  ///< of a video; null otherwise
    Light tint = Light::Ones();
    Vec2f tiles_per_uv = Vec2f::Ones();
    float texels_per_m = 0;
    float glow = 0, shine = 0;
  };
  [[nodiscard]] Surface surface_of(const Material& material) const;
  [[nodiscard]] Lamps lamps_of(const LightZone& zone) const;
  [[nodiscard]] Vec3f ray_direction(const Frame& frame, float u, float v) const;
  [[nodiscard]] Light radiance(const Frame& frame, const SurfacePoint& surface,
                               const Vec3f& p_world, const Vec3f& sight, float distance,
                               float visibility, float light_sum_here) const;
  /// Unshadowed light of the lamps at a surface, each and in sum.
  [[nodiscard]] float light_sum(const Vec3f& p_world, const Vec3f& normal, const Lamps& lamps,
                                Lanes& contributions) const;
  [[nodiscard]] std::size_t zone_at(const Vec3f& p_world) const;

  const Scene& scene_;
  Camera camera_;
  RenderConfig config_;
  RayScene rays_;
  std::vector<Eigen::Vector2f> tangent_;  // (x, y) of every pixel's ray at z = 1, camera frame
  float pixel_angle_;                     // [rad]
  std::vector<Lamps> lamps_;              // per zone
  std::vector<Surface> surfaces_;         // per material
  std::unique_ptr<Layer> all_, fixed_;
};

}  // namespace ygslam::sim
