#include "core/memory.hpp"

#include <sys/mman.h>

#include <new>

namespace ygslam {

// Of the system itself: a compiler may leave out a malloc whose memory nobody uses.
bool can_allocate(std::size_t bytes) {
  void* const memory =
      mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return false;
  munmap(memory, bytes);
  return true;
}

void require_memory(std::size_t bytes) {
  if (!can_allocate(bytes)) throw std::bad_alloc();
}

}  // namespace ygslam
