// A file of somebody else's, read piece by piece.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "bag/cdr.hpp"
#include "core/result.hpp"

namespace ygslam {

/// Nothing larger is taken for a message or a chunk of messages.
inline constexpr std::uint64_t kMostBlockBytes = std::uint64_t{1} << 29;

class InputFile {
 public:
  /// @return kInput naming path and cause, also where it is no regular file.
  static Result<InputFile> open(const std::filesystem::path& path);
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&&) = delete;
  ~InputFile();

  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// True if the file holds so many bytes from there on, and they are not too many.
  [[nodiscard]] bool holds(std::uint64_t offset, std::uint64_t bytes) const {
    return offset <= size_ && bytes <= size_ - offset && bytes <= kMostBlockBytes;
  }
  /// @return kInput with a reason alone. Nothing is allocated for what is not there.
  [[nodiscard]] Result<Bytes> read(std::uint64_t offset, std::uint64_t bytes) const;

 private:
  InputFile(std::filesystem::path path, int descriptor, std::uint64_t size)
      : path_(std::move(path)), descriptor_(descriptor), size_(size) {}

  std::filesystem::path path_;
  int descriptor_;
  std::uint64_t size_;
};

/// Numbers (little-endian, unaligned), texts and bytes one after the other. After the end
/// everything is zero or empty and ok() is false.
class RecordReader {
 public:
  explicit RecordReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <typename T>
  T number() {
    T value{};
    const auto part = raw(sizeof value);
    if (ok_) std::memcpy(&value, part.data(), sizeof value);
    return value;
  }
  std::span<const std::uint8_t> raw(std::uint64_t n) {
    if (!ok_ || n > bytes_.size() - at_) {
      ok_ = false;
      return {};
    }
    const auto part = bytes_.subspan(at_, static_cast<std::size_t>(n));
    at_ += part.size();
    return part;
  }
  /// With its length in front (32 bit).
  std::string text() {
    const auto part = raw(number<std::uint32_t>());
    return {reinterpret_cast<const char*>(part.data()), part.size()};
  }
  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[nodiscard]] bool ok() const { return ok_; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

/// What may come out of a file's compressed blocks. A few bytes unpack to hundreds of gigabytes,
/// which take an hour. Recordings come to less than 30 times their size, but where images of one
/// colour, which come to thousands of times, are nearly all there is: of those the beginning is
/// read.
class ExpansionLimit {
 public:
  static constexpr std::uint64_t kFreeBytes = std::uint64_t{1} << 30;
  static constexpr std::uint64_t kMostRatio = 300;
  explicit ExpansionLimit(std::uint64_t file_bytes)
      : left_(kFreeBytes + kMostRatio * std::min(file_bytes, kMostFile)) {}

  /// @param bytes that the next block says it unpacks to: `decompressed` sees to it that it does.
  /// @return false if that is too much.
  [[nodiscard]] bool take(std::uint64_t bytes) {
    is_reached_ = is_reached_ || bytes > left_;
    if (!is_reached_) left_ -= bytes;
    return !is_reached_;
  }
  [[nodiscard]] bool is_reached() const { return is_reached_; }
  /// What there is to say then.
  [[nodiscard]] static Error error(const std::filesystem::path& path);

 private:
  static constexpr std::uint64_t kMostFile = std::uint64_t{1} << 50;  // so that nothing overflows
  std::uint64_t left_;
  bool is_reached_ = false;
};

/// The blocks read last, so that neighbours in a chunk do not unpack it again.
class BlockCache {
 public:
  using Load = std::function<Result<Bytes>(std::uint64_t block)>;
  explicit BlockCache(Load load) : load_(std::move(load)) {}
  /// @return part of a block; kInput where it is not there or the block cannot be loaded.
  [[nodiscard]] Result<Bytes> read(std::uint64_t block, std::uint64_t offset, std::uint64_t bytes);

 private:
  static constexpr std::size_t kBlocks = 4;  // colour and depth may lie a few chunks apart
  static constexpr std::size_t kMostBytes = std::size_t{1} << 28;  // of them, but for the newest
  struct Block {
    std::uint64_t number;
    std::shared_ptr<const Bytes> bytes;
  };
  Load load_;
  std::mutex mutex_;
  std::list<Block> blocks_;  // newest first
  std::size_t bytes_ = 0;    // of all
};

enum class Compression { kNone, kZstd, kLz4, kBz2 };

/// What a block says that it unpacks to, where its compression has it. Not to be believed.
[[nodiscard]] std::optional<std::uint64_t> promised_size(Compression compression,
                                                         std::span<const std::uint8_t> bytes);

/// @param size of the result as promised; without, any up to kMostBlockBytes. Memory grows with
/// what comes out, not with what was promised.
/// @return kInput with a reason alone.
[[nodiscard]] Result<Bytes> decompressed(Compression compression,
                                         std::span<const std::uint8_t> bytes,
                                         std::optional<std::uint64_t> size);

}  // namespace ygslam
