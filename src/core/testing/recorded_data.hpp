// Recorded data for tests, which not every checkout has.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

namespace ygslam::testing {

/// Where recorded data lies, if there is any: $YGSLAM_SHARED, else ../shared.
inline std::filesystem::path shared_folder() {
  const char* given = std::getenv("YGSLAM_SHARED");
  return given != nullptr ? given : "../shared";
}

}  // namespace ygslam::testing

/// Ends a test whose data is not there. It has shown nothing, so it must not count as passed; only
/// GoogleTest's own mark makes ctest say so.
#define YGSLAM_NEEDS_RECORDED(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no recorded data at " << (path)
