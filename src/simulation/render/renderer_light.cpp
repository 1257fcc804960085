// The lamps' light and the soft shadows: which of 16 points of the lamps a surface sees, spread
// over tiles of 4x4 pixels.
#include <algorithm>
#include <cmath>

#include "simulation/render/renderer_layers.hpp"

namespace ygslam::sim {

namespace {

constexpr std::uint8_t kFixedBits = kFixedLets | kFixedBlocks;
constexpr std::uint8_t kMoverBits = kMoversLet | kMoversBlock;
constexpr int kFirstHalf = kLanes / 2;
constexpr int kNobodyAsks = 1 << 8;  // in place of what movers do: no LightState bit, yet not 0

/// What the samples around a pixel say, for every pixel of a block.
struct BlockBits {
  std::uint8_t bits[kBlock][kBlock];
  BlockBits(const Plane<std::uint8_t>& plane, int u0, int v0) {
    for (int v = 0; v < kBlock; ++v) {
      const BitsAround around(plane, u0, v0 + v);
      std::copy(around.bits, around.bits + kBlock, bits[v]);
    }
  }
};

/// Pixel of a block that a lane stands for, where tile k asks for a light sample: pixels four apart
/// ask for the same point of the same lamp, and such rays travel together.
int column_of(int sample, int k) { return kPlace[sample] % kTile + kTile * (k % kTile); }
int row_of(int sample, int k) { return kPlace[sample] / kTile + kTile * (k / kTile); }

/// All that agree are believed; 0 if they do not.
int guess(int around, int lets, int blocks) {
  const int said = around & (lets | blocks);
  return said == (lets | blocks) ? 0 : said;
}

}  // namespace

Renderer::Lamps Renderer::lamps_of(const LightZone& zone) const {
  Lamps lamps;
  lamps.count = std::min(kMaxLights, static_cast<int>(zone.lights.size()));
  const auto lamp = [&](int k) -> const AreaLight& {
    return scene_.lights[zone.lights[static_cast<std::size_t>(k)]];
  };
  for (int k = 0; k < lamps.count; ++k) {
    lamps.centre[static_cast<std::size_t>(k)] = lamp(k).centre;
    lamps.power[static_cast<std::size_t>(k)] = lamp(k).power;
  }
  for (int sample = 0; sample < kLanes && lamps.count > 0; ++sample) {
    const int which = sample % lamps.count;
    // Samples of one lamp lie on a golden-ratio grid over its area, from the middle outwards: the
    // first half, by which the second is guessed, must not favour one side.
    const int of_lamp = (kLanes + lamps.count - 1) / lamps.count;
    const int step = (sample / lamps.count + 1) / 2;
    const int place = (of_lamp - 1) / 2 + (sample / lamps.count % 2 == 1 ? step : -step);
    const auto j = static_cast<float>(place);
    const auto n = static_cast<float>(of_lamp);
    const float a = (j + 0.5F) / n * 2 - 1;
    const float b = std::fmod(0.25F + j * 0.618034F, 1.0F) * 2 - 1;
    lamps.sample_lamp[static_cast<std::size_t>(sample)] = which;
    lamps.sample_point[static_cast<std::size_t>(sample)] =
        lamp(which).centre + Vec3f(a * lamp(which).half_x_m, b * lamp(which).half_y_m, 0);
    lamps.lane_lamp[kPlace[sample]] = which;
  }
  return lamps;
}

void Renderer::light_up(Seen& seen) const {
  const auto& [px, py, pz] = seen.point;
  const auto& [nx, ny, nz] = seen.surfaces.normal;
  seen.light.fill(0);
  seen.weight.fill(0);
  seen.zone.fill(0);
  // The first of the zones that hold a point counts; the first of all, where none does.
  for (int z = static_cast<int>(scene_.zones.size()) - 1; z >= 0; --z) {
    const LightZone& zone = scene_.zones[static_cast<std::size_t>(z)];
    const float low_x = zone.low.x(), low_y = zone.low.y();
    const float high_x = zone.high.x(), high_y = zone.high.y();
    for (int k = 0; k < kLanes; ++k) {
      const bool inside =
          (px[k] >= low_x) & (py[k] >= low_y) & (px[k] <= high_x) & (py[k] <= high_y);
      seen.zone[k] = inside ? z : seen.zone[k];
    }
  }
  for (int lane = 0; lane < kLanes; ++lane) {
    const int z = seen.zone[lane];
    const std::int32_t* const first = seen.zone.lane;
    if (std::find(first, first + lane, z) != first + lane) continue;  // seen to already
    const Lamps& lamps = lamps_[static_cast<std::size_t>(z)];
    for (int l = 0; l < lamps.count; ++l) {
      const Vec3f centre = lamps.centre[static_cast<std::size_t>(l)];
      const float power = lamps.power[static_cast<std::size_t>(l)];
      const float cx = centre.x(), cy = centre.y(), cz = centre.z();
      for (int k = 0; k < kLanes; ++k) {
        const float x = cx - px[k];
        const float y = cy - py[k];
        const float h = cz - pz[k];
        const float inverse2 = 1 / (x * x + y * y + h * h + 0.05F);
        const float inverse = std::sqrt(inverse2);
        // Lambert at the surface (wrapped a little, for the lamp is large), cosine emission.
        const float facing = ((nx[k] * x + ny[k] * y + nz[k] * h) * inverse + 0.1F) * (1 / 1.1F);
        const float emission = h * inverse;
        const float light =
            (facing > 0 ? facing : 0.0F) * (emission > 0 ? emission : 0.0F) * power * inverse2;
        const bool here = (seen.zone[k] == z) & (seen.hits.object[k] != Hits16::kNothing);
        const float lit = here ? light : 0.0F;
        seen.light[k] += lit;
        seen.weight[k] += lamps.lane_lamp[k] == l ? lit : 0.0F;
      }
    }
  }
}

void Renderer::aim_at_lamps(const Layer& layer, int u0, int v0, int sample,
                            RayPacket& packet) const {
  packet.reach.fill(0.999F);
  for (int k = 0; k < kLanes; ++k) {
    const int u = u0 + column_of(sample, k);
    const int v = v0 + row_of(sample, k);
    packet.origin.x[k] = layer.px.row(v)[u] + 2e-3F * layer.nx.row(v)[u];
    packet.origin.y[k] = layer.py.row(v)[u] + 2e-3F * layer.ny.row(v)[u];
    packet.origin.z[k] = layer.pz.row(v)[u] + 2e-3F * layer.nz.row(v)[u];
    const Vec3f& to = lamps_[static_cast<std::size_t>(layer.zone.row(v)[u])]
                          .sample_point[static_cast<std::size_t>(sample)];
    packet.direction.x[k] = to.x() - packet.origin.x[k];
    packet.direction.y[k] = to.y() - packet.origin.y[k];
    packet.direction.z[k] = to.z() - packet.origin.z[k];
  }
}

void Renderer::light_packet(int u0, int v0, int sample, const std::uint8_t* around,
                            bool with_movers, Layer& layer) const {
  RayPacket packet;
  Ints16 lit, by_fixed, by_movers, may_ask, blocked;
  for (int k = 0; k < kLanes; ++k)
    lit[k] = layer.weight.row(v0 + row_of(sample, k))[u0 + column_of(sample, k)] > 0 ? -1 : 0;
  for (int k = 0; k < kLanes; ++k) {
    const int said =
        around == nullptr ? 0 : around[row_of(sample, k) * kBlock + column_of(sample, k)];
    by_fixed[k] = guess(said, kFixedLets, kFixedBlocks);
    by_movers[k] = with_movers ? guess(said, kMoversLet, kMoversBlock) : kNobodyAsks;
    packet.active[k] = by_fixed[k] == 0 ? lit[k] : 0;
    may_ask[k] =
        (by_fixed[k] == 0) | ((by_fixed[k] == kFixedLets) & (by_movers[k] == 0)) ? lit[k] : 0;
  }
  if (any(may_ask)) aim_at_lamps(layer, u0, v0, sample, packet);
  if (any(packet.active)) {
    rays_.blocked_by_fixed(packet, blocked);
    for (int k = 0; k < kLanes; ++k) {
      const int found = blocked[k] != 0 ? kFixedBlocks : kFixedLets;
      by_fixed[k] = packet.active[k] != 0 ? found : by_fixed[k];
    }
  }
  for (int k = 0; k < kLanes; ++k)
    packet.active[k] = ((by_fixed[k] == kFixedLets) & (by_movers[k] == 0)) ? lit[k] : 0;
  if (any(packet.active)) {
    rays_.blocked_by_movers(packet, blocked);
    for (int k = 0; k < kLanes; ++k) {
      const int found = blocked[k] != 0 ? kMoversBlock : kMoversLet;
      by_movers[k] = packet.active[k] != 0 ? found : by_movers[k];
    }
  }
  int all = 0;
  for (int k = 0; k < kLanes; ++k) {
    const int u = u0 + column_of(sample, k);
    const int v = v0 + row_of(sample, k);
    const int state =
        lit[k] == 0 ? 0 : by_fixed[k] | (by_fixed[k] == kFixedLets ? by_movers[k] & kMoverBits : 0);
    all |= state;
    layer.state.row(v)[u] = static_cast<std::uint8_t>(state);
    if (around == nullptr) layer.state_first.row(v)[u] = static_cast<std::uint8_t>(state);
    layer.arrived.row(v)[u] =
        (state & (kFixedBlocks | kMoversBlock)) != 0 ? 0.0F : layer.weight.row(v)[u];
  }
  if ((all & kMoversBlock) != 0) {
    layer.block_mover[static_cast<std::size_t>(v0 / kBlock) * blocks_across() + u0 / kBlock] = 1;
  }
}

void Renderer::light_blocks(int block_row, bool first, Layer& layer) const {
  const int v0 = block_row * kBlock;
  for (int u0 = 0; u0 < camera_.width(); u0 += kBlock) {
    if (first) {
      for (int sample = 0; sample < kFirstHalf; ++sample)
        light_packet(u0, v0, sample, nullptr, true, layer);
    } else {
      const BlockBits around(layer.state_first, u0, v0);
      for (int sample = kFirstHalf; sample < kLanes; ++sample)
        light_packet(u0, v0, sample, &around.bits[0][0], true, layer);
    }
  }
}

bool Renderer::is_touched(int column, int row, int radius) const {
  for (int r = std::max(0, row - radius); r <= std::min(blocks_down() - 1, row + radius); ++r) {
    for (int c = std::max(0, column - radius); c <= std::min(blocks_across() - 1, column + radius);
         ++c) {
      if (all_->block_mover[static_cast<std::size_t>(r) * blocks_across() + c] != 0) return true;
    }
  }
  return false;
}

void Renderer::copy_block(int u0, int v0) const {
  const Layer& from = *all_;
  Layer& to = *fixed_;
  const auto copy_row = [&](int u, int v, int count) {
    const auto copy = [&](const auto& plane, auto& copied) {
      std::memcpy(copied.row(v) + u, plane.row(v) + u,
                  static_cast<std::size_t>(count) * sizeof(*plane.row(0)));
    };
    copy(from.object, to.object);
    copy(from.triangle, to.triangle);
    copy(from.material, to.material);
    copy(from.zone, to.zone);
    copy(from.distance, to.distance);
    copy(from.nx, to.nx);
    copy(from.ny, to.ny);
    copy(from.nz, to.nz);
    copy(from.px, to.px);
    copy(from.py, to.py);
    copy(from.pz, to.pz);
    copy(from.u, to.u);
    copy(from.v, to.v);
    copy(from.light, to.light);
    copy(from.weight, to.weight);
  };
  for (int v = v0; v < v0 + kBlock; v += kTile) {
    // Tiles with a mover have been traced without it.
    std::uint32_t changed[kBlock / kTile] = {};
    for (int j = 0; j < kTile; ++j) {
      std::uint32_t row[kBlock / kTile];
      std::memcpy(row, to.changed.row(v + j) + u0, sizeof(row));
      for (int i = 0; i < kBlock / kTile; ++i) changed[i] |= row[i];
    }
    const bool is_whole = (changed[0] | changed[1] | changed[2] | changed[3]) == 0;
    for (int j = 0; j < kTile; ++j) {
      if (is_whole) {
        copy_row(u0, v + j, kBlock);
        continue;
      }
      for (int i = 0; i < kBlock / kTile; ++i) {
        if (changed[i] == 0) copy_row(u0 + kTile * i, v + j, kTile);
      }
    }
  }
  for (int v = v0; v < v0 + kBlock; ++v) {
    const std::uint8_t* __restrict from_first = from.state_first.row(v) + u0;
    const std::uint8_t* __restrict from_state = from.state.row(v) + u0;
    const float* __restrict weight = to.weight.row(v) + u0;
    std::uint8_t* __restrict first = to.state_first.row(v) + u0;
    std::uint8_t* __restrict state = to.state.row(v) + u0;
    float* __restrict arrived = to.arrived.row(v) + u0;
    for (int u = 0; u < kBlock; ++u) {
      first[u] = from_first[u] & kFixedBits;
      state[u] = from_state[u] & kFixedBits;
      arrived[u] = (from_state[u] & kFixedBits) == kFixedBlocks ? 0.0F : weight[u];
    }
  }
}

void Renderer::light_static_blocks(int block_row, bool first) const {
  const int v0 = block_row * kBlock;
  const auto is_other = [&](int u0, int sample) {
    for (int k = 0; k < kLanes; ++k) {
      if (fixed_->changed.row(v0 + row_of(sample, k))[u0 + column_of(sample, k)] != 0) return true;
    }
    return false;
  };
  for (int column = 0; column < blocks_across(); ++column) {
    const int u0 = column * kBlock;
    // A block decides with those beside it in view; these need theirs, unchanged.
    if (first && is_touched(column, block_row, 2)) copy_block(u0, v0);
    if (!is_touched(column, block_row, 1)) continue;
    if (first) {
      for (int sample = 0; sample < kFirstHalf; ++sample) {
        if (is_other(u0, sample)) light_packet(u0, v0, sample, nullptr, false, *fixed_);
      }
      continue;
    }
    const BlockBits with(all_->state_first, u0, v0);
    const BlockBits without(fixed_->state_first, u0, v0);
    for (int sample = kFirstHalf; sample < kLanes; ++sample) {
      // As a whole or not at all: rays traced in other company may differ in the last bit.
      bool differs = is_other(u0, sample);
      for (int k = 0; k < kLanes && !differs; ++k) {
        const int u = column_of(sample, k);
        const int v = row_of(sample, k);
        differs = ((with.bits[v][u] ^ without.bits[v][u]) & kFixedBits) != 0;
      }
      if (differs) light_packet(u0, v0, sample, &without.bits[0][0], false, *fixed_);
    }
    for (int v = v0; v < v0 + kBlock; ++v) {
      std::uint8_t* changed = fixed_->changed.row(v);
      for (int u = u0; u < u0 + kBlock; ++u) {
        const bool same = (all_->arrived.row(v)[u] == fixed_->arrived.row(v)[u]) &
                          (all_->weight.row(v)[u] == fixed_->weight.row(v)[u]);
        changed[u] = static_cast<std::uint8_t>(changed[u] | (same ? 0 : 2));
      }
    }
  }
}

}  // namespace ygslam::sim
