#include "core/memory.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <latch>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "core/testing/memory_limit.hpp"

namespace ygslam {
namespace {

/// What the kernel says of this process' memory, read without the C++ library, whose own pages are
/// asked after.
std::string memory_map() {
  std::vector<char> text(std::size_t{4} << 20);
  std::size_t size = 0;
  const int file = open("/proc/self/smaps", O_RDONLY);
  for (ssize_t n = 1; n > 0; size += static_cast<std::size_t>(n))
    n = read(file, text.data() + size, text.size() - size);
  close(file);
  return {text.data(), size};
}

/// Of a library's code [kB].
int resident_kb(const std::string& map, const std::string& library) {
  std::istringstream lines(map);
  bool counts = false;
  int sum_kb = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.find("r-xp") != std::string::npos) counts = line.find(library) != std::string::npos;
    if (line.rfind("Rss:", 0) != 0) continue;
    if (counts) sum_kb += std::stoi(line.substr(4));
    counts = false;
  }
  return sum_kb;
}

TEST(Memory, CodeIsGivenBackAndStillRuns) {
  if (testing::is_emulated()) GTEST_SKIP() << "QEMU maps code without saying that it is code";
  std::ostringstream before;
  before << 0.1 << ' ' << std::hex << 255;
  const std::string map_before = memory_map();
  give_back_startup_memory("libstdc++");
  const std::string map_after = memory_map();
  std::ostringstream after;
  after << 0.1 << ' ' << std::hex << 255;
  EXPECT_EQ(after.str(), before.str());
  const int before_kb = resident_kb(map_before, "libstdc++");
  EXPECT_GT(before_kb, 100);
  EXPECT_LT(resident_kb(map_after, "libstdc++"), before_kb / 2);
  EXPECT_GE(resident_kb(map_after, "libm.so"), resident_kb(map_before, "libm.so"));
}

#if !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)  // whose malloc gives nothing back
TEST(Memory, WhatMallocHoldsFreeIsGivenBack) {
  const auto resident_pages = [] {
    long whole = 0, resident = 0;
    const int file = open("/proc/self/statm", O_RDONLY);
    char text[200] = {};
    EXPECT_GT(read(file, text, sizeof(text) - 1), 0);
    close(file);
    std::istringstream(text) >> whole >> resident;
    return resident;
  };
  std::vector<std::vector<std::uint8_t>> pieces;
  for (int i = 0; i < 200; ++i) pieces.emplace_back(100'000, 1);
  pieces.erase(pieces.begin(), pieces.end() - 1);  // the last: the heap cannot shrink from its end
  const long held = resident_pages();
  give_back_startup_memory("a library that there is not");
  EXPECT_LT(resident_pages(), held - 2000);  // 8 MB of 20
}

#ifdef __GLIBC__
/// Arenas of malloc's.
std::size_t arenas() {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* const out = open_memstream(&text, &size);
  malloc_info(0, out);
  std::fclose(out);
  const std::string report(text, size);
  std::free(text);
  std::size_t count = 0;
  for (std::size_t at = 0; (at = report.find("<heap nr=", at)) != report.npos; ++at) ++count;
  return count;
}

TEST(Memory, ThreadsShareTwoArenas) {
  share_free_memory();
  const std::size_t before = arenas();
  std::latch all_allocated(8);
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 8; ++i)
      threads.emplace_back([&] {
        const std::vector<std::uint8_t> piece(10'000, 1);
        all_allocated.arrive_and_wait();
      });
  }
  EXPECT_LE(arenas(), std::max<std::size_t>(before, 2));
}
#endif
#endif

}  // namespace
}  // namespace ygslam
