#include "bag/input_file.hpp"

#include <bzlib.h>
#include <fcntl.h>
#include <lz4frame.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>
#include <utility>

namespace ygslam {
namespace {

Error reason(std::string text) { return {ErrorKind::kInput, std::move(text)}; }

/// Room for what comes out of a decompressor, growing to at most `most`.
class Output {
 public:
  Output(std::size_t first, std::uint64_t most) : most_(most) {
    bytes_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(first, most)));
  }
  [[nodiscard]] std::uint8_t* data() { return bytes_.data() + used_; }
  [[nodiscard]] std::size_t room() const { return bytes_.size() - used_; }
  void take(std::size_t n) { used_ += n; }
  /// @return false where it may not.
  bool grow() {
    if (bytes_.size() >= most_) return false;
    bytes_.resize(static_cast<std::size_t>(
        std::min<std::uint64_t>(most_, 4 * std::uint64_t{bytes_.size()} + 1024)));
    return true;
  }
  Bytes finish() {
    bytes_.resize(used_);
    return std::move(bytes_);
  }

 private:
  std::uint64_t most_;
  Bytes bytes_;
  std::size_t used_ = 0;
};

enum class Step { kMore, kEnd, kFault };

/// Calls step() until the stream ends. A step that neither takes nor gives anything with room left
/// has not got the bytes that it needs.
template <typename DoStep>
Result<Bytes> unpack(Output& out, std::size_t n, const DoStep& step) {
  std::size_t at = 0;
  while (true) {
    std::size_t taken = 0;
    std::size_t given = 0;
    const std::size_t room = out.room();
    const Step done = step(at, n - at, taken, given);
    if (done == Step::kFault) return reason("damaged compression");
    at += taken;
    out.take(given);
    if (done == Step::kEnd) return out.finish();
    if (given == room) {
      if (!out.grow()) return reason("more comes out of a compressed block than was promised");
    } else if (taken == 0 && given == 0) {
      return reason("a compressed block ends early");
    }
  }
}

Result<Bytes> unpack_zstd(std::span<const std::uint8_t> bytes, Output& out) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> stream(ZSTD_createDCtx(),
                                                                    &ZSTD_freeDCtx);
  if (!stream) throw std::bad_alloc();
  return unpack(out, bytes.size(),
                [&](std::size_t at, std::size_t left, std::size_t& taken, std::size_t& given) {
                  ZSTD_inBuffer in{bytes.data() + at, left, 0};
                  ZSTD_outBuffer to{out.data(), out.room(), 0};
                  const std::size_t hint = ZSTD_decompressStream(stream.get(), &to, &in);
                  taken = in.pos;
                  given = to.pos;
                  if (ZSTD_isError(hint)) return Step::kFault;
                  return hint == 0 && in.pos == left ? Step::kEnd : Step::kMore;
                });
}

Result<Bytes> unpack_lz4(std::span<const std::uint8_t> bytes, Output& out) {
  LZ4F_dctx* created = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&created, LZ4F_VERSION))) throw std::bad_alloc();
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> stream(
      created, &LZ4F_freeDecompressionContext);
  return unpack(out, bytes.size(),
                [&](std::size_t at, std::size_t left, std::size_t& taken, std::size_t& given) {
                  taken = left;
                  given = out.room();
                  const std::size_t hint = LZ4F_decompress(stream.get(), out.data(), &given,
                                                           bytes.data() + at, &taken, nullptr);
                  if (LZ4F_isError(hint)) return Step::kFault;
                  return hint == 0 ? Step::kEnd : Step::kMore;
                });
}

Result<Bytes> unpack_bz2(std::span<const std::uint8_t> bytes, Output& out) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw std::bad_alloc();
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> guard(&stream,
                                                                         &BZ2_bzDecompressEnd);
  return unpack(
      out, bytes.size(),
      [&](std::size_t at, std::size_t left, std::size_t& taken, std::size_t& given) {
        stream.next_in = const_cast<char*>(reinterpret_cast<const char*>(bytes.data() + at));
        stream.avail_in = static_cast<unsigned>(left);
        stream.next_out = reinterpret_cast<char*>(out.data());
        stream.avail_out = static_cast<unsigned>(out.room());
        const std::size_t room = out.room();
        const int done = BZ2_bzDecompress(&stream);
        taken = left - stream.avail_in;
        given = room - stream.avail_out;
        return done == BZ_STREAM_END ? Step::kEnd : done == BZ_OK ? Step::kMore : Step::kFault;
      });
}

}  // namespace

