// Want of memory, played in a child process.
#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <cstddef>
#include <cstdlib>
#include <fstream>

namespace ygslam::testing {

/// Under QEMU as `make arm64` uses it, which knows no limit of memory and starts no program anew.
inline bool is_emulated() { return std::getenv("YGSLAM_EMULATED") != nullptr; }

/// From now on this process gets so much beyond the addresses it has.
inline void limit_memory(std::size_t extra_mb) {
  std::ifstream statm("/proc/self/statm");
  rlim_t pages = 0;
  statm >> pages;
  const rlim_t bytes = pages * 4096 + (extra_mb << 20);
  const rlimit limit{bytes, bytes};
  setrlimit(RLIMIT_AS, &limit);
}

/// Runs the call in a child; it must end the process, with 0 (there was enough) or 1 (refused).
/// @return 1 if refused.
template <typename Call>
int refusals_of(Call call, std::size_t extra_mb) {
  int refused = 0;
  EXPECT_EXIT(
      call(),
      [&](int status) {
        if (!WIFEXITED(status) || WEXITSTATUS(status) > 1) return false;
        refused = WEXITSTATUS(status);
        return true;
      },
      "")
      << extra_mb;
  return refused;
}

}  // namespace ygslam::testing
