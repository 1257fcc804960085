// Sixteen 16-bit integers at once: the vector unit of AVX2 or NEON, or plain loops with the same
// results. Include from .cpp files only.
#pragma once

#include <cstdint>

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#else
#include <array>
#include <cstdlib>
#endif

namespace ygslam {

#if defined(__AVX2__)

struct Words {
  __m256i v;

  static Words zero() { return {_mm256_setzero_si256()}; }
  static Words all(std::int16_t value) { return {_mm256_set1_epi16(value)}; }
  static Words load(const std::int16_t* p) {
    return {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p))};
  }
  static Words load_bytes(const std::uint8_t* p) {
    return {_mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)))};
  }
  void store(std::int16_t* p) const { _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), v); }

  friend Words operator+(Words a, Words b) { return {_mm256_add_epi16(a.v, b.v)}; }
  friend Words operator-(Words a, Words b) { return {_mm256_sub_epi16(a.v, b.v)}; }
  friend Words operator&(Words a, Words b) { return {_mm256_and_si256(a.v, b.v)}; }
  [[nodiscard]] Words shifted_left(int bits) const { return {_mm256_slli_epi16(v, bits)}; }
  [[nodiscard]] Words shifted_right(int bits) const { return {_mm256_srai_epi16(v, bits)}; }
  /// The product with a factor in 1/32768, rounded to nearest.
  [[nodiscard]] Words scaled(Words q15) const { return {_mm256_mulhrs_epi16(v, q15.v)}; }
  [[nodiscard]] Words magnitude() const { return {_mm256_abs_epi16(v)}; }
};

/// Running sums of products; each of its lanes holds 32 bits.
class Sums {
 public:
  void add_products(Words a, Words b) {
    lanes_ = _mm256_add_epi32(lanes_, _mm256_madd_epi16(a.v, b.v));
  }
  [[nodiscard]] std::int64_t total() const {
    const __m256i low = _mm256_cvtepi32_epi64(_mm256_castsi256_si128(lanes_));
    const __m256i high = _mm256_cvtepi32_epi64(_mm256_extracti128_si256(lanes_, 1));
    const __m256i four = _mm256_add_epi64(low, high);
    const __m128i two =
        _mm_add_epi64(_mm256_castsi256_si128(four), _mm256_extracti128_si256(four, 1));
    return _mm_extract_epi64(two, 0) + _mm_extract_epi64(two, 1);
  }

 private:
  __m256i lanes_ = _mm256_setzero_si256();
};

#elif defined(__ARM_NEON)

struct Words {
  int16x8_t low, high;

  static Words zero() { return all(0); }
  static Words all(std::int16_t value) { return {vdupq_n_s16(value), vdupq_n_s16(value)}; }
  static Words load(const std::int16_t* p) { return {vld1q_s16(p), vld1q_s16(p + 8)}; }
  static Words load_bytes(const std::uint8_t* p) {
    const uint8x16_t bytes = vld1q_u8(p);
    return {vreinterpretq_s16_u16(vmovl_u8(vget_low_u8(bytes))),
            vreinterpretq_s16_u16(vmovl_high_u8(bytes))};
  }
  void store(std::int16_t* p) const {
    vst1q_s16(p, low);
    vst1q_s16(p + 8, high);
  }

  friend Words operator+(Words a, Words b) {
    return {vaddq_s16(a.low, b.low), vaddq_s16(a.high, b.high)};
  }
  friend Words operator-(Words a, Words b) {
    return {vsubq_s16(a.low, b.low), vsubq_s16(a.high, b.high)};
  }
  friend Words operator&(Words a, Words b) {
    return {vandq_s16(a.low, b.low), vandq_s16(a.high, b.high)};
  }
  [[nodiscard]] Words shifted_left(int bits) const {
    const int16x8_t by = vdupq_n_s16(static_cast<std::int16_t>(bits));
    return {vshlq_s16(low, by), vshlq_s16(high, by)};
  }
  [[nodiscard]] Words shifted_right(int bits) const { return shifted_left(-bits); }
  /// The product with a factor in 1/32768, rounded to nearest.
  [[nodiscard]] Words scaled(Words q15) const {
    return {vqrdmulhq_s16(low, q15.low), vqrdmulhq_s16(high, q15.high)};
  }
  [[nodiscard]] Words magnitude() const { return {vabsq_s16(low), vabsq_s16(high)}; }
};

/// Running sums of products; each of its lanes holds 32 bits.
class Sums {
 public:
  void add_products(Words a, Words b) {
    low_ = vmlal_s16(low_, vget_low_s16(a.low), vget_low_s16(b.low));
    low_ = vmlal_high_s16(low_, a.low, b.low);
    high_ = vmlal_s16(high_, vget_low_s16(a.high), vget_low_s16(b.high));
    high_ = vmlal_high_s16(high_, a.high, b.high);
  }
  [[nodiscard]] std::int64_t total() const { return vaddlvq_s32(low_) + vaddlvq_s32(high_); }

 private:
  int32x4_t low_ = vdupq_n_s32(0);
  int32x4_t high_ = vdupq_n_s32(0);
};

#else

struct Words {
  std::array<std::int16_t, 16> v;

  template <typename Function>
  static Words each(Function&& value) {
    Words w;
    for (int i = 0; i < 16; ++i) w.v[i] = static_cast<std::int16_t>(value(i));
    return w;
  }
  static Words zero() { return all(0); }
  static Words all(std::int16_t value) {
    return each([&](int) { return value; });
  }
  static Words load(const std::int16_t* p) {
    return each([&](int i) { return p[i]; });
  }
  static Words load_bytes(const std::uint8_t* p) {
    return each([&](int i) { return p[i]; });
  }
  void store(std::int16_t* p) const {
    for (int i = 0; i < 16; ++i) p[i] = v[i];
  }

  friend Words operator+(const Words& a, const Words& b) {
    return each([&](int i) { return a.v[i] + b.v[i]; });
  }
  friend Words operator-(const Words& a, const Words& b) {
    return each([&](int i) { return a.v[i] - b.v[i]; });
  }
  friend Words operator&(const Words& a, const Words& b) {
    return each([&](int i) { return a.v[i] & b.v[i]; });
  }
  [[nodiscard]] Words shifted_left(int bits) const {
    return each([&](int i) { return v[i] * (1 << bits); });
  }
  [[nodiscard]] Words shifted_right(int bits) const {
    return each([&](int i) { return v[i] >> bits; });
  }
  /// The product with a factor in 1/32768, rounded to nearest.
  [[nodiscard]] Words scaled(const Words& q15) const {
    return each([&](int i) { return (v[i] * q15.v[i] + 0x4000) >> 15; });
  }
  [[nodiscard]] Words magnitude() const {
    return each([&](int i) { return std::abs(v[i]); });
  }
};

/// Running sums of products; each of its lanes holds 32 bits.
class Sums {
 public:
  void add_products(const Words& a, const Words& b) {
    for (int i = 0; i < 8; ++i)
      lanes_[i] += a.v[2 * i] * b.v[2 * i] + a.v[2 * i + 1] * b.v[2 * i + 1];
  }
  [[nodiscard]] std::int64_t total() const {
    std::int64_t sum = 0;
    for (const std::int32_t lane : lanes_) sum += lane;
    return sum;
  }

 private:
  std::array<std::int32_t, 8> lanes_{};
};

#endif

}  // namespace ygslam