Result<InputFile> InputFile::open(const std::filesystem::path& path) {
  const auto fault = [&](const std::string& what) {
    return Error{ErrorKind::kInput, path.string() + ": " + what};
  };
  // Not blocking: a pipe that nobody writes to would be waited for.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return fault(std::strerror(errno));
  InputFile file(path, descriptor, 0);
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) return fault(std::strerror(errno));
  if (!S_ISREG(status.st_mode)) return fault("is no regular file");
  file.size_ = static_cast<std::uint64_t>(status.st_size);
  return file;
}

InputFile::InputFile(InputFile&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_) {}

InputFile::~InputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<Bytes> InputFile::read(std::uint64_t offset, std::uint64_t bytes) const {
  if (!holds(offset, bytes)) return reason("ends early");
  Bytes content(static_cast<std::size_t>(bytes));
  for (std::size_t at = 0; at < content.size();) {
    const ssize_t got = ::pread(descriptor_, content.data() + at, content.size() - at,
                                static_cast<off_t>(offset + at));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return reason(std::strerror(errno));
    if (got == 0) return reason("became shorter while it was read");
    at += static_cast<std::size_t>(got);
  }
  return content;
}

Result<Bytes> BlockCache::read(std::uint64_t block, std::uint64_t offset, std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  auto it = std::find_if(blocks_.begin(), blocks_.end(),
                         [&](const Block& b) { return b.number == block; });
  if (it == blocks_.end()) {
    auto loaded = load_(block);
    if (!loaded.ok()) return loaded.error();
    bytes_ += loaded->size();
    blocks_.push_front({block, std::make_shared<const Bytes>(std::move(*loaded))});
    while (blocks_.size() > kBlocks || (blocks_.size() > 1 && bytes_ > kMostBytes)) {
      bytes_ -= blocks_.back().bytes->size();
      blocks_.pop_back();
    }
    it = blocks_.begin();
  }
  const Bytes& all = *it->bytes;
  if (offset > all.size() || bytes > all.size() - offset)
    return reason("the file changed while it was read");
  const auto begin = all.begin() + static_cast<std::ptrdiff_t>(offset);
  return Bytes(begin, begin + static_cast<std::ptrdiff_t>(bytes));
}

Error ExpansionLimit::error(const std::filesystem::path& path) {
  return {ErrorKind::kInput, path.string() + ": unpacks to more than 1 GiB and " +
                                 std::to_string(kMostRatio) +
                                 " times its size, read as far as that"};
}

std::optional<std::uint64_t> promised_size(Compression compression,
                                           std::span<const std::uint8_t> bytes) {
  if (compression != Compression::kZstd) return std::nullopt;
  const unsigned long long size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR) return std::nullopt;
  return size;
}

Result<Bytes> decompressed(Compression compression, std::span<const std::uint8_t> bytes,
                           std::optional<std::uint64_t> size) {
  const std::uint64_t most = size.value_or(kMostBlockBytes);
  if (most > kMostBlockBytes) return reason("a block of " + std::to_string(most) + " bytes");
  Result<Bytes> out = reason("");
  if (compression == Compression::kNone) {
    out = Bytes(bytes.begin(), bytes.end());
  } else {
    constexpr std::size_t kUsualRatio = 8;
    constexpr std::size_t kSlack = 64;  // a full room would hide the end of the stream
    Output room(kUsualRatio * bytes.size() + 1024, most + kSlack);
    out = compression == Compression::kZstd  ? unpack_zstd(bytes, room)
          : compression == Compression::kLz4 ? unpack_lz4(bytes, room)
                                             : unpack_bz2(bytes, room);
  }
  if (out.ok() && size && out->size() != *size)
    return reason("a block has another size than was promised");
  return out;
}

}  // namespace ygslam
