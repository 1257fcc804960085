#include "io/jpeg_codec.hpp"

#include <turbojpeg.h>

#include <memory>
#include <new>
#include <type_traits>

namespace ygslam::jpeg {
namespace {

struct Destroy {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using Handle = std::unique_ptr<std::remove_pointer_t<tjhandle>, Destroy>;

const unsigned char* data_of(std::string_view bytes) {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}

// The end marker FF D9, possibly followed by padding or a trailer of the recorder.
bool has_end_marker(std::string_view bytes) {
  return bytes.rfind("\xFF\xD9") != std::string_view::npos;
}

/// Throws std::bad_alloc where that is what the library lacked.
Handle checked(tjhandle handle) {
  if (handle == nullptr) throw std::bad_alloc();
  return Handle(handle);
}
std::string fault_of(const Handle& handle) {
  std::string fault = tjGetErrorStr2(handle.get());
  // "Insufficient memory", "Memory allocation failure": the library has no code for it.
  if (fault.find("emory") != std::string::npos) throw std::bad_alloc();
  return fault;
}

Error corrupt(const Handle& handle) {
  return {ErrorKind::kInput, "corrupt JPEG (" + fault_of(handle) + ")"};
}

}  // namespace

bool has_signature(std::string_view bytes) { return bytes.starts_with("\xFF\xD8\xFF"); }

Result<ImageHeader> header(std::string_view bytes) {
  const Handle handle = checked(tjInitDecompress());
  ImageHeader header;
  int subsampling = 0;
  int space = 0;
  if (tjDecompressHeader3(handle.get(), data_of(bytes), bytes.size(), &header.size.width,
                          &header.size.height, &subsampling, &space) != 0) {
    return has_end_marker(bytes) ? corrupt(handle) : Error{ErrorKind::kInput, "truncated JPEG"};
  }
  header.bits = 8;
  header.format = "JPEG";
  header.channels = space == TJCS_GRAY ? 1 : (space == TJCS_CMYK || space == TJCS_YCCK) ? 4 : 3;
  return header;
}

Status decode(std::string_view bytes, std::uint8_t* pixels) {
  if (!has_end_marker(bytes)) return Error{ErrorKind::kInput, "truncated JPEG"};
  const auto known = header(bytes);
  if (!known.ok()) return known.error();
  const ImageSize size = known->size;
  const Handle handle = checked(tjInitDecompress());
  // A warning means that the decoder made something up (its texts say "premature end", "corrupt").
  if (tjDecompress2(handle.get(), data_of(bytes), bytes.size(), pixels, size.width, 0, size.height,
                    TJPF_RGB, TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS) != 0) {
    return corrupt(handle);
  }
  return Ok{};
}

std::string encode(const std::uint8_t* rgb, const ImageSize& size, int quality) {
  const Handle handle = checked(tjInitCompress());
  unsigned char* buffer = nullptr;
  unsigned long count = 0;  // NOLINT(google-runtime-int): the library's type
  const int failed = tjCompress2(handle.get(), rgb, size.width, 0, size.height, TJPF_RGB, &buffer,
                                 &count, TJSAMP_420, quality, 0);
  std::string bytes =
      failed != 0 ? std::string() : std::string(reinterpret_cast<char*>(buffer), count);
  tjFree(buffer);
  CHECK(failed == 0, fault_of(handle).c_str());
  return bytes;
}

}  // namespace ygslam::jpeg
