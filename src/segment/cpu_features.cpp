#include "segment/cpu_features.hpp"

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace ygslam {

#if defined(__x86_64__)
Bf16 cpu_bf16() {
  unsigned a = 0;
  unsigned b = 0;
  unsigned c = 0;
  unsigned d = 0;
  // Intel SDM vol. 2A, CPUID: leaf 7.0 EDX bit 22 AMX-BF16, bit 24 AMX-TILE; 7.1 EAX bit 5
  // AVX512_BF16.
  if (__get_cpuid_count(7, 0, &a, &b, &c, &d) == 0) return Bf16::kNone;
  constexpr unsigned kAmx = (1U << 22) | (1U << 24);
  if ((d & kAmx) == kAmx) return Bf16::kFast;
  if (__builtin_cpu_supports("avx512f") == 0) return Bf16::kNone;  // also: enabled by the system
  if (__get_cpuid_count(7, 1, &a, &b, &c, &d) == 0 || (a & (1U << 5)) == 0) return Bf16::kNone;
  return __builtin_cpu_is("amd") != 0 ? Bf16::kFast : Bf16::kSlow;
}
#else
Bf16 cpu_bf16() { return Bf16::kNone; }
#endif

}  // namespace ygslam
