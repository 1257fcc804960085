// The arithmetic a network runs in.
#pragma once

namespace ygslam {

enum class Precision {
  kAuto,  ///< the fastest the processor has for the given model
  kF32,   ///< not for a quantised model
  kBf16,  ///< needs AVX512_BF16 or AMX; not for a quantised model
  kInt8,  ///< needs a quantised model
};

/// On these processors OpenVINO's results have been compared with those elsewhere. On others (ARM
/// with SVE, docs/install.md) they may be wrong.
#ifdef __x86_64__
inline constexpr bool kIsTriedProcessor = true;
#else
inline constexpr bool kIsTriedProcessor = false;
#endif

}  // namespace ygslam
