#include "simulation/random/random_frames.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

#include "core/rng.hpp"
#include "simulation/people/baked_bodies.hpp"
#include "simulation/random/random_scene.hpp"
#include "simulation/render/renderer.hpp"
#include "simulation/sensor/sensor_noise.hpp"

namespace ygslam::sim {

namespace {

constexpr std::size_t kAlbum = 3;  // pictures of earlier worlds that hang in the next one

/// A pinhole of 48 to 72 degrees across.
CameraConfig random_camera(const RandomFramesOptions& options, Rng& rng) {
  CameraConfig c;
  c.width = options.width;
  c.height = options.height;
  c.fx = rng.uniform(0.69, 1.12) * options.width;
  c.fy = c.fx * rng.uniform(0.99, 1.01);
  c.cx = 0.5 * (options.width - 1) + rng.uniform(-0.03, 0.03) * options.width;
  c.cy = 0.5 * (options.height - 1) + rng.uniform(-0.03, 0.03) * options.height;
  return c;
}

DepthNoiseConfig random_depth_noise(Rng& rng) {
  DepthNoiseConfig noise;
  noise.baseline_m = rng.uniform(0.03, 0.09);
  noise.disparity_step_px = rng.uniform(0.03, 0.25);
  noise.lateral_sigma_px = rng.uniform(0.15, 0.9);
  noise.min_m = rng.uniform(0.3, 0.7);
  noise.max_m = rng.uniform(4, 10);
  return noise;
}

/// One frame in sixteen has no depth in half of the image, outside a window, but for few pixels, or
/// anywhere. Who stands there cannot be seen in it: nobody is labelled.
void lose_depth(RandomFrame& frame, Rng& rng) {
  constexpr double kShare = 1.0 / 16;
  if (rng.uniform() >= kShare) return;
  const int width = frame.depth_m.width();
  const int height = frame.depth_m.height();
  const auto kind = rng.below(4);
  const int u0 = kind == 0 ? static_cast<int>(rng.below(2)) * width / 2 : width / 3;
  const int v0 = kind == 0 ? 0 : height / 3;
  const auto is_kept = [&](int u, int v) {
    if (kind == 0) return u >= u0 && u < u0 + width / 2;
    if (kind == 1) return u >= u0 && u < 2 * u0 && v >= v0 && v < 2 * v0;
    return kind == 2 && rng.uniform() < 0.04;
  };
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      if (is_kept(u, v)) continue;
      frame.depth_m.at(u, v) = 0;
      frame.people.at(u, v) = 0;
    }
  }
}

/// Whether there is enough to see: not a wall before the lens.
bool shows_something(const View& view) {
  std::size_t near = 0;
  for (std::size_t i = 0; i < view.depth_m.size(); ++i) {
    const float z = view.depth_m.data()[i];
    const int id = view.ids.data()[i];
    if (z < 0.45F && (id == 0 || id >= kFirstThing)) ++near;
  }
  return near < view.depth_m.size() * 2 / 5;
}

}  // namespace

struct RandomFrames::State {
  /// Everything of one world, in the order in which it must go away.
  struct World {
    std::unique_ptr<RandomScene> drawn;
    Camera camera;
    DepthNoiseConfig depth_noise;
    ColourNoiseConfig colour_noise;
    double blur;
    Renderer renderer;
    World(std::unique_ptr<RandomScene> scene, const CameraConfig& config,
          const DepthNoiseConfig& depth, const ColourNoiseConfig& colour, double exposure_share,
          int threads)
        : drawn(std::move(scene)),
          camera(config),
          depth_noise(depth),
          colour_noise(colour),
          blur(exposure_share),
          renderer(drawn->scene, camera, render_config(threads, exposure_share > 0)) {}
    static RenderConfig render_config(int threads, bool flow) {
      RenderConfig config;
      config.threads = threads;
      config.flow = flow;
      return config;
    }
  };

