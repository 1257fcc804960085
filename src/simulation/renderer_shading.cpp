// The light of a view: lamps, soft shadows, surfaces, smooth edges.
#include <algorithm>
#include <cmath>

#include "simulation/parallel.hpp"
#include "simulation/renderer_layers.hpp"

namespace ygslam::sim {

namespace {

/// Where in a 4x4 block of pixels each of the 16 light samples is taken (u + 4 v), so that any part
/// of the block holds well-spread samples, and the first half of them is a fine grid.
constexpr int kPlace[16] = {0, 10, 2, 8, 5, 15, 7, 13, 1, 11, 3, 9, 4, 14, 6, 12};

/// What the samples around say about one that has not been traced; 0 = they do not agree.
std::uint8_t guess(std::uint8_t near) {
  const int fixed = near & (kFixedLets | kFixedBlocks);
  const int movers = near & (kMoversLet | kMoversBlock);
  if (fixed == kFixedBlocks) return kFixedBlocks;
  if (fixed != kFixedLets || movers == (kMoversLet | kMoversBlock)) return 0;
  return static_cast<std::uint8_t>(fixed | movers);
}

Rgb8 pixel_of(const Light& linear) {
  const Eigen::Array4i code = (255.0F * linear.max(0.0F).sqrt() + 0.5F).min(255.0F).cast<int>();
  return {static_cast<std::uint8_t>(code[0]), static_cast<std::uint8_t>(code[1]),
          static_cast<std::uint8_t>(code[2])};
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

bool Renderer::prepare_light(std::size_t i, int sample, bool first, Layer& layer, RayPacket& packet,
                             int k) const {
  layer.weight[i] = layer.arrived[i] = layer.light[i] = 0;
  layer.state[i] = 0;
  if (layer.hits[i].object == RayHit::kNothing) return false;
  const Vec3f& normal = layer.surfaces[i].normal;
  const Lamps& lamps = lamps_[zone_at(layer.points[i])];
  Lanes contributions;
  layer.light[i] = light_sum(layer.points[i], normal, lamps, contributions);
  const float weight = contributions[lamps.sample_lamp[sample]];
  if (layer.light[i] <= 0 || weight <= 0) return false;
  layer.weight[i] = layer.arrived[i] = weight;
  if (!first) {
    layer.state[i] = guess(layer.near[i]);
    if ((layer.state[i] & (kFixedBlocks | kMoversBlock)) != 0) layer.arrived[i] = 0;
    if (layer.state[i] != 0) return false;
  }
  packet.origin[k] = layer.points[i] + 2e-3F * normal;
  packet.direction[k] = lamps.sample_point[sample] - packet.origin[k];
  return true;
}

void Renderer::copy_light(int row, const Layer& with_movers, Layer& layer) const {
  const std::size_t begin = static_cast<std::size_t>(row) * camera_.width();
  for (std::size_t i = begin; i < begin + camera_.width(); ++i) {
    if (layer.changed[i] != 0) continue;
    // The same surface, so the same light but for what the movers block.
    const std::uint8_t state = with_movers.state[i];
    layer.state[i] = state & (kFixedLets | kFixedBlocks);
    layer.weight[i] = with_movers.weight[i];
    layer.arrived[i] = (state & kFixedBlocks) != 0 ? 0.0F : with_movers.weight[i];
    layer.light[i] = with_movers.light[i];
    if ((state & kMoversBlock) != 0) layer.changed[i] = kOtherLight;
  }
}

bool Renderer::is_unchanged(const Layer& layer, int u0, int v0) const {
  const int width = camera_.width();
  const int columns = std::min(kLightBlock, width - u0);
  for (int v = v0; v < std::min(camera_.height(), v0 + kLightBlock); ++v) {
    const std::uint8_t* row = layer.changed.data() + static_cast<std::size_t>(v) * width + u0;
    if (std::find(row, row + columns, kOtherSurface) != row + columns) return false;
  }
  return true;
}

void Renderer::light_block(int block_row, bool first, const Layer* with_movers,
                           Layer& layer) const {
  const int width = camera_.width();
  const int v0 = block_row * kLightBlock;
  RayPacket packet;
  RayScene::Flags ask_movers, by_fixed, by_mover;
  packet.reach.fill(0.999F);
  ask_movers.fill(with_movers == nullptr);
  // Pixels four apart ask for the same point of the same lamp: such rays travel together.
  const auto pixel = [&](int u0, int sample, int k) {
    return std::pair(u0 + kPlace[sample] % 4 + 4 * (k % 4), v0 + kPlace[sample] / 4 + 4 * (k / 4));
  };
  const auto is_wanted = [&](int u, int v) {
    if (u >= width || v >= camera_.height()) return false;
    return with_movers == nullptr ||
           layer.changed[static_cast<std::size_t>(v) * width + u] == kOtherSurface;
  };
  for (int u0 = 0; u0 < width; u0 += kLightBlock) {
    if (with_movers != nullptr && is_unchanged(layer, u0, v0)) continue;
    for (int sample = first ? 0 : kSamples / 2; sample < (first ? kSamples / 2 : kSamples);
         ++sample) {
      bool any = false;
      for (int k = 0; k < kPacket; ++k) {
        const auto [u, v] = pixel(u0, sample, k);
        packet.origin[k] = packet.direction[k] = Vec3f::UnitZ();
        packet.active[k] = is_wanted(u, v) && prepare_light(static_cast<std::size_t>(v) * width + u,
                                                            sample, first, layer, packet, k);
        any |= packet.active[k];
      }
      if (!any) continue;
      rays_.occluded(packet, ask_movers, by_fixed, by_mover);
      for (int k = 0; k < kPacket; ++k) {
        if (!packet.active[k]) continue;
        const auto [u, v] = pixel(u0, sample, k);
        const std::size_t i = static_cast<std::size_t>(v) * width + u;
        layer.state[i] = by_fixed[k] ? kFixedBlocks : kFixedLets;
        if (!by_fixed[k]) layer.state[i] |= by_mover[k] ? kMoversBlock : kMoversLet;
        if (by_fixed[k] || by_mover[k]) layer.arrived[i] = 0;
      }
    }
  }
}

void Renderer::spread(const std::vector<std::uint8_t>& bits,
                      std::vector<std::uint8_t>& around) const {
  constexpr int kFar = 2;
  const int width = camera_.width();
  const int height = camera_.height();
  parallel_for((height + kLightBlock - 1) / kLightBlock, config_.threads, [&](int block) {
    std::vector<std::uint8_t> column(static_cast<std::size_t>(width + 2 * kFar));
    for (int row = block * kLightBlock; row < std::min(height, (block + 1) * kLightBlock); ++row) {
      std::fill(column.begin(), column.end(), std::uint8_t{0});
      std::uint8_t* __restrict middle = column.data() + kFar;
      for (int v = std::max(0, row - kFar); v <= std::min(height - 1, row + kFar); ++v) {
        const std::uint8_t* __restrict in = bits.data() + static_cast<std::size_t>(v) * width;
        for (int u = 0; u < width; ++u) middle[u] = static_cast<std::uint8_t>(middle[u] | in[u]);
      }
      std::uint8_t* __restrict out = around.data() + static_cast<std::size_t>(row) * width;
      const std::uint8_t* __restrict c = column.data();
      for (int u = 0; u < width; ++u)
        out[u] = static_cast<std::uint8_t>(c[u] | c[u + 1] | c[u + 2] | c[u + 3] | c[u + 4]);
    }
  });
}

Light Renderer::radiance(const Frame& frame, const SurfacePoint& surface, const Vec3f& p_world,
                         const Vec3f& sight, float distance, float visibility,
                         float light_sum_here) const {
  const Surface& material = surfaces_[surface.material];
  const Texture* texture = material.first;
  if (material.frames != nullptr) {
    const auto count = static_cast<std::uint32_t>(material.frames->size());
    const auto shown = static_cast<std::uint32_t>(frame.video_frame) % count;
    texture = &scene_.materials.texture((*material.frames)[shown]);
  }
  const float facing = std::max(0.15F, -surface.normal.dot(sight));
  const float footprint =
      0.75F * distance * pixel_angle_ * material.texels_per_m / std::sqrt(facing);
  const Light albedo =
      texture->sample(surface.uv.cwiseProduct(material.tiles_per_uv), footprint) * material.tint;
  const float direct = visibility * light_sum_here;
  const float sky = 0.80F + 0.20F * surface.normal.z() + 0.08F * surface.normal.x();
  Light light = albedo * (scene_.ambient * sky + direct + material.glow);
  if (material.shine > 0) {
    const Vec3f mirrored = sight - 2 * sight.dot(surface.normal) * surface.normal;
    const Lamps& lamps = lamps_[zone_at(p_world)];
    const Lanes x = lamps.x - p_world.x();
    const Lanes y = lamps.y - p_world.y();
    const Lanes z = lamps.z - p_world.z();
    const Lanes cosine = (mirrored.x() * x + mirrored.y() * y + mirrored.z() * z).max(0.0F) *
                         (x * x + y * y + z * z + 1e-6F).inverse().sqrt();
    const Lanes c4 = cosine.square().square();
    light += 0.8F * material.shine * visibility * (c4.square().square() * lamps.on).sum();
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
    const bool shadow_near = (layer.near[i] & (kFixedBlocks | kMoversBlock)) != 0;
    float weight = 0;
    float arrived = 0;
    // Any 4x4 window holds each of the 16 light samples once.
    for (int v = std::max(0, row - 1); shadow_near && v < std::min(height, row + 3); ++v) {
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
  const std::uint8_t near = layer.near[static_cast<std::size_t>(row) * width + u];
  if ((near & (kFixedBlocks | kMoversBlock)) == 0) return 1;
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
  RayScene::Hits hits;
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
    rays_.intersect(packet, target, hits, nullptr);
    for (int n = 0; n < count; ++n) {
      Rgb8& pixel = colour.at(waiting[n], row);
      Light sum(linear_from_code(pixel.r), linear_from_code(pixel.g), linear_from_code(pixel.b), 0);
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

}  // namespace ygslam::sim
