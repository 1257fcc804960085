#include <sys/mman.h>
#include <unistd.h>

#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "io/image_file.hpp"
#include "io/text.hpp"
#include "segment/png_ids.hpp"

namespace ygslam::fuzz {
namespace {

/// The bytes as a file without a place on a disk: masks are read from files only.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes) : descriptor_(::memfd_create("fuzz", 0)) {
    CHECK(descriptor_ >= 0);
    CHECK(::write(descriptor_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()));
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { ::close(descriptor_); }
  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

}  // namespace

void png(std::string_view bytes) {
  const auto header = decode_header(bytes);
  if (header.ok() && header->size.width * std::int64_t{1} * header->size.height > 1 << 20) return;
  if (const auto image = decode_colour(bytes); image.ok()) CHECK(!image->empty());
  if (const auto image = decode_depth(bytes); image.ok()) CHECK(!image->empty());
  if (const auto image = decode_grey(bytes); image.ok()) {
    const auto ids = read_png_ids(MemoryFile(bytes).path());
    CHECK(ids.ok() && ids->same_size(*image));
  } else {
    (void)read_png_ids(MemoryFile(bytes).path());
  }
}

}  // namespace ygslam::fuzz
