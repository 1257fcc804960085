#include "map_file/row_blob.hpp"

#include <zlib.h>
#include <zstd.h>

#include <cstring>
#include <new>

#include "core/check.hpp"

namespace ygslam::map_file {
namespace {

constexpr std::uint32_t kRowMagic = 0x57524759;      // "YGRW"
constexpr std::uint16_t kBlobLayout = 2;             // how the fields lie
constexpr std::uint16_t kColumnLayout = 1;           // in the checksums of rows in columns
constexpr std::uint32_t kMostRaw_bytes = 64U << 20;  // of one row
// Descriptors are random to any compressor: higher levels take four times as long for 1 % less.
constexpr int kLevel = 1;
constexpr std::size_t kLeastPart_bytes = 64;  // that is worth a block of its own

struct Header {
  std::uint32_t magic = kRowMagic;
  std::uint16_t layout = kBlobLayout;
  std::uint16_t table = 0;
  std::uint32_t raw_bytes = 0;
  std::uint32_t checksum = 0;
  std::uint64_t hash = 0;
};
static_assert(sizeof(Header) == kRowHeader_bytes);

std::uint32_t crc(std::uint32_t before, const void* bytes, std::size_t size) {
  return static_cast<std::uint32_t>(crc32_z(before, static_cast<const Bytef*>(bytes), size));
}

/// Of everything but itself, and of the row's number: a row in another's place is noticed.
std::uint32_t checksum(Header header, std::uint32_t id, std::span<const char> payload) {
  header.checksum = id;
  return crc(crc(0, &header, sizeof(header)), payload.data(), payload.size());
}

}  // namespace

struct RowCodec::Contexts {
  ZSTD_CCtx* compressor = ZSTD_createCCtx();
  ZSTD_DCtx* decompressor = ZSTD_createDCtx();
  Contexts() {
    if (compressor == nullptr || decompressor == nullptr) throw std::bad_alloc();
  }
  Contexts(const Contexts&) = delete;
  Contexts& operator=(const Contexts&) = delete;
  ~Contexts() {
    ZSTD_freeCCtx(compressor);
    ZSTD_freeDCtx(decompressor);
  }
};

RowCodec::RowCodec() : contexts_(std::make_unique<Contexts>()) {}
RowCodec::RowCodec(RowCodec&&) noexcept = default;
RowCodec& RowCodec::operator=(RowCodec&&) noexcept = default;
RowCodec::~RowCodec() = default;

std::size_t RowCodec::compress(std::span<const char> raw, std::span<const std::size_t> parts) {
  ZSTD_CCtx* const zstd = contexts_->compressor;
  const auto require = [](std::size_t code) {  // there is room: nothing but memory can be wanting
    if (ZSTD_isError(code) != 0) throw std::bad_alloc();
    return code;
  };
  require(ZSTD_CCtx_reset(zstd, ZSTD_reset_session_only));
  require(ZSTD_CCtx_setParameter(zstd, ZSTD_c_compressionLevel, kLevel));
  require(ZSTD_CCtx_setPledgedSrcSize(zstd, raw.size()));
  ZSTD_outBuffer out{stored_.data() + sizeof(Header), stored_.size() - sizeof(Header), 0};
  ZSTD_inBuffer in{raw.data(), 0, 0};
  for (const std::size_t end : parts) {
    if (end < in.size + kLeastPart_bytes || end > raw.size()) continue;
    in.size = end;
    require(ZSTD_compressStream2(zstd, &out, &in, ZSTD_e_flush));
  }
  in.size = raw.size();
  if (require(ZSTD_compressStream2(zstd, &out, &in, ZSTD_e_end)) != 0) throw std::bad_alloc();
  return out.pos;
}

std::span<const char> RowCodec::encode(const RowKey& key, std::span<const char> raw,
                                       std::uint64_t hash, std::span<const std::size_t> parts) {
  CHECK(raw.size() <= kMostRaw_bytes, "a row too large to be read again");
  constexpr std::size_t kBytesPerPart = 8;  // what a new block costs
  stored_.resize(sizeof(Header) + ZSTD_compressBound(raw.size()) + kBytesPerPart * parts.size());
  stored_.resize(sizeof(Header) + compress(raw, parts));
  Header header;
  header.table = static_cast<std::uint16_t>(key.table);
  header.raw_bytes = static_cast<std::uint32_t>(raw.size());
  header.hash = hash;
  header.checksum = checksum(header, key.id, std::span(stored_).subspan(sizeof(Header)));
  std::memcpy(stored_.data(), &header, sizeof(Header));
  return stored_;
}

const char* RowCodec::decode(const RowKey& key, std::span<const char> stored, DecodeBudget& budget,
                             RowContent& row) {
  Header header;
  if (stored.size() < sizeof(Header)) return "cut short";
  std::memcpy(&header, stored.data(), sizeof(Header));
  const auto payload = stored.subspan(sizeof(Header));
  if (header.magic != kRowMagic || header.table != static_cast<std::uint16_t>(key.table))
    return "damaged: no row of this table";
  if (header.layout != kBlobLayout) return "of a format this program does not know";
  if (checksum(header, key.id, payload) != header.checksum)
    return "damaged: the checksum does not match";
  if (header.raw_bytes > kMostRaw_bytes || header.raw_bytes > budget.left_bytes)
    return "would take more memory than a map's row may";
  if (ZSTD_getFrameContentSize(payload.data(), payload.size()) != header.raw_bytes)
    return "damaged: its size is not what it says";
  budget.left_bytes -= header.raw_bytes;
  row.raw.resize(header.raw_bytes);
  const std::size_t size = ZSTD_decompressDCtx(contexts_->decompressor, row.raw.data(),
                                               row.raw.size(), payload.data(), payload.size());
  if (ZSTD_isError(size) != 0 || size != row.raw.size())
    return "damaged: it cannot be decompressed";
  row.hash = hash_of(row.raw);
  return row.hash == header.hash ? nullptr : "damaged: the hash does not match";
}

std::optional<std::uint64_t> hash_in_header(Table table, std::span<const char> header) {
  Header h;
  if (header.size() < sizeof(Header)) return std::nullopt;
  std::memcpy(&h, header.data(), sizeof(Header));
  if (h.magic != kRowMagic || h.layout != kBlobLayout ||
      h.table != static_cast<std::uint16_t>(table))
    return std::nullopt;
  return h.hash;
}

std::uint32_t checksum_of(const RowKey& key, std::span<const char> raw) {
  Header header;
  header.layout = kColumnLayout;
  header.table = static_cast<std::uint16_t>(key.table);
  header.raw_bytes = static_cast<std::uint32_t>(raw.size());
  return checksum(header, key.id, raw);
}

}  // namespace ygslam::map_file
