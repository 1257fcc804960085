// A row's content in the file: header (magic, format, table, raw size, checksum, hash), then zstd.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "map_file/row_hash.hpp"

namespace ygslam::map_file {

/// Memory that decoding may still ask for. A file of a few kilobytes must not fill it all.
struct DecodeBudget {
  static constexpr std::uint64_t kFree_bytes = std::uint64_t{200} << 20;
  static constexpr std::uint64_t kPerFileByte = 8;
  std::uint64_t left_bytes = kFree_bytes;

  static DecodeBudget of_file(std::uint64_t file_bytes) {
    return {kFree_bytes + kPerFileByte * file_bytes};
  }
};

/// Bytes of a header.
inline constexpr std::size_t kRowHeader_bytes = 24;

/// The hash in a row's header, checksum unseen; nothing if this is no header of that table's.
[[nodiscard]] std::optional<std::uint64_t> hash_in_header(Table table,
                                                          std::span<const char> header);

/// A row that was read.
struct RowContent {
  std::string raw;
  std::uint64_t hash = 0;  ///< of raw
};

/// Keeps the compressor's memory between rows.
class RowCodec {
 public:
  RowCodec();
  RowCodec(RowCodec&&) noexcept;
  RowCodec& operator=(RowCodec&&) noexcept;
  ~RowCodec();

  /// @param hash hash_of(raw). @param parts ArchiveWriter::parts. @return what to store, valid
  /// until the next call.
  [[nodiscard]] std::span<const char> encode(const RowKey& key, std::span<const char> raw,
                                             std::uint64_t hash,
                                             std::span<const std::size_t> parts = {});
  /// The checksum is looked at before anything is decoded, the size before anything is allocated.
  /// @param row set to what it holds. @return what is wrong; null if nothing.
  [[nodiscard]] const char* decode(const RowKey& key, std::span<const char> stored,
                                   DecodeBudget& budget, RowContent& row);

 private:
  std::size_t compress(std::span<const char> raw, std::span<const std::size_t> parts);
  struct Contexts;
  std::unique_ptr<Contexts> contexts_;
  std::string stored_;
};

/// The checksum of a row that is stored in columns.
[[nodiscard]] std::uint32_t checksum_of(const RowKey& key, std::span<const char> raw);

}  // namespace ygslam::map_file
