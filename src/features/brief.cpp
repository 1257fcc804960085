#include "features/brief.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace ygslam {

namespace {

constexpr int kLanes = 32;  // columns -15 .. 16 of the patch; the last has no weight

// Weights of the disc's pixels: 1 for the sum of a row, u for its first moment.
struct Disc {
  std::int16_t one[2 * kPatchRadius + 1][kLanes];
  std::int16_t u[2 * kPatchRadius + 1][kLanes];
};

constexpr Disc make_disc() {
  Disc disc{};
  for (int v = -kPatchRadius; v <= kPatchRadius; ++v) {
    for (int u = -kPatchRadius; u <= kPatchRadius; ++u) {
      if (u * u + v * v > kPatchRadius * (kPatchRadius + 1)) continue;
      disc.one[v + kPatchRadius][u + kPatchRadius] = 1;
      disc.u[v + kPatchRadius][u + kPatchRadius] = static_cast<std::int16_t>(u);
    }
  }
  return disc;
}
constexpr Disc kDisc = make_disc();

}  // namespace

float Orientation::angle_rad() const {
  constexpr float kTurn = 2 * std::numbers::pi_v<float>;
  const float angle = std::atan2(sine, cosine);
  if (angle >= 0) return angle;
  return angle + kTurn < kTurn ? angle + kTurn : 0.0F;
}

Orientation patch_orientation(const std::uint8_t* pixel, int stride) {
  int m10 = 0;
  int m01 = 0;
  for (int v = 0; v < 2 * kPatchRadius + 1; ++v) {
    const std::uint8_t* const row =
        pixel + static_cast<std::ptrdiff_t>(v - kPatchRadius) * stride - kPatchRadius;
    int sum = 0;
    for (int i = 0; i < kLanes; ++i) {
      const auto value = static_cast<std::int16_t>(row[i]);
      sum += value * kDisc.one[v][i];
      m10 += value * kDisc.u[v][i];
    }
    m01 += sum * (v - kPatchRadius);
  }
  if (m10 == 0 && m01 == 0) return {};
  const double norm = std::sqrt(double(m10) * m10 + double(m01) * m01);
  return {static_cast<float>(m10 / norm), static_cast<float>(m01 / norm)};
}

Brief::Brief(const std::array<BriefTest, 256>& tests) {
  for (std::size_t i = 0; i < 256; ++i) {
    u_[i] = tests[i].u1;
    v_[i] = tests[i].v1;
    u_[i + 256] = tests[i].u2;
    v_[i + 256] = tests[i].v2;
  }
}

Descriptor Brief::describe(const std::uint8_t* pixel, int stride,
                           const Orientation& orientation) const {
  constexpr float kShift = 32.5F;  // truncation of a positive number rounds
  const float c = orientation.cosine;
  const float s = orientation.sine;
  std::array<std::int32_t, 512> offset;
  for (std::size_t i = 0; i < 512; ++i) {
    const int du = static_cast<int>(c * u_[i] - s * v_[i] + kShift) - 32;
    const int dv = static_cast<int>(s * u_[i] + c * v_[i] + kShift) - 32;
    offset[i] = dv * stride + du;
  }
  Descriptor descriptor;
  for (std::size_t word = 0; word < 4; ++word) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < 64; ++i) {
      const std::size_t test = 64 * word + i;
      const std::uint64_t bit = pixel[offset[test]] < pixel[offset[test + 256]] ? 1 : 0;
      bits |= bit << i;
    }
    descriptor.bits[word] = bits;
  }
  return descriptor;
}

}  // namespace ygslam
