// The arithmetic a network runs in.
#pragma once

namespace ygslam {

enum class Precision {
  kAuto,  ///< the fastest the processor has for the given model
  kF32,   ///< not for a quantised model
  kBf16,  ///< needs AVX512_BF16 or AMX; not for a quantised model
  kInt8,  ///< needs a quantised model
};

}  // namespace ygslam
