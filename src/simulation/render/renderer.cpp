#include "simulation/render/renderer.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"
#include "simulation/render/renderer_layers.hpp"

namespace ygslam::sim {

Renderer::Renderer(const Scene& scene, const Camera& camera, const RenderConfig& config)
    : scene_(scene),
      camera_(camera),
      config_(config),
      rays_(scene),
      pixel_angle_(static_cast<float>(1.0 / camera.fx())),
      pixel_angle_y_(static_cast<float>(1.0 / camera.fy())) {
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
  all_ = std::make_unique<Layer>(camera.width(), camera.height());
  if (config.static_view) fixed_ = std::make_unique<Layer>(camera.width(), camera.height());
}

Renderer::~Renderer() = default;

Renderer::Surface Renderer::surface_of(const Material& material) const {
  Surface surface;
  surface.first = &scene_.materials.texture(material.frames.at(0));
  if (material.frames.size() > 1) surface.frames = &material.frames;
  surface.tint = material.tint;
  if (material.tile_u_m != 0) surface.tiles_per_uv = {1 / material.tile_u_m, 1 / material.tile_v_m};
  surface.texels_per_m = 1 / material.texel_m;
  surface.glow = material.glow;
  surface.shine = material.shine;
  surface.ir_return = material.ir_return;
  return surface;
}

void Renderer::aim_tile(const Frame& frame, int u0, int v0, RayPacket& packet) const {
  const int width = camera_.width();
  const int height = camera_.height();
  for (int j = 0; j < kTile; ++j) {
    const int v = std::min(v0 + j, height - 1);
    const Eigen::Matrix3f& R = frame.R[frame.row(v)];
    const Vec3f& origin = frame.origin[frame.row(v)];
    const Eigen::Vector2f* tangents = tangent_.data() + static_cast<std::ptrdiff_t>(v) * width;
    for (int i = 0; i < kTile; ++i) {
      const int k = kTile * j + i;
      const Eigen::Vector2f& xy = tangents[std::min(u0 + i, width - 1)];
      packet.active[k] = u0 + i < width && v0 + j < height ? -1 : 0;
      packet.origin.x[k] = origin.x();
      packet.origin.y[k] = origin.y();
      packet.origin.z[k] = origin.z();
      packet.direction.x[k] = R(0, 0) * xy.x() + R(0, 1) * xy.y() + R(0, 2);
      packet.direction.y[k] = R(1, 0) * xy.x() + R(1, 1) * xy.y() + R(1, 2);
      packet.direction.z[k] = R(2, 0) * xy.x() + R(2, 1) * xy.y() + R(2, 2);
    }
  }
}

void Renderer::look_at(const RayPacket& packet, Seen& seen) const {
  rays_.surfaces(seen.hits, seen.surfaces);
  auto& [nx, ny, nz] = seen.surfaces.normal;
  const Vectors16& d = packet.direction;
  for (int k = 0; k < kLanes; ++k) {
    const float away = nx[k] * d.x[k] + ny[k] * d.y[k] + nz[k] * d.z[k];
    const float sign = away > 0 ? -1.0F : 1.0F;
    nx[k] *= sign;
    ny[k] *= sign;
    nz[k] *= sign;
    seen.point.x[k] = packet.origin.x[k] + seen.hits.distance[k] * d.x[k];
    seen.point.y[k] = packet.origin.y[k] + seen.hits.distance[k] * d.y[k];
    seen.point.z[k] = packet.origin.z[k] + seen.hits.distance[k] * d.z[k];
  }
  light_up(seen);
}

void Renderer::store(const Seen& seen, int u0, int v0, Layer& layer) {
  const auto put = [&](const auto& lanes, auto& plane) {
    for (int j = 0; j < kTile; ++j)
      std::memcpy(plane.row(v0 + j) + u0, lanes.lane + kTile * j, kTile * sizeof(lanes[0]));
  };
  put(seen.hits.object, layer.object);
  put(seen.hits.triangle, layer.triangle);
  put(seen.hits.distance, layer.distance);
  put(seen.surfaces.material, layer.material);
  put(seen.surfaces.normal.x, layer.nx);
  put(seen.surfaces.normal.y, layer.ny);
  put(seen.surfaces.normal.z, layer.nz);
  put(seen.surfaces.u, layer.u);
  put(seen.surfaces.v, layer.v);
  put(seen.point.x, layer.px);
  put(seen.point.y, layer.py);
  put(seen.point.z, layer.pz);
  put(seen.zone, layer.zone);
  put(seen.light, layer.light);
  put(seen.weight, layer.weight);
}

void Renderer::tell_truth(const Frame& frame, const RayPacket& packet, const Seen& seen, int u0,
                          int v0) const {
  View& view = *frame.view;
  const auto& [nx, ny, nz] = seen.surfaces.normal;
  const Vectors16& d = packet.direction;
  Floats16 facing, ir_return;
  std::int32_t highest = 0;
  for (int k = 0; k < kLanes; ++k) {
    const float length = std::sqrt(d.x[k] * d.x[k] + d.y[k] * d.y[k] + d.z[k] * d.z[k]);
    const float cosine = -(nx[k] * d.x[k] + ny[k] * d.y[k] + nz[k] * d.z[k]) / length;
    facing[k] = seen.hits.object[k] != Hits16::kNothing ? cosine : 0.0F;
    highest = std::max(highest, seen.hits.object[k]);
  }
  for (int k = 0; k < kLanes; ++k) {
    const auto& surface = surfaces_[static_cast<std::size_t>(seen.surfaces.material[k])];
    ir_return[k] = seen.hits.object[k] != Hits16::kNothing ? surface.ir_return : 0.0F;
  }
  const int columns = std::min(kTile, camera_.width() - u0);
  const int rows = std::min(kTile, camera_.height() - v0);
  for (int j = 0; j < rows; ++j) {
    const auto put = [&](const Floats16& lanes, Image<float>& image) {
      std::copy_n(lanes.lane + kTile * j, columns, image.row(v0 + j) + u0);
    };
    for (int i = 0; i < columns && config_.things; ++i) {
      const int k = kTile * j + i;
      if (seen.hits.object[k] == Hits16::kNothing) continue;
      view.things.at(u0 + i, v0 + j) =
          scene_.thing_ids[static_cast<std::size_t>(seen.hits.object[k])]
                          [static_cast<std::size_t>(seen.hits.triangle[k])];
    }
    put(seen.hits.distance, view.depth_m);  // rays have z = 1 in the camera frame
    put(facing, view.facing);
    put(ir_return, view.ir_return);
  }
  if (highest == 0 && !config_.flow) return;
  for (int k = 0; k < kLanes; ++k) tell_motion(frame, seen, k, u0 + k % kTile, v0 + k / kTile);
}

void Renderer::tell_motion(const Frame& frame, const Seen& seen, int k, int u, int v) const {
  const std::int32_t object = seen.hits.object[k];
  if (object == Hits16::kNothing) return;
  View& view = *frame.view;
  const Vec3f p(seen.point.x[k], seen.point.y[k], seen.point.z[k]);
  Vec3f p_before = p;
  if (object > 0) {
    view.ids.at(u, v) = scene_.movers[static_cast<std::size_t>(object - 1)].instance_id;
    p_before = rays_.point_before(seen.hits, k, p);
    if ((p_before - p).norm() >= static_cast<float>(config_.moving_m)) view.moving.at(u, v) = 255;
  }
  if (!config_.flow) return;
  const Vec3f p_camera = frame.R_before_world * p_before + frame.t_before_world;
  if (p_camera.z() < 0.05F) return;
  const Vec2 before_px = camera_.distort(camera_.project(p_camera.cast<double>()));
  view.flow_px.at(u, v) =
      Eigen::Vector2f(static_cast<float>(u), static_cast<float>(v)) - before_px.cast<float>();
}

void Renderer::trace_blocks(const Frame& frame, int block_row) {
  RayPacket packet;
  packet.reach.fill(kReach_m);
  Seen seen, behind;
  const int end = std::min(camera_.height(), (block_row + 1) * kBlock);
  std::uint8_t* const movers =
      all_->block_mover.data() + static_cast<std::ptrdiff_t>(block_row) * blocks_across();
  std::fill(movers, movers + blocks_across(), std::uint8_t{0});
  for (int v0 = block_row * kBlock; v0 < end; v0 += kTile) {
    for (int u0 = 0; u0 < camera_.width(); u0 += kTile) {
      aim_tile(frame, u0, v0, packet);
      rays_.intersect(packet, seen.hits, fixed_ ? &behind.hits : nullptr);
      look_at(packet, seen);
      store(seen, u0, v0, *all_);
      tell_truth(frame, packet, seen, u0, v0);
      if (!fixed_) continue;
      Ints16 on_mover;
      for (int k = 0; k < kLanes; ++k) on_mover[k] = seen.hits.object[k] > 0 ? 1 : 0;
      for (int k = 0; k < kLanes; ++k) {
        fixed_->changed.row(v0 + k / kTile)[u0 + k % kTile] =
            static_cast<std::uint8_t>(on_mover[k]);
        if (packet.active[k] != 0)
          frame.view->depth_static_m.at(u0 + k % kTile, v0 + k / kTile) = behind.hits.distance[k];
      }
      if (!any(on_mover)) continue;
      movers[u0 / kBlock] = 1;
      look_at(packet, behind);
      store(behind, u0, v0, *fixed_);
    }
  }
  light_blocks(block_row, true, *all_);
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
  frame.view = &view;
  view.colour = ColourImage(width, height);
  view.depth_m = DepthImage(width, height);
  view.ids = GreyImage(width, height);
  view.moving = GreyImage(width, height);
  if (config_.things) view.things = GreyImage(width, height);
  view.facing = Image<float>(width, height);
  view.ir_return = Image<float>(width, height);
  if (config_.flow) view.flow_px = Image<Eigen::Vector2f>(width, height, Eigen::Vector2f::Zero());
  if (fixed_) view.depth_static_m = DepthImage(width, height);
  const auto each_row_of_blocks = [&](const auto& pass) {
    parallel_for(blocks_down(), config_.threads, pass);
  };
  each_row_of_blocks([&](int row) { trace_blocks(frame, row); });
  each_row_of_blocks([&](int row) { light_blocks(row, false, *all_); });
  each_row_of_blocks([&](int row) { shade_blocks(frame, true, row); });
  if (fixed_) {
    view.colour_static = view.colour;  // where no mover has anything to do with it
    each_row_of_blocks([&](int row) { light_static_blocks(row, true); });
    each_row_of_blocks([&](int row) { light_static_blocks(row, false); });
    each_row_of_blocks([&](int row) { shade_blocks(frame, false, row); });
  }
  return view;
}

}  // namespace ygslam::sim
