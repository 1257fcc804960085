#include "simulation/renderer.hpp"

#include <algorithm>
#include <cmath>

#include "simulation/parallel.hpp"
#include "simulation/renderer_layers.hpp"

namespace ygslam::sim {

Renderer::Renderer(const Scene& scene, const Camera& camera, const RenderConfig& config)
    : scene_(scene),
      camera_(camera),
      config_(config),
      rays_(scene),
      pixel_angle_(static_cast<float>(1.0 / camera.fx())) {
  const auto n =
      static_cast<std::size_t>(camera.width()) * static_cast<std::size_t>(camera.height());
  tangent_.resize(n);
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const Vec3 p = camera.unproject(camera.undistort(Vec2(u, v)), 1.0);
      tangent_[static_cast<std::size_t>(v) * camera.width() + u] = p.head<2>().cast<float>();
    }
  }
  for (const LightZone& zone : scene.zones) lamps_.push_back(lamps_of(zone));
  for (std::size_t id = 0; id < scene.materials.size(); ++id)
    surfaces_.push_back(surface_of(scene.materials.material(static_cast<MaterialId>(id))));
  all_ = std::make_unique<Layer>(n);
  if (config.static_view) fixed_ = std::make_unique<Layer>(n);
}

Renderer::~Renderer() = default;

Renderer::Lamps Renderer::lamps_of(const LightZone& zone) const {
  Lamps lamps;
  lamps.count = std::min(kMaxLights, static_cast<int>(zone.lights.size()));
  for (int k = 0; k < lamps.count; ++k) {
    const AreaLight& light = scene_.lights[zone.lights[static_cast<std::size_t>(k)]];
    lamps.x[k] = light.centre.x();
    lamps.y[k] = light.centre.y();
    lamps.z[k] = light.centre.z();
    lamps.power[k] = light.power;
    lamps.on[k] = 1;
  }
  for (int sample = 0; sample < kSamples && lamps.count > 0; ++sample) {
    const int which = sample % lamps.count;
    const AreaLight& light = scene_.lights[zone.lights[static_cast<std::size_t>(which)]];
    // Samples of one lamp lie on a golden-ratio grid over its area.
    const auto j = static_cast<float>(sample / lamps.count);
    const auto n = static_cast<float>((kSamples + lamps.count - 1) / lamps.count);
    const float a = (j + 0.5F) / n * 2 - 1;
    const float b = std::fmod(0.25F + j * 0.618034F, 1.0F) * 2 - 1;
    lamps.sample_lamp[sample] = which;
    lamps.sample_point[sample] = light.centre + Vec3f(a * light.half_x_m, b * light.half_y_m, 0);
  }
  return lamps;
}

Renderer::Surface Renderer::surface_of(const Material& material) const {
  Surface surface;
  surface.first = &scene_.materials.texture(material.frames.at(0));
  if (material.frames.size() > 1) surface.frames = &material.frames;
  surface.tint << material.tint.array(), 0;
  if (material.tile_u_m != 0) surface.tiles_per_uv = {1 / material.tile_u_m, 1 / material.tile_v_m};
  surface.texels_per_m = 1 / material.texel_m;
  surface.glow = material.glow;
  surface.shine = material.shine;
  return surface;
}

Vec3f Renderer::ray_direction(const Frame& frame, float u, float v) const {
  const int width = camera_.width();
  const int u0 = std::clamp(static_cast<int>(std::lround(u)), 0, width - 1);
  const int v0 = std::clamp(static_cast<int>(std::lround(v)), 0, camera_.height() - 1);
  const Eigen::Vector2f& centre = tangent_[static_cast<std::size_t>(v0) * width + u0];
  // Within a pixel the lens is as good as ideal.
  const float x = centre.x() + (u - static_cast<float>(u0)) * pixel_angle_;
  const float y =
      centre.y() + (v - static_cast<float>(v0)) * static_cast<float>(1.0 / camera_.fy());
  return frame.R[frame.row(v0)] * Vec3f(x, y, 1);
}

void Renderer::put_hit(const RayPacket& packet, int k, const RayHit& hit, std::size_t i,
                       Layer& layer) const {
  layer.hits[i] = hit;
  if (hit.object == RayHit::kNothing) return;
  layer.surfaces[i] = rays_.surface(hit);
  layer.points[i] = packet.origin[k] + hit.distance * packet.direction[k];
  if (layer.surfaces[i].normal.dot(packet.direction[k]) > 0) layer.surfaces[i].normal *= -1;
}

void Renderer::trace_block(const Frame& frame, int block_row) {
  const int width = camera_.width();
  const int v0 = kTile * block_row;
  RayPacket packet;
  RayScene::Hits hits, on_fixed;
  packet.reach.fill(kReach_m);
  for (int u0 = 0; u0 < width; u0 += kTile) {
    for (int k = 0; k < kPacket; ++k) {
      const int u = std::min(u0 + k % kTile, width - 1);
      const int v = std::min(v0 + k / kTile, camera_.height() - 1);
      packet.active[k] = u0 + k % kTile < width && v0 + k / kTile < camera_.height();
      packet.origin[k] = frame.origin[frame.row(v)];
      const Eigen::Vector2f& xy = tangent_[static_cast<std::size_t>(v) * width + u];
      packet.direction[k] = frame.R[frame.row(v)] * Vec3f(xy.x(), xy.y(), 1);
    }
    rays_.intersect(packet, RayTarget::kAll, hits, fixed_ ? &on_fixed : nullptr);
    for (int k = 0; k < kPacket; ++k) {
      if (!packet.active[k]) continue;
      const std::size_t i = static_cast<std::size_t>(v0 + k / kTile) * width + u0 + k % kTile;
      put_hit(packet, k, hits[k], i, *all_);
      if (!fixed_) continue;
      const bool on_mover = hits[k].object != 0 && hits[k].object != RayHit::kNothing;
      fixed_->changed[i] = on_mover ? kOtherSurface : kSame;
      if (on_mover) {
        put_hit(packet, k, on_fixed[k], i, *fixed_);
      } else {
        fixed_->hits[i] = all_->hits[i];
        fixed_->surfaces[i] = all_->surfaces[i];
        fixed_->points[i] = all_->points[i];
      }
    }
  }
}

