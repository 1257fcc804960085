#include "simulation/sequence/sequence_source.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/rng.hpp"
#include "io/image_file.hpp"
#include "simulation/sequence/world_builder.hpp"

namespace ygslam::sim {

namespace {

constexpr std::int64_t kStart_ns = 1'000'000'000'000;  // a stamp of 1000 s

CameraConfig with_shutter(CameraConfig c, const SequenceOptions& options, double fps) {
  c.colour_readout_ms = 1e3 * options.rolling / fps;
  c.depth_readout_ms = 1e3 * options.depth_rolling.value_or(options.rolling) / fps;
  c.depth_delay_ms = options.depth_delay_ms;
  c.shutter_known = true;
  return c;
}

CameraConfig scaled_intrinsics(CameraConfig c, const SequenceOptions& options) {
  const double sx = static_cast<double>(options.width) / c.width;
  const double sy = static_cast<double>(options.height) / c.height;
  c.fx *= sx;
  c.fy *= sy;
  c.cx = (c.cx + 0.5) * sx - 0.5;
  c.cy = (c.cy + 0.5) * sy - 0.5;
  c.width = options.width;
  c.height = options.height;
  if (options.distortion) {  // TUM freiburg1
    c.k1 = 0.2624;
    c.k2 = -0.9531;
    c.p1 = -0.0054;
    c.p2 = 0.0026;
    c.k3 = 1.1633;
  }
  return c;
}

/// Depth as a 16-bit file can hold it.
void quantise(DepthImage& depth_m, double scale) {
  const auto units = static_cast<float>(scale);
  for (float& d : depth_m) {
    const float raw = std::floor(d * units + 0.5F);
    d = raw > 0 && raw <= 65535 ? raw / units : 0;
  }
}

}  // namespace

struct SequenceSource::State {
  WorldConfig world;
  SequenceOptions options;
  double fps;
  int frames;
  Camera camera;
  CameraPath path;
  std::shared_ptr<const Scene> scene;
  Renderer renderer;
  Camera depth_lens;                         // `camera`, unless depth has one of its own
  std::unique_ptr<Renderer> depth_renderer;  // null where both images are of one camera
  FaultInjector faults;
  int index = 0;
  std::uint32_t delivered = 0;
  std::optional<SE3> T_world_given;   // where a caller put the camera
  std::optional<SE3> T_world_before;  // and where it was for the frame before

  State(WorldConfig w, SequenceOptions o, double frame_rate, double seconds,
        const CameraPathConfig& path_config, std::shared_ptr<const Scene> s)
      : world(std::move(w)),
        options(std::move(o)),
        fps(frame_rate),
        frames(std::max(1, static_cast<int>(std::lround(seconds * frame_rate)))),
        camera(with_shutter(scaled_intrinsics(world.intrinsics, options), options, frame_rate)),
        path(path_config),
        scene(std::move(s)),
        renderer(*scene, camera,
                 {.threads = options.threads,
                  .antialias = options.antialias,
                  .static_view = options.truth_static,
                  .flow = options.blur > 0,
                  .things = options.truth_things}),
        depth_lens(options.depth_camera ? Camera(options.depth_camera->camera) : camera),
        depth_renderer(options.depth_camera
                           ? std::make_unique<Renderer>(
                                 *scene, depth_lens,
                                 RenderConfig{.threads = options.threads, .antialias = false})
                           : nullptr),
        faults(options.faults, 1 / frame_rate, options.seed) {}

