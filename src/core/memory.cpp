#include "core/memory.hpp"

#include <link.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <new>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "core/check.hpp"

namespace ygslam {
namespace {

/// Parts that are never written hold what the file holds: dropping them loses nothing but a
/// debugger's breakpoints. (What the linker writes, relocations, lies in parts that are loaded
/// writable; no distribution has libraries with relocations in their code.)
int drop_constant_parts(dl_phdr_info* info, std::size_t /*size*/, void* wanted) {
  const std::string_view path(info->dlpi_name);
  const std::string_view file = path.substr(path.rfind('/') + 1);
  if (file.find(*static_cast<const std::string_view*>(wanted)) == file.npos) return 0;
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  for (int i = 0; i < info->dlpi_phnum; ++i) {
    const auto& part = info->dlpi_phdr[i];
    if (part.p_type != PT_LOAD || (part.p_flags & PF_W) != 0) continue;
    const std::uintptr_t begin = (info->dlpi_addr + part.p_vaddr + page - 1) / page * page;
    const std::uintptr_t end = (info->dlpi_addr + part.p_vaddr + part.p_filesz) / page * page;
    if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED);
  }
  return 0;
}

}  // namespace

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

void give_back_startup_memory(std::string_view library) {
  CHECK(!library.empty(), "an empty name is part of every name");
  dl_iterate_phdr(drop_constant_parts, &library);
  give_back_free_memory();
}

void share_free_memory() {
#ifdef __GLIBC__
  mallopt(M_ARENA_MAX, 2);
#endif
}

void give_back_free_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace ygslam
