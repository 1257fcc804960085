// The colours of a view: surfaces, the share of the lamps' light that reaches them, smooth edges.
#include <algorithm>
#include <cmath>

#include "simulation/render/renderer_layers.hpp"

namespace ygslam::sim {

namespace {

constexpr std::uint8_t kBlocks = kFixedBlocks | kMoversBlock;

std::uint8_t code_of(float linear) {
  const float code = 255.0F * std::sqrt(linear > 0 ? linear : 0.0F) + 0.5F;
  return static_cast<std::uint8_t>(code < 255.0F ? code : 255.0F);
}

}  // namespace

Vec3f Renderer::ray_direction(const Frame& frame, int column, int row, float right,
                              float down) const {
  const Eigen::Vector2f& centre =
      tangent_[static_cast<std::size_t>(row) * static_cast<std::size_t>(camera_.width()) + column];
  // Within a pixel the lens is as good as ideal.
  const float u = static_cast<float>(column) + right;
  const float v = static_cast<float>(row) + down;
  const float x = centre.x() + (u - static_cast<float>(column)) * pixel_angle_;
  const float y = centre.y() + (v - static_cast<float>(row)) * pixel_angle_y_;
  return frame.R[frame.row(row)] * Vec3f(x, y, 1);
}

void Renderer::radiance(const Frame& frame, const Seen& seen, const Vectors16& sight,
                        const Floats16& share, Colours16& colours) const {
  const auto& [nx, ny, nz] = seen.surfaces.normal;
  Floats16 footprint, per_m;
  for (int k = 0; k < kLanes; ++k) {
    const float x = sight.x[k];
    const float y = sight.y[k];
    const float z = sight.z[k];
    const float distance = std::sqrt(x * x + y * y + z * z);
    per_m[k] = 1 / (distance > 1e-6F ? distance : 1e-6F);
    const float cosine = -(nx[k] * x + ny[k] * y + nz[k] * z) * per_m[k];
    footprint[k] = 0.75F * distance * pixel_angle_ / std::sqrt(cosine > 0.15F ? cosine : 0.15F);
  }
  Floats16 glow;
  int shines = 0;
  for (int k = 0; k < kLanes; ++k) {
    const Surface& material = surfaces_[static_cast<std::size_t>(seen.surfaces.material[k])];
    const Texture* texture = material.first;
    if (material.frames != nullptr) {
      const auto count = static_cast<std::uint32_t>(material.frames->size());
      const auto shown = static_cast<std::uint32_t>(frame.video_frame) % count;
      texture = &scene_.materials.texture((*material.frames)[shown]);
    }
    const Light albedo = texture->sample(seen.surfaces.u[k] * material.tiles_per_uv.x(),
                                         seen.surfaces.v[k] * material.tiles_per_uv.y(),
                                         footprint[k] * material.texels_per_m);
    colours.r[k] = albedo[0] * material.tint.x();
    colours.g[k] = albedo[1] * material.tint.y();
    colours.b[k] = albedo[2] * material.tint.z();
    glow[k] = material.glow;
    shines |= material.shine > 0 ? 1 : 0;
  }
  const float ambient = scene_.ambient;
  for (int k = 0; k < kLanes; ++k) {
    const float sky = 0.80F + 0.20F * nz[k] + 0.08F * nx[k];
    const float light = ambient * sky + share[k] * seen.light[k] + glow[k];
    colours.r[k] *= light;
    colours.g[k] *= light;
    colours.b[k] *= light;
  }
  if (shines != 0) add_gloss(seen, sight, per_m, share, colours);
  const auto exposure = static_cast<float>(config_.exposure);
  for (int k = 0; k < kLanes; ++k) {
    const float seen_at_all = seen.hits.object[k] != Hits16::kNothing ? exposure : 0.0F;
    colours.r[k] *= seen_at_all;
    colours.g[k] *= seen_at_all;
    colours.b[k] *= seen_at_all;
  }
}

void Renderer::add_gloss(const Seen& seen, const Vectors16& sight, const Floats16& per_m,
                         const Floats16& share, Colours16& colours) const {
  for (int k = 0; k < kLanes; ++k) {
    const float shine = surfaces_[static_cast<std::size_t>(seen.surfaces.material[k])].shine;
    if (shine <= 0) continue;
    const Vec3f normal(seen.surfaces.normal.x[k], seen.surfaces.normal.y[k],
                       seen.surfaces.normal.z[k]);
    const Vec3f p(seen.point.x[k], seen.point.y[k], seen.point.z[k]);
    const Vec3f ray = Vec3f(sight.x[k], sight.y[k], sight.z[k]) * per_m[k];
    const Vec3f mirrored = ray - 2 * ray.dot(normal) * normal;
    const Lamps& lamps = lamps_[static_cast<std::size_t>(seen.zone[k])];
    float gloss = 0;
    for (int l = 0; l < lamps.count; ++l) {
      const Vec3f to = lamps.centre[static_cast<std::size_t>(l)] - p;
      const float towards = mirrored.dot(to);
      if (towards <= 0) continue;
      const float cosine2 = towards * towards / (to.squaredNorm() + 1e-6F);
      const float c8 = cosine2 * cosine2 * cosine2 * cosine2;
      gloss += c8 * c8;
    }
    gloss *= 0.8F * shine * share[k];
    colours.r[k] += gloss;
    colours.g[k] += gloss;
    colours.b[k] += gloss;
  }
}

namespace {

/// Whether all pixels whose light the 16 pixels share lie on one triangle, as on walls and floors.
bool is_one_face(const Plane<std::int32_t>& object, const Plane<std::int32_t>& triangle, int u0,
                 int row) {
  const std::int32_t o = object.row(row)[u0];
  const std::int32_t t = triangle.row(row)[u0];
  for (int v = row - 1; v < row + 3; ++v) {
    const std::int32_t* other = object.row(v) + u0 - 1;
    const std::int32_t* face = triangle.row(v) + u0 - 1;
    std::int32_t differs = 0;
    for (int k = 0; k < kLanes + 3; ++k) differs |= (other[k] ^ o) | (face[k] ^ t);
    if (differs != 0) return false;
  }
  return true;
}

/// Sums over the 4x4 windows of 16 pixels.
Floats16 sum_windows(const Plane<float>& plane, int u0, int row) {
  float column[kLanes + 4] = {};
  for (int v = row - 1; v < row + 3; ++v) {
    const float* values = plane.row(v) + u0 - 1;
    for (int k = 0; k < kLanes + 4; ++k) column[k] += values[k];
  }
  Floats16 sum;
  for (int k = 0; k < kLanes; ++k)
    sum[k] = (column[k] + column[k + 1]) + (column[k + 2] + column[k + 3]);
  return sum;
}

}  // namespace

void Renderer::share_of_light(const Layer& layer, int u0, int row, Floats16& share) const {
  // Any 4x4 window holds each of the 16 light samples once.
  Floats16 weight{}, arrived{};
  if (is_one_face(layer.object, layer.triangle, u0, row)) {
    weight = sum_windows(layer.weight, u0, row);
    arrived = sum_windows(layer.arrived, u0, row);
  } else {
    sum_same_surface(layer, u0, row, weight, arrived);
  }
  for (int k = 0; k < kLanes; ++k)
    share[k] = weight[k] > 0 ? arrived[k] / (weight[k] > 0 ? weight[k] : 1.0F) : 1.0F;
}

void Renderer::sum_same_surface(const Layer& layer, int u0, int row, Floats16& weight,
                                Floats16& arrived) {
  for (int half = 0; half < kLanes; half += 8) {
    const int first = u0 + half;
    const auto here = [&](const auto& plane) { return load8(plane.row(row) + first); };
    const Ints8 object = here(layer.object);
    const Ints8 triangle = here(layer.triangle);
    const Floats8 distance = here(layer.distance);
    const Floats8 nx = here(layer.nx);
    const Floats8 ny = here(layer.ny);
    const Floats8 nz = here(layer.nz);
    const Floats8 tolerance = 0.03F * distance;
    Floats8 could{}, did{};
    for (int v = row - 1; v < row + 3; ++v) {
      for (int u = first - 1; u < first + 3; ++u) {
        const auto there = [&](const auto& plane) { return load8(plane.row(v) + u); };
        const Floats8 turned = there(layer.nx) * nx + there(layer.ny) * ny + there(layer.nz) * nz;
        const Ints8 smooth =
            (absolute(there(layer.distance) - distance) <= tolerance) & (turned >= 0.85F);
        const Ints8 same =
            (there(layer.object) == object) & ((there(layer.triangle) == triangle) | smooth);
        could += where(same, there(layer.weight));
        did += where(same, there(layer.arrived));
      }
    }
    std::memcpy(weight.lane + half, &could, sizeof(could));
    std::memcpy(arrived.lane + half, &did, sizeof(did));
  }
}

void Renderer::shade_segment(const Frame& frame, const Layer& layer, int u0, int row,
                             Rgb8* pixels) const {
  Seen seen;
  const auto load = [&](const auto& plane, auto& lanes) {
    std::memcpy(lanes.lane, plane.row(row) + u0, sizeof(lanes.lane));
  };
  load(layer.object, seen.hits.object);
  load(layer.material, seen.surfaces.material);
  load(layer.zone, seen.zone);
  load(layer.nx, seen.surfaces.normal.x);
  load(layer.ny, seen.surfaces.normal.y);
  load(layer.nz, seen.surfaces.normal.z);
  load(layer.u, seen.surfaces.u);
  load(layer.v, seen.surfaces.v);
  load(layer.px, seen.point.x);
  load(layer.py, seen.point.y);
  load(layer.pz, seen.point.z);
  load(layer.light, seen.light);
  Floats16 share;
  if (BitsAround(layer.state, u0, row).any(kBlocks)) {
    share_of_light(layer, u0, row, share);
  } else {
    share.fill(1);
  }
  const Vec3f eye = frame.origin[frame.row(row)];
  const float ex = eye.x(), ey = eye.y(), ez = eye.z();
  Vectors16 sight;
  for (int k = 0; k < kLanes; ++k) {
    sight.x[k] = seen.point.x[k] - ex;
    sight.y[k] = seen.point.y[k] - ey;
    sight.z[k] = seen.point.z[k] - ez;
  }
  Colours16 colours;
  radiance(frame, seen, sight, share, colours);
  Lanes<std::uint8_t> r, g, b;
  for (int k = 0; k < kLanes; ++k) {
    r[k] = code_of(colours.r[k]);
    g[k] = code_of(colours.g[k]);
    b[k] = code_of(colours.b[k]);
  }
  const int count = std::min(kLanes, camera_.width() - u0);
  for (int k = 0; k < count; ++k) pixels[k] = {r[k], g[k], b[k]};
}

float Renderer::share_near(const Layer& layer, int u, int row, const Seen& seen, int lane) {
  const std::int32_t object = seen.hits.object[lane];
  const std::int32_t triangle = seen.hits.triangle[lane];
  const float distance = seen.hits.distance[lane];
  const float x = seen.surfaces.normal.x[lane];
  const float y = seen.surfaces.normal.y[lane];
  const float z = seen.surfaces.normal.z[lane];
  constexpr Ints8 kWindow = {-1, -1, -1, -1, -1, 0, 0, 0};  // five columns count
  Floats8 weight{}, arrived{};
  for (int v = row - 1; v <= row + 1; ++v) {
    const auto there = [&](const auto& plane) { return load8(plane.row(v) + u - 2); };
    const Floats8 turned = x * there(layer.nx) + y * there(layer.ny) + z * there(layer.nz);
    const Ints8 smooth =
        (absolute(there(layer.distance) - distance) < 0.04F * distance) & (turned > 0.85F);
    const Ints8 same =
        (there(layer.object) == object) & ((there(layer.triangle) == triangle) | smooth) & kWindow;
    weight += where(same, there(layer.weight));
    arrived += where(same, there(layer.arrived));
  }
  const float sum = weight[0] + weight[1] + weight[2] + weight[3] + weight[4];
  const float came = arrived[0] + arrived[1] + arrived[2] + arrived[3] + arrived[4];
  return sum > 0 ? came / sum : 1.0F;
}

void Renderer::find_edges(const Layer& layer, int u0, int row, Ints16& edge) const {
  const auto differs = [&](int half, int du, int dv) {
    const auto here = [&](const auto& plane) { return load8(plane.row(row) + u0 + half); };
    const auto there = [&](const auto& plane) {
      return load8(plane.row(row + dv) + u0 + half + du);
    };
    const Ints8 other_object = here(layer.object) ^ there(layer.object);
    const Ints8 other_face = other_object | (here(layer.triangle) ^ there(layer.triangle));
    if (!any(other_face)) return Ints8{};
    const Ints8 other_part = other_object | (here(layer.material) ^ there(layer.material));
    const Floats8 d = here(layer.distance);
    const Floats8 d2 = there(layer.distance);
    const Floats8 nearer = d < d2 ? d : d2;
    const Floats8 turned = here(layer.nx) * there(layer.nx) + here(layer.ny) * there(layer.ny) +
                           here(layer.nz) * there(layer.nz);
    const Ints8 bends = (other_part != 0) | (absolute(d - d2) > 0.04F * nearer) | (turned < 0.8F);
    return (other_face != 0) & bends;
  };
  const int last_column = camera_.width() - 1;
  for (int half = 0; half < kLanes; half += 8) {
    constexpr Ints8 kCount = {0, 1, 2, 3, 4, 5, 6, 7};
    const Ints8 column = kCount + (u0 + half);
    Ints8 found =
        (differs(half, -1, 0) & (column > 0)) | (differs(half, 1, 0) & (column < last_column));
    if (row > 0) found |= differs(half, 0, -1);
    if (row + 1 < camera_.height()) found |= differs(half, 0, 1);
    found &= column <= last_column;
    std::memcpy(edge.lane + half, &found, sizeof(found));
  }
}

bool Renderer::smooth_segment(const Frame& frame, const Layer& layer, bool with_movers, int u0,
                              int row, Rgb8* pixels) const {
  constexpr int kExtra = 2;  // beside the ray in the middle
  constexpr float kOffset[kExtra][2] = {{-0.33F, 0.2F}, {0.33F, -0.2F}};
  constexpr int kPixels = kLanes / kExtra;
  Ints16 edge;
  find_edges(layer, u0, row, edge);
  if (!any(edge)) return false;
  const BitsAround around(layer.state, u0, row);
  bool met_mover = false;
  int waiting[kPixels];
  int count = 0;
  const auto flush = [&] {
    RayPacket packet;
    packet.reach.fill(kReach_m);
    const Vec3f& eye = frame.origin[frame.row(row)];
    for (int k = 0; k < kLanes; ++k) {
      packet.active[k] = k < kExtra * count ? -1 : 0;
      const int column = u0 + waiting[std::min(k / kExtra, count - 1)];
      const Vec3f direction =
          ray_direction(frame, column, row, kOffset[k % kExtra][0], kOffset[k % kExtra][1]);
      packet.origin.x[k] = eye.x();
      packet.origin.y[k] = eye.y();
      packet.origin.z[k] = eye.z();
      packet.direction.x[k] = direction.x();
      packet.direction.y[k] = direction.y();
      packet.direction.z[k] = direction.z();
    }
    Seen seen;
    if (with_movers) {
      rays_.intersect(packet, seen.hits, nullptr);
    } else {
      rays_.intersect_fixed(packet, seen.hits);
    }
    look_at(packet, seen);
    Floats16 share;
    share.fill(1);
    Vectors16 sight;
    for (int k = 0; k < kLanes; ++k) {
      met_mover |= seen.hits.object[k] > 0;
      sight.x[k] = seen.point.x[k] - packet.origin.x[k];
      sight.y[k] = seen.point.y[k] - packet.origin.y[k];
      sight.z[k] = seen.point.z[k] - packet.origin.z[k];
      const int column = waiting[std::min(k / kExtra, count - 1)];
      if (packet.active[k] != 0 && (around.bits[column] & kBlocks) != 0)
        share[k] = share_near(layer, u0 + column, row, seen, k);
    }
    Colours16 colours;
    radiance(frame, seen, sight, share, colours);
    for (int n = 0; n < count; ++n) {
      Rgb8& pixel = pixels[waiting[n]];
      const auto mean = [&](std::uint8_t middle, const Floats16& extra) {
        float sum = linear_from_code(middle);
        for (int k = kExtra * n; k < kExtra * (n + 1); ++k) sum += extra[k];
        return code_of(sum / (kExtra + 1));
      };
      pixel = {mean(pixel.r, colours.r), mean(pixel.g, colours.g), mean(pixel.b, colours.b)};
    }
    count = 0;
  };
  for (int k = 0; k < kLanes; ++k) {
    if (edge[k] == 0) continue;
    waiting[count] = k;
    if (++count == kPixels) flush();
  }
  if (count > 0) flush();
  return met_mover;
}

void Renderer::shade_blocks(const Frame& frame, bool with_movers, int block_row) const {
  const Layer& layer = with_movers ? *all_ : *fixed_;
  ColourImage& colour = with_movers ? frame.view->colour : frame.view->colour_static;
  const int end = std::min(camera_.height(), (block_row + 1) * kBlock);
  for (int column = 0; column < blocks_across(); ++column) {
    const int u0 = column * kBlock;
    const std::size_t block = static_cast<std::size_t>(block_row) * blocks_across() + column;
    if (!with_movers && !is_touched(column, block_row, 1)) continue;
    for (int row = block_row * kBlock; row < end; ++row) {
      std::uint8_t& met = all_->segment_mover[block * kBlock + row % kBlock];
      Rgb8* pixels = colour.row(row) + u0;
      // As far as shadows are smoothed and edges drawn, what changed makes a difference.
      if (!with_movers && met == 0 && !BitsAround(layer.changed, u0, row).any(0xff)) continue;
      shade_segment(frame, layer, u0, row, pixels);
      const bool met_mover =
          config_.antialias && smooth_segment(frame, layer, with_movers, u0, row, pixels);
      if (!with_movers) continue;
      met = met_mover ? 1 : 0;
      if (met_mover) all_->block_mover[block] = 1;
    }
  }
}

}  // namespace ygslam::sim
