// Many unsigned bytes at once: the vector unit of AVX2 or NEON, or plain loops with the same
// results. Include from .cpp files only.
#pragma once

#include <cstdint>

#if defined(__AVX2__)
#include <immintrin.h>

#include <bit>
#elif defined(__ARM_NEON)
#include <arm_neon.h>

#include <bit>
#else
#include <algorithm>
#include <array>
#endif

namespace ygslam {

#if defined(__AVX2__)

struct Bytes {
  static constexpr int kCount = 32;
  __m256i v;

  static Bytes zero() { return {_mm256_setzero_si256()}; }
  static Bytes all(std::uint8_t value) { return {_mm256_set1_epi8(static_cast<char>(value))}; }
  static Bytes load(const std::uint8_t* p) {
    return {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p))};
  }
  void store(std::uint8_t* p) const { _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), v); }

  friend Bytes min(Bytes a, Bytes b) { return {_mm256_min_epu8(a.v, b.v)}; }
  friend Bytes max(Bytes a, Bytes b) { return {_mm256_max_epu8(a.v, b.v)}; }
  /// 0 where b is greater.
  friend Bytes excess(Bytes a, Bytes b) { return {_mm256_subs_epu8(a.v, b.v)}; }
  /// The value where a <= b, 0 elsewhere.
  [[nodiscard]] Bytes where_at_most(Bytes a, Bytes b) const {
    return {_mm256_and_si256(_mm256_cmpeq_epi8(excess(a, b).v, _mm256_setzero_si256()), v)};
  }
  /// The value where a > b, 0 elsewhere.
  [[nodiscard]] Bytes where_greater(Bytes a, Bytes b) const {
    return {_mm256_andnot_si256(_mm256_cmpeq_epi8(excess(a, b).v, _mm256_setzero_si256()), v)};
  }
  [[nodiscard]] bool any() const { return _mm256_testz_si256(v, v) == 0; }
  /// Calls it with the place of each byte that is not 0, in order.
  template <typename Function>
  void for_each_set(Function&& call) const {
    const __m256i unset = _mm256_cmpeq_epi8(v, _mm256_setzero_si256());
    auto bits = ~static_cast<std::uint32_t>(_mm256_movemask_epi8(unset));
    for (; bits != 0; bits &= bits - 1) call(std::countr_zero(bits));
  }
};

#elif defined(__ARM_NEON)

struct Bytes {
  static constexpr int kCount = 16;
  uint8x16_t v;

  static Bytes zero() { return {vdupq_n_u8(0)}; }
  static Bytes all(std::uint8_t value) { return {vdupq_n_u8(value)}; }
  static Bytes load(const std::uint8_t* p) { return {vld1q_u8(p)}; }
  void store(std::uint8_t* p) const { vst1q_u8(p, v); }

  friend Bytes min(Bytes a, Bytes b) { return {vminq_u8(a.v, b.v)}; }
  friend Bytes max(Bytes a, Bytes b) { return {vmaxq_u8(a.v, b.v)}; }
  /// 0 where b is greater.
  friend Bytes excess(Bytes a, Bytes b) { return {vqsubq_u8(a.v, b.v)}; }
  /// The value where a <= b, 0 elsewhere.
  [[nodiscard]] Bytes where_at_most(Bytes a, Bytes b) const {
    return {vandq_u8(vcleq_u8(a.v, b.v), v)};
  }
  /// The value where a > b, 0 elsewhere.
  [[nodiscard]] Bytes where_greater(Bytes a, Bytes b) const {
    return {vandq_u8(vcgtq_u8(a.v, b.v), v)};
  }
  [[nodiscard]] bool any() const { return vmaxvq_u8(v) != 0; }
  /// Calls it with the place of each byte that is not 0, in order.
  template <typename Function>
  void for_each_set(Function&& call) const {
    // Four bits a byte.
    const uint8x8_t nibbles = vshrn_n_u16(vreinterpretq_u16_u8(vtstq_u8(v, v)), 4);
    std::uint64_t bits = vget_lane_u64(vreinterpret_u64_u8(nibbles), 0);
    while (bits != 0) {
      const int place = std::countr_zero(bits) / 4;
      call(place);
      bits &= ~(std::uint64_t{0xf} << (4 * place));
    }
  }
};

#else

struct Bytes {
  static constexpr int kCount = 16;
  std::array<std::uint8_t, kCount> v;

  template <typename Function>
  static Bytes each(Function&& value) {
    Bytes b;
    for (int i = 0; i < kCount; ++i) b.v[i] = static_cast<std::uint8_t>(value(i));
    return b;
  }
  static Bytes zero() { return all(0); }
  static Bytes all(std::uint8_t value) {
    return each([&](int) { return value; });
  }
  static Bytes load(const std::uint8_t* p) {
    return each([&](int i) { return p[i]; });
  }
  void store(std::uint8_t* p) const { std::copy(v.begin(), v.end(), p); }

  friend Bytes min(const Bytes& a, const Bytes& b) {
    return each([&](int i) { return a.v[i] < b.v[i] ? a.v[i] : b.v[i]; });
  }
  friend Bytes max(const Bytes& a, const Bytes& b) {
    return each([&](int i) { return a.v[i] > b.v[i] ? a.v[i] : b.v[i]; });
  }
  /// 0 where b is greater.
  friend Bytes excess(const Bytes& a, const Bytes& b) {
    return each([&](int i) { return a.v[i] > b.v[i] ? a.v[i] - b.v[i] : 0; });
  }
  /// The value where a <= b, 0 elsewhere.
  [[nodiscard]] Bytes where_at_most(const Bytes& a, const Bytes& b) const {
    return each([&](int i) { return a.v[i] <= b.v[i] ? v[i] : 0; });
  }
  /// The value where a > b, 0 elsewhere.
  [[nodiscard]] Bytes where_greater(const Bytes& a, const Bytes& b) const {
    return each([&](int i) { return a.v[i] > b.v[i] ? v[i] : 0; });
  }
  [[nodiscard]] bool any() const {
    return std::any_of(v.begin(), v.end(), [](std::uint8_t x) { return x != 0; });
  }
  /// Calls it with the place of each byte that is not 0, in order.
  template <typename Function>
  void for_each_set(Function&& call) const {
    for (int i = 0; i < kCount; ++i)
      if (v[i] != 0) call(i);
  }
};

#endif

}  // namespace ygslam
