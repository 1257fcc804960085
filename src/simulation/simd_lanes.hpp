// Sixteen values side by side: what rays that travel together are computed in. Plain loops over
// them become vector instructions; no lane ever looks at another, so that a result does not depend
// on the company it was computed in.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace ygslam::sim {

inline constexpr int kLanes = 16;

template <typename T>
struct alignas(64) Lanes {
  T lane[kLanes];
  [[nodiscard]] T& operator[](int k) { return lane[k]; }
  [[nodiscard]] const T& operator[](int k) const { return lane[k]; }
  void fill(T value) {
    for (T& x : lane) x = value;
  }
};

using Floats16 = Lanes<float>;
using Ints16 = Lanes<std::int32_t>;

struct Vectors16 {
  Floats16 x, y, z;
};

/// Half of the lanes, as the machine holds them; for where the compiler does not see it itself.
using Floats8 = float __attribute__((vector_size(32)));
using Ints8 = std::int32_t __attribute__((vector_size(32)));

[[nodiscard]] inline Floats8 load8(const float* from) {
  Floats8 values;
  std::memcpy(&values, from, sizeof(values));
  return values;
}
[[nodiscard]] inline Ints8 load8(const std::int32_t* from) {
  Ints8 values;
  std::memcpy(&values, from, sizeof(values));
  return values;
}
[[nodiscard]] inline Floats8 absolute(Floats8 x) { return x < 0 ? -x : x; }
/// The value where the mask is set, 0 elsewhere.
[[nodiscard]] inline Floats8 where(Ints8 mask, Floats8 x) {
  return std::bit_cast<Floats8>(mask & std::bit_cast<Ints8>(x));
}

[[nodiscard]] inline bool any(Ints8 mask) {
  std::int64_t words[4];
  std::memcpy(words, &mask, sizeof(words));
  return (words[0] | words[1] | words[2] | words[3]) != 0;
}
/// Whether any lane is not 0.
[[nodiscard]] inline bool any(const Ints16& mask) {
  std::int32_t all = 0;
  for (int k = 0; k < kLanes; ++k) all |= mask[k];
  return all != 0;
}

}  // namespace ygslam::sim
