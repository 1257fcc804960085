#include "core/file_view.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace ygslam {

std::shared_ptr<const FileView> FileView::open(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return nullptr;
  struct stat about {};
  void* bytes = MAP_FAILED;
  if (fstat(descriptor, &about) == 0 && S_ISREG(about.st_mode) && about.st_size > 0)
    bytes = mmap(nullptr, static_cast<std::size_t>(about.st_size), PROT_READ, MAP_PRIVATE,
                 descriptor, 0);
  close(descriptor);
  if (bytes == MAP_FAILED) return nullptr;
  return std::shared_ptr<const FileView>(
      new FileView(static_cast<const char*>(bytes), static_cast<std::size_t>(about.st_size)));
}

FileView::~FileView() { munmap(const_cast<char*>(bytes_), size_); }

void FileView::give_back() const { madvise(const_cast<char*>(bytes_), size_, MADV_DONTNEED); }

}  // namespace ygslam