void Renderer::truth_row(const Frame& frame, const Layer& layer, int row, View& view) const {
  const int width = camera_.width();
  const auto moving_m = static_cast<float>(config_.moving_m);
  for (int u = 0; u < width; ++u) {
    const std::size_t i = static_cast<std::size_t>(row) * width + u;
    const RayHit& hit = layer.hits[i];
    if (hit.object == RayHit::kNothing) continue;
    const Vec3f ray = layer.points[i] - frame.origin[frame.row(row)];
    view.depth_m.at(u, row) = hit.distance;  // rays have z = 1 in the camera frame
    view.facing.at(u, row) = -layer.surfaces[i].normal.dot(ray) / ray.norm();
    view.ir_return.at(u, row) = scene_.materials.material(layer.surfaces[i].material).ir_return;
    Vec3f p_before = layer.points[i];
    if (hit.object > 0) {
      view.ids.at(u, row) = scene_.movers[hit.object - 1].instance_id;
      p_before = rays_.point_before(hit, layer.points[i]);
      if ((p_before - layer.points[i]).norm() >= moving_m) view.moving.at(u, row) = 255;
    }
    if (!config_.flow) continue;
    const Vec3f p_camera = frame.R_before_world * p_before + frame.t_before_world;
    if (p_camera.z() < 0.05F) continue;
    const Vec2 before_px = camera_.distort(camera_.project(p_camera.cast<double>()));
    view.flow_px.at(u, row) =
        Eigen::Vector2f(static_cast<float>(u), static_cast<float>(row)) - before_px.cast<float>();
  }
}

void Renderer::light_layer(const Layer* with_movers, Layer& layer) const {
  const int blocks = (camera_.height() + kLightBlock - 1) / kLightBlock;
  if (with_movers != nullptr) {
    parallel_for(camera_.height(), config_.threads,
                 [&](int v) { copy_light(v, *with_movers, layer); });
  }
  for (const bool first : {true, false}) {
    parallel_for(blocks, config_.threads,
                 [&](int block) { light_block(block, first, with_movers, layer); });
    spread(layer.state, layer.near);
  }
}

void Renderer::shade_layer(const Frame& frame, RayTarget target, const Layer& layer,
                           ColourImage& colour) const {
  parallel_for(camera_.height(), config_.threads, [&](int v) {
    shade_row(frame, layer, v, colour);
    if (config_.antialias) smooth_edges_row(frame, layer, target, v, colour);
  });
}

View Renderer::render(const RowPoses& T_world_camera, const SE3& T_world_before, double t_s,
                      double before_s) {
  CHECK(T_world_camera.size() == 1 || static_cast<int>(T_world_camera.size()) == camera_.height());
  rays_.set_time(t_s, before_s, config_.threads);
  Frame frame;
  for (const SE3& T : T_world_camera) {
    frame.R.push_back(T.R().cast<float>());
    frame.origin.push_back(T.t().cast<float>());
  }
  const SE3 T_before_world = T_world_before.inverse();
  frame.R_before_world = T_before_world.R().cast<float>();
  frame.t_before_world = T_before_world.t().cast<float>();
  frame.video_frame = static_cast<int>(std::floor(std::max(0.0, t_s) * 10 + 1e-6));

  const int width = camera_.width();
  const int height = camera_.height();
  View view;
  view.colour = ColourImage(width, height);
  view.depth_m = DepthImage(width, height);
  view.ids = GreyImage(width, height);
  view.moving = GreyImage(width, height);
  view.facing = Image<float>(width, height);
  view.ir_return = Image<float>(width, height);
  if (config_.flow) view.flow_px = Image<Eigen::Vector2f>(width, height, Eigen::Vector2f::Zero());
  parallel_for((height + kTile - 1) / kTile, config_.threads,
               [&](int block) { trace_block(frame, block); });
  light_layer(nullptr, *all_);
  shade_layer(frame, RayTarget::kAll, *all_, view.colour);
  parallel_for(height, config_.threads, [&](int v) { truth_row(frame, *all_, v, view); });
  if (config_.static_view) {
    view.colour_static = view.colour;  // where no mover has anything to do with it
    view.depth_static_m = DepthImage(width, height);
    light_layer(all_.get(), *fixed_);
    spread(fixed_->changed, fixed_->shade);  // as far as shadows are smoothed and edges drawn
    shade_layer(frame, RayTarget::kFixedOnly, *fixed_, view.colour_static);
    for (std::size_t i = 0; i < fixed_->hits.size(); ++i) {
      if (fixed_->hits[i].object != RayHit::kNothing)
        view.depth_static_m.data()[i] = fixed_->hits[i].distance;
    }
  }
  return view;
}

}  // namespace ygslam::sim