  RandomFramesOptions options;
  BodyModel baked;
  std::deque<ColourImage> album;
  std::unique_ptr<World> world;
  int world_index = -1;
  int shot = 0;

  void open_next_world() {
    ++world_index;
    shot = 0;
    Rng rng(options.seed * 0x9e3779b97f4a7c15ULL + static_cast<std::uint64_t>(world_index));
    Rng own(rng.next());
    auto drawn = draw_scene(baked, options.shots, {album.begin(), album.end()},
                            options.texture_size, options.threads, own);
    const CameraConfig camera = random_camera(options, own);
    const DepthNoiseConfig depth = random_depth_noise(own);
    ColourNoiseConfig colour;
    colour.sigma = own.uniform(0.5, 5);
    colour.optics = own.uniform(0, 1);
    const double blur = own.uniform() < 0.5 ? own.uniform(0.2, 1) : 0;
    world = std::make_unique<World>(std::move(drawn), camera, depth, colour, blur, options.threads);
  }

  /// @return nothing if the shot is worth nothing.
  std::optional<RandomFrame> take() {
    const Shot& s = world->drawn->shots[static_cast<std::size_t>(shot)];
    world->renderer.set_exposure(s.exposure);
    const View view =
        world->renderer.render({s.T_world_camera}, s.T_world_before, shot + 0.5, shot + 0.25);
    if (!shows_something(view)) return std::nullopt;
    Rng rng(options.seed * 131U + static_cast<std::uint64_t>(world_index) * 977U +
            static_cast<std::uint64_t>(shot));
    RandomFrame frame;
    frame.world = world_index;
    frame.shot = shot;
    frame.camera = world->camera.config();
    frame.colour = world->blur > 0
                       ? motion_blurred(view.colour, view.flow_px, world->blur, options.threads)
                       : view.colour;
    frame.colour = noisy_colour(frame.colour, world->colour_noise, rng.next(), options.threads);
    frame.depth_m =
        kinect_depth(view, world->camera, world->depth_noise, rng.next(), options.threads);
    frame.people = view.ids;
    std::size_t area = 0;
    for (std::uint8_t& id : frame.people) {
      if (id >= kFirstThing) id = 0;
      area += id > 0 ? 1 : 0;
    }
    // The first picture of the world with somebody in it goes on the walls of the next ones.
    if (area > frame.people.size() / 20 && pictures_of_world == 0) {
      album.push_back(view.colour);
      if (album.size() > kAlbum) album.pop_front();
      pictures_of_world = 1;
    }
    lose_depth(frame, rng);
    return frame;
  }
  int pictures_of_world = 0;
};

Result<RandomFrames> RandomFrames::open(const RandomFramesOptions& options) {
  if (std::min(options.width, options.height) < 64 ||
      std::max(options.width, options.height) > 4096 || options.shots < 1) {
    return Error{ErrorKind::kUsage, "random frames want 64x64 to 4096x4096 pixels"};
  }
  Result<BodyModel> baked = baked_bodies();
  if (!baked) return baked.error();
  auto state = std::make_unique<State>();
  state->options = options;
  state->baked = std::move(*baked);
  return RandomFrames(std::move(state));
}

RandomFrames::RandomFrames(std::unique_ptr<State> state) : state_(std::move(state)) {}
RandomFrames::RandomFrames(RandomFrames&&) noexcept = default;
RandomFrames& RandomFrames::operator=(RandomFrames&&) noexcept = default;
RandomFrames::~RandomFrames() = default;

RandomFrame RandomFrames::next() {
  State& s = *state_;
  for (;;) {
    if (s.world == nullptr || s.shot + 1 >= s.options.shots) {
      s.open_next_world();
      s.pictures_of_world = 0;
    } else {
      ++s.shot;
    }
    if (auto frame = s.take()) return std::move(*frame);
  }
}

}  // namespace ygslam::sim
