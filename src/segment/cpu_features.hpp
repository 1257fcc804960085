// What this processor can do with bfloat16.
#pragma once

namespace ygslam {

enum class Bf16 {
  kNone,
  kSlow,  ///< AVX512_BF16 on Intel without AMX: f32 is quicker (measured for YOLOv8n-seg on Emerald
          ///< Rapids: bf16 92 ms, f32 55 ms)
  kFast,  ///< AMX, or AVX512_BF16 on another maker's processor with a full-rate VDPBF16PS (AMD Zen
          ///< 4)
};
[[nodiscard]] Bf16 cpu_bf16();

}  // namespace ygslam