  [[nodiscard]] double time_of(int i) const { return static_cast<double>(i) / fps; }
  [[nodiscard]] SE3 pose_at(double t_s) const {
    return T_world_given ? *T_world_given : path.T_world_camera(t_s);
  }
  [[nodiscard]] static Timestamp stamp_of(double t_s) {
    const double us = std::round(t_s * 1e6);
    return {kStart_ns + static_cast<std::int64_t>(us) * 1000};
  }
  /// The exposure wanders slowly, as an automatic one does.
  [[nodiscard]] double exposure_at(double t_s) const {
    const double phase = 2 * std::numbers::pi * t_s;
    return world.exposure * (1 + options.exposure_drift * (0.7 * std::sin(0.11 * phase) +
                                                           0.3 * std::sin(0.37 * phase + 1)));
  }
  /// @param readout_ms from the first row to the last, t_s in the middle.
  [[nodiscard]] RowPoses row_poses(double t_s, double readout_ms, int height) const {
    if (readout_ms == 0) return {pose_at(t_s)};
    RowPoses poses;
    for (int v = 0; v < height; ++v) {
      const double share = (v + 0.5) / height - 0.5;
      poses.push_back(pose_at(t_s + share * readout_ms * 1e-3));
    }
    return poses;
  }
  [[nodiscard]] View view_at(double t_s, double readout_ms) {
    const double before_s = t_s - 1 / fps;
    return renderer.render(row_poses(t_s, readout_ms, camera.height()),
                           T_world_before.value_or(pose_at(before_s)), t_s, before_s);
  }
  /// What the depth camera sees where it is another.
  [[nodiscard]] View depth_view_at(double t_s) {
    const double depth_s = t_s + camera.config().depth_delay_ms * 1e-3;
    RowPoses poses = row_poses(depth_s, camera.config().depth_readout_ms, depth_lens.height());
    for (SE3& T_world_camera : poses)
      T_world_camera = T_world_camera * options.depth_camera->T_colour_depth;
    return depth_renderer->render(poses, poses.front(), depth_s, depth_s - 1 / fps);
  }
  [[nodiscard]] bool depth_is_seen_apart() const {
    const CameraConfig& c = camera.config();
    return c.depth_readout_ms != c.colour_readout_ms || c.depth_delay_ms != 0;
  }
  [[nodiscard]] SimulatedFrame render(int i, double t_s);
  /// @param depth what the depth camera sees; may be `view`.
  void add_noise(const View& view, const View& depth, ColourImage& colour, DepthImage& depth_m,
                 int i) const;
};

void SequenceSource::State::add_noise(const View& view, const View& depth, ColourImage& colour,
                                      DepthImage& depth_m, int i) const {
  const std::uint64_t seed =
      options.seed * 0x9e3779b97f4a7c15ULL + static_cast<std::uint64_t>(i) * 2;
  if (options.blur > 0)
    colour = motion_blurred(colour, view.flow_px, options.blur, options.threads);
  if (options.noise == NoiseKind::kKinect) {
    colour = noisy_colour(colour, ColourNoiseConfig{}, Rng(seed).next(), options.threads);
    depth_m =
        kinect_depth(depth, depth_lens, DepthNoiseConfig{}, Rng(seed + 1).next(), options.threads);
  } else {
    depth_m = depth.depth_m;
  }
  quantise(depth_m, depth_lens.config().depth_scale);
}

SimulatedFrame SequenceSource::State::render(int i, double t_s) {
  renderer.set_exposure(exposure_at(t_s));
  View view = view_at(t_s, camera.config().colour_readout_ms);
  if (depth_is_seen_apart()) {
    View depth =
        view_at(t_s + camera.config().depth_delay_ms * 1e-3, camera.config().depth_readout_ms);
    view.depth_m = std::move(depth.depth_m);
    view.facing = std::move(depth.facing);
    view.ir_return = std::move(depth.ir_return);
    view.depth_static_m = std::move(depth.depth_static_m);
  }
  SimulatedFrame out;
  out.index = i;
  out.t_s = t_s;
  out.T_world_camera = pose_at(t_s);
  auto frame = std::make_shared<RgbdFrame>();
  ColourImage colour = std::move(view.colour);
  DepthImage depth_m;
  if (depth_renderer) {
    add_noise(view, depth_view_at(t_s), colour, depth_m, i);
  } else {
    add_noise(view, view, colour, depth_m, i);
  }
  out.delivery = faults.apply(i, t_s, stamp_of(t_s), colour, depth_m);
  frame->stamp = out.delivery.stamp;
  frame->grey = grey_from_colour(colour);
  frame->colour = std::move(colour);
  frame->depth_m = std::move(depth_m);
  const Delivery& d = out.delivery;
  if (d.frame && d.colour && d.depth) frame->id = FrameId{delivered++};
  out.frame = std::move(frame);
  out.depth_true_m = std::move(view.depth_m);
  out.ids = std::move(view.ids);
  out.moving = std::move(view.moving);
  out.things = std::move(view.things);
  out.rgb_static = std::move(view.colour_static);
  out.depth_static_m = std::move(view.depth_static_m);
  return out;
}

SequenceSource::SequenceSource(std::unique_ptr<State> state) : state_(std::move(state)) {}
SequenceSource::SequenceSource(SequenceSource&&) noexcept = default;
SequenceSource& SequenceSource::operator=(SequenceSource&&) noexcept = default;
SequenceSource::~SequenceSource() = default;

std::optional<SimulatedFrame> SequenceSource::next_with_losses() {
  if (state_->index >= state_->frames) return std::nullopt;
  const int i = state_->index++;
  return state_->render(i, state_->time_of(i));
}

SimulatedFrame SequenceSource::next_from(const SE3& T_world_camera, double t_s) {
  state_->T_world_before = std::exchange(state_->T_world_given, T_world_camera);
  return state_->render(state_->index++, t_s);
}

std::optional<SimulatedFrame> SequenceSource::next() {
  while (auto frame = next_with_losses()) {
    const Delivery& d = frame->delivery;
    if (d.frame && d.colour && d.depth) return frame;
  }
  return std::nullopt;
}

int SequenceSource::frame_count() const { return state_->frames; }
const Camera& SequenceSource::camera() const { return state_->camera; }
const std::optional<DepthCamera>& SequenceSource::depth_camera() const {
  return state_->options.depth_camera;
}
double SequenceSource::fps() const { return state_->fps; }
const WorldConfig& SequenceSource::world() const { return state_->world; }
const Scene& SequenceSource::scene() const { return *state_->scene; }
const CameraPath& SequenceSource::path() const { return state_->path; }
Timestamp SequenceSource::start() const { return {kStart_ns}; }
SE3 SequenceSource::T_world_camera(double t_s) const { return state_->path.T_world_camera(t_s); }

std::map<int, std::string> SequenceSource::instance_classes() const {
  std::map<int, std::string> classes;
  for (const Mover& mover : state_->scene->movers) classes[mover.instance_id] = mover.class_name;
  return classes;
}

std::vector<std::pair<std::string, SE3>> SequenceSource::mover_poses(double t_s) const {
  std::vector<std::pair<std::string, SE3>> poses;
  for (const Mover& mover : state_->scene->movers)
    poses.emplace_back(mover.name, mover.pose_at(t_s));
  return poses;
}

Result<SequenceSource> open_world(const WorldConfig& world, const SequenceOptions& options) {
  if (options.width < 16 || options.height < 16 || options.width > 4096 || options.height > 4096) {
    return Error{ErrorKind::kUsage, "image size must be 16x16 to 4096x4096"};
  }
  if (options.fps && (*options.fps < 1 || *options.fps > 240))
    return Error{ErrorKind::kUsage, "frame rate must be 1 to 240"};
  if (options.seconds && !(*options.seconds > 0 && *options.seconds <= 1e6)) {
    return Error{ErrorKind::kUsage, "seconds must be positive, at most a million"};
  }
  BuildOptions build;
  build.without_people = options.without_people || options.without_movers;
  build.without_movers = options.without_movers;
  build.texture_size = options.texture_size;
  build.seed = options.seed;
  build.threads = options.threads;
  Result<std::shared_ptr<const Scene>> scene = build_world(world, build);
  if (!scene) return scene.error();
  // The path is that of the whole sequence, however much of it is rendered.
  CameraPathConfig path = world.camera;
  path.seed = options.seed;
  return SequenceSource(std::make_unique<SequenceSource::State>(
      world, options, options.fps.value_or(world.fps), options.seconds.value_or(world.seconds),
      path, *scene));
}

Result<SequenceSource> open_world(const std::string& name_or_file, const SequenceOptions& options) {
  Result<WorldConfig> world = load_world(name_or_file);
  if (!world) return world.error();
  return open_world(*world, options);
}

}  // namespace ygslam::sim
