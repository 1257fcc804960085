// The light of a view: lamps, soft shadows, surfaces, smooth edges.
#include <algorithm>
#include <cmath>

#include "simulation/renderer_layers.hpp"

namespace ygslam::sim {

namespace {

/// Order in which the 16 light samples are spread over a 4x4 block, so that any part of the block
/// holds well-spread samples.
constexpr int kPattern[16] = {0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5};

std::uint8_t code_of(float linear) {
  return static_cast<std::uint8_t>(
      std::min(255.0F, 255.0F * std::sqrt(std::max(0.0F, linear)) + 0.5F));
}

Rgb8 pixel_of(const Vec3f& linear) {
  return {code_of(linear.x()), code_of(linear.y()), code_of(linear.z())};
}

}  // namespace

std::size_t Renderer::zone_at(const Vec3f& p_world) const {
  for (std::size_t i = 0; i < scene_.zones.size(); ++i) {
    const LightZone& zone = scene_.zones[i];
    if (p_world.x() >= zone.low.x() && p_world.y() >= zone.low.y() &&
        p_world.x() <= zone.high.x() && p_world.y() <= zone.high.y()) {
      return i;
    }
  }
  return 0;
}

float Renderer::light_sum(const Vec3f& p_world, const Vec3f& normal, const Lamps& lamps,
                          Lanes& contributions) const {
  const Lanes x = lamps.x - p_world.x();
  const Lanes y = lamps.y - p_world.y();
  const Lanes z = lamps.z - p_world.z();
  const Lanes inverse2 = (x * x + y * y + z * z + 0.05F).inverse();
  const Lanes inverse = inverse2.sqrt();
  // Lambert at the surface (wrapped a little, for the lamp is large), cosine emission.
  const Lanes facing =
      ((normal.x() * x + normal.y() * y + normal.z() * z) * inverse + 0.1F) * (1 / 1.1F);
  contributions = facing.max(0.0F) * (z * inverse).max(0.0F) * lamps.power * inverse2;
  return contributions.sum();
}

void Renderer::light_row(RayTarget target, int row, const Layer* with_movers, Layer& layer) const {
  const int width = camera_.width();
  RayPacket packet;
  std::array<bool, kPacket> blocked{};
  packet.reach.fill(0.999F);
  Lanes contributions;
  // Every fourth pixel of a row asks for the same point of the same lamp: such rays travel
  // together.
  const int groups = (width + 4 * kPacket - 1) / (4 * kPacket);
  for (int group = 0; group < 4 * groups; ++group) {
    const int u0 = group / 4 * 4 * kPacket + group % 4;
    for (int k = 0; k < kPacket; ++k) {
      const int u = u0 + 4 * k;
      packet.active[k] = false;
      if (u >= width) continue;
      const std::size_t i = static_cast<std::size_t>(row) * width + u;
      const bool known = with_movers != nullptr && layer.changed[i] == 0;
      if (known && with_movers->arrived[i] == with_movers->weight[i]) {
        // What no mover and no wall shades is not shaded by the walls alone.
        layer.weight[i] = with_movers->weight[i];
        layer.arrived[i] = with_movers->arrived[i];
        layer.light[i] = with_movers->light[i];
        continue;
      }
      layer.weight[i] = layer.arrived[i] = layer.light[i] = 0;
      if (layer.hits[i].object == RayHit::kNothing) continue;
      const Vec3f& normal = layer.surfaces[i].normal;
      const Lamps& lamps = lamps_[zone_at(layer.points[i])];
      const int count = lamps.count;
      layer.light[i] = light_sum(layer.points[i], normal, lamps, contributions);
      if (layer.light[i] <= 0) continue;
      const int sample = kPattern[(u & 3) + 4 * (row & 3)];
      const int which = sample % count;
      layer.weight[i] = layer.arrived[i] = contributions[which];
      if (contributions[which] <= 0) continue;
      // Samples of one lamp lie on a golden-ratio grid over its area.
      const AreaLight& light = scene_.lights[lamps.light[which]];
      const auto j = static_cast<float>(sample / count);
      const float n = static_cast<float>((16 + count - 1) / count);
      const float a = (j + 0.5F) / n * 2 - 1;
      const float b = std::fmod(0.25F + j * 0.618034F, 1.0F) * 2 - 1;
      const Vec3f p_light = light.centre + Vec3f(a * light.half_x_m, b * light.half_y_m, 0);
      packet.active[k] = true;
      packet.origin[k] = layer.points[i] + 2e-3F * normal;
      packet.direction[k] = p_light - packet.origin[k];
    }
    if (std::none_of(packet.active.begin(), packet.active.end(), [](bool a) { return a; }))
      continue;
    for (int k = 0; k < kPacket; ++k) {
      if (!packet.active[k]) packet.origin[k] = packet.direction[k] = Vec3f::UnitZ();
    }
    rays_.occluded(packet, target, blocked);
    for (int k = 0; k < kPacket; ++k) {
      if (!packet.active[k]) continue;
      const std::size_t i = static_cast<std::size_t>(row) * width + u0 + 4 * k;
      if (blocked[k]) layer.arrived[i] = 0;
      if (with_movers != nullptr && !blocked[k]) layer.changed[i] = 1;  // only a mover shaded it
    }
  }
}

Vec3f Renderer::radiance(const Frame& frame, const SurfacePoint& surface, const Vec3f& p_world,
                         const Vec3f& sight, float distance, float visibility,
                         float light_sum_here) const {
  const Material& material = scene_.materials.material(surface.material);
  const auto shown =
      material.frames[static_cast<std::size_t>(frame.video_frame) % material.frames.size()];
  const bool fitted = material.tile_u_m == 0;
  const Vec2f uv =
      fitted ? surface.uv
             : Vec2f(surface.uv.x() / material.tile_u_m, surface.uv.y() / material.tile_v_m);
  const float facing = std::max(0.15F, -surface.normal.dot(sight));
  const float footprint = 0.75F * distance * pixel_angle_ / (material.texel_m * std::sqrt(facing));
  const Vec3f albedo =
      scene_.materials.texture(shown).sample(uv, footprint).cwiseProduct(material.tint);
  const float direct = visibility * light_sum_here;
  const float sky = 0.80F + 0.20F * surface.normal.z() + 0.08F * surface.normal.x();
  Vec3f light = albedo * (scene_.ambient * sky + direct + material.glow);
  if (material.shine > 0) {
    const Vec3f mirrored = sight - 2 * sight.dot(surface.normal) * surface.normal;
    const Lamps& lamps = lamps_[zone_at(p_world)];
    for (int k = 0; k < lamps.count; ++k) {
      const Vec3f to_light = (Vec3f(lamps.x[k], lamps.y[k], lamps.z[k]) - p_world).normalized();
      const float c = std::max(0.0F, mirrored.dot(to_light));
      const float c8 = c * c * c * c * c * c * c * c;
      light.array() += material.shine * visibility * c8 * c8 * 0.8F;
    }
  }
  return light * static_cast<float>(config_.exposure);
}

void Renderer::shade_row(const Frame& frame, const Layer& layer, int row,
                         ColourImage& colour) const {
  const int width = camera_.width();
  const int height = camera_.height();
  for (int u = 0; u < width; ++u) {
    const std::size_t i = static_cast<std::size_t>(row) * width + u;
    if (layer.shade[i] == 0) continue;
    const RayHit& hit = layer.hits[i];
    if (hit.object == RayHit::kNothing) {
      colour.at(u, row) = {};
      continue;
    }
    const Vec3f& normal = layer.surfaces[i].normal;
    float weight = 0;
    float arrived = 0;
    // Any 4x4 window holds each of the 16 light samples once.
    for (int v = std::max(0, row - 1); v < std::min(height, row + 3); ++v) {
      for (int x = std::max(0, u - 1); x < std::min(width, u + 3); ++x) {
        const std::size_t j = static_cast<std::size_t>(v) * width + x;
        const RayHit& other = layer.hits[j];
        const bool same = other.triangle == hit.triangle && other.object == hit.object;
        if (!same && (other.object != hit.object ||
                      std::abs(other.distance - hit.distance) > 0.03F * hit.distance ||
                      layer.surfaces[j].normal.dot(normal) < 0.85F)) {
          continue;
        }
        weight += layer.weight[j];
        arrived += layer.arrived[j];
      }
    }
    const float visibility = weight > 0 ? arrived / weight : 1.0F;
    const Vec3f ray = layer.points[i] - frame.origin[frame.row(row)];
    const float distance = ray.norm();
    const Vec3f sight = ray / distance;
    colour.at(u, row) = pixel_of(radiance(frame, layer.surfaces[i], layer.points[i], sight,
                                          distance, visibility, layer.light[i]));
  }
}

float Renderer::visibility_near(const Layer& layer, int u, int row, const RayHit& hit,
                                const Vec3f& normal) const {
  const int width = camera_.width();
  float weight = 0;
  float arrived = 0;
  for (int v = std::max(0, row - 1); v <= std::min(camera_.height() - 1, row + 1); ++v) {
    for (int x = std::max(0, u - 2); x <= std::min(width - 1, u + 2); ++x) {
      const std::size_t j = static_cast<std::size_t>(v) * width + x;
      const RayHit& other = layer.hits[j];
      const bool same = other.object == hit.object &&
                        (other.triangle == hit.triangle ||
                         (layer.surfaces[j].normal.dot(normal) > 0.85F &&
                          std::abs(other.distance - hit.distance) < 0.04F * hit.distance));
      if (!same) continue;
      weight += layer.weight[j];
      arrived += layer.arrived[j];
    }
  }
  return weight > 0 ? arrived / weight : 1.0F;
}

bool Renderer::is_edge(const Layer& layer, int u, int row) const {
  const int width = camera_.width();
  const std::size_t i = static_cast<std::size_t>(row) * width + u;
  const RayHit& a = layer.hits[i];
  const auto differs = [&](std::size_t j) {
    const RayHit& b = layer.hits[j];
    if (a.object == b.object && a.triangle == b.triangle) return false;
    return a.object != b.object || layer.surfaces[i].material != layer.surfaces[j].material ||
           std::abs(a.distance - b.distance) > 0.04F * std::min(a.distance, b.distance) ||
           layer.surfaces[i].normal.dot(layer.surfaces[j].normal) < 0.8F;
  };
  return (u > 0 && differs(i - 1)) || (u + 1 < width && differs(i + 1)) ||
         (row > 0 && differs(i - width)) || (row + 1 < camera_.height() && differs(i + width));
}

void Renderer::smooth_edges_row(const Frame& frame, const Layer& layer, RayTarget target, int row,
                                ColourImage& colour) const {
  constexpr int kExtra = 2;  // beside the ray in the middle
  constexpr float kOffset[kExtra][2] = {{-0.33F, 0.2F}, {0.33F, -0.2F}};
  constexpr int kPixels = kPacket / kExtra;
  RayPacket packet;
  std::array<RayHit, kPacket> hits;
  packet.reach.fill(kReach_m);
  std::array<int, kPixels> waiting{};
  int count = 0;
  const auto flush = [&] {
    for (int k = 0; k < kPacket; ++k) {
      packet.active[k] = k < kExtra * count;
      if (!packet.active[k]) continue;
      packet.origin[k] = frame.origin[frame.row(row)];
      packet.direction[k] =
          ray_direction(frame, static_cast<float>(waiting[k / kExtra]) + kOffset[k % kExtra][0],
                        static_cast<float>(row) + kOffset[k % kExtra][1]);
    }
    rays_.intersect(packet, target, true, hits);
    for (int n = 0; n < count; ++n) {
      Rgb8& pixel = colour.at(waiting[n], row);
      Vec3f sum(linear_from_code(pixel.r), linear_from_code(pixel.g), linear_from_code(pixel.b));
      for (int k = kExtra * n; k < kExtra * (n + 1); ++k) {
        if (hits[k].object == RayHit::kNothing) continue;
        SurfacePoint surface = rays_.surface(hits[k]);
        const Vec3f& ray = packet.direction[k];
        if (surface.normal.dot(ray) > 0) surface.normal *= -1;
        const float length = ray.norm();
        const Vec3f p_world = packet.origin[k] + hits[k].distance * ray;
        Lanes contributions;
        const float light =
            light_sum(p_world, surface.normal, lamps_[zone_at(p_world)], contributions);
        const float visibility = visibility_near(layer, waiting[n], row, hits[k], surface.normal);
        sum += radiance(frame, surface, p_world, ray / length, hits[k].distance * length,
                        visibility, light);
      }
      pixel = pixel_of(sum / (kExtra + 1));
    }
    count = 0;
  };
  for (int u = 0; u < camera_.width(); ++u) {
    if (layer.shade[static_cast<std::size_t>(row) * camera_.width() + u] == 0) continue;
    if (!is_edge(layer, u, row)) continue;
    waiting[count] = u;
    if (++count == kPixels) flush();
  }
  if (count > 0) flush();
}

void Renderer::mark_for_shading(int row, Layer& layer) const {
  constexpr int kReach = 2;  // shadows are smoothed, and edges drawn, over this far
  const int width = camera_.width();
  for (int u = 0; u < width; ++u) {
    std::uint8_t near = 0;
    for (int v = std::max(0, row - kReach); v <= std::min(camera_.height() - 1, row + kReach);
         ++v) {
      for (int x = std::max(0, u - kReach); x <= std::min(width - 1, u + kReach); ++x) {
        near |= layer.changed[static_cast<std::size_t>(v) * width + x];
      }
    }
    layer.shade[static_cast<std::size_t>(row) * width + u] = near;
  }
}

}  // namespace ygslam::sim
