#include "scene_file/npz_file.hpp"

#include <zlib.h>

#include <array>
#include <limits>

namespace ygslam {
namespace {

constexpr std::size_t kLargest_bytes = std::numeric_limits<std::uint32_t>::max();

// Raw deflate, as ZIP has it, with the sums that ZIP wants beside it.
class Deflater {
 public:
  Deflater() {
    constexpr int kRaw = -MAX_WBITS, kMemoryLevel = 8;
    CHECK(deflateInit2(&stream_, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kRaw, kMemoryLevel,
                       Z_DEFAULT_STRATEGY) == Z_OK,
          "zlib did not start");
  }
  Deflater(const Deflater&) = delete;
  Deflater& operator=(const Deflater&) = delete;
  ~Deflater() { deflateEnd(&stream_); }

  void add(std::string_view bytes) {
    pending_ += bytes;
    size_ += bytes.size();
    if (pending_.size() >= std::size_t{1} << 16) compress(Z_NO_FLUSH);
  }
  void finish() { compress(Z_FINISH); }

  [[nodiscard]] const std::string& compressed() const { return compressed_; }
  [[nodiscard]] std::uint32_t checksum() const { return checksum_; }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  void compress(int flush) {
    auto* bytes = reinterpret_cast<Bytef*>(pending_.data());
    const auto count = static_cast<uInt>(pending_.size());
    checksum_ = static_cast<std::uint32_t>(crc32(checksum_, bytes, count));
    stream_.next_in = bytes;
    stream_.avail_in = count;
    std::array<Bytef, 1 << 14> out;
    do {
      stream_.next_out = out.data();
      stream_.avail_out = out.size();
      CHECK(deflate(&stream_, flush) != Z_STREAM_ERROR);
      compressed_.append(reinterpret_cast<const char*>(out.data()), out.size() - stream_.avail_out);
    } while (stream_.avail_out == 0);
    pending_.clear();
  }

  z_stream stream_{};
  std::string pending_, compressed_;
  std::uint32_t checksum_ = 0;
  std::size_t size_ = 0;
};

// NumPy Enhancement Proposal 1, version 1.0: the data begin at a multiple of 64 bytes.
std::string npy_header(std::string_view type, std::span<const std::size_t> shape) {
  std::string text = "{'descr': '" + std::string(type) + "', 'fortran_order': False, 'shape': (";
  for (const std::size_t count : shape) text += std::to_string(count) + ",";
  text += ")}";
  constexpr std::size_t kPreamble = 10;
  text.resize((kPreamble + text.size() + 1 + 63) / 64 * 64 - kPreamble - 1, ' ');
  text += '\n';
  const auto length = static_cast<std::uint16_t>(text.size());
  return std::string("\x93NUMPY\x01\0", 8) + static_cast<char>(length & 255) +
         static_cast<char>(length >> 8) + text;
}

class ZipRecord {
 public:
  explicit ZipRecord(std::string_view signature) : bytes_(signature) {}
  ZipRecord& add16(std::size_t value) { return add(value, 2); }
  ZipRecord& add32(std::size_t value) { return add(value, 4); }
  ZipRecord& add_text(std::string_view text) {
    bytes_ += text;
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  ZipRecord& add(std::size_t value, int count) {
    for (int i = 0; i < count; ++i) bytes_ += static_cast<char>(value >> (8 * i) & 255);
    return *this;
  }
  std::string bytes_;
};

// What the local header and the directory say alike (APPNOTE.TXT, 4.3.7): version, flags, method,
// the date 1 January 1980, checksum, sizes, length of the name and of what follows it.
void add_entry(ZipRecord& record, const Deflater& data, std::string_view name) {
  record.add16(20).add16(0).add16(8).add16(0).add16(0x21).add32(data.checksum());
  record.add32(data.compressed().size()).add32(data.size()).add16(name.size()).add16(0);
}

}  // namespace

Result<NpzFile> NpzFile::create(const std::filesystem::path& target) {
  auto file = PieceFile::create(target);
  if (!file.ok()) return file.error();
  return NpzFile(std::move(*file), target.string());
}

void NpzFile::add_array(std::string_view name, std::string_view type,
                        std::span<const std::size_t> shape,
                        const std::function<void(const ByteSink&)>& write) {
  const std::string file_name = std::string(name) + ".npy";
  Deflater data;
  data.add(npy_header(type, shape));
  write([&](std::string_view bytes) { data.add(bytes); });
  data.finish();
  const std::size_t offset = file_.size();
  too_large_ = too_large_ || data.size() > kLargest_bytes;

  ZipRecord local("PK\x03\x04");
  add_entry(local, data, file_name);
  file_.add(local.add_text(file_name).bytes());
  file_.add(data.compressed());

  ZipRecord central("PK\x01\x02");
  central.add16(20);
  add_entry(central, data, file_name);
  central.add16(0).add16(0).add16(0).add32(0).add32(offset).add_text(file_name);
  directory_ += central.bytes();
  ++entries_;
}

Status NpzFile::commit() {
  const std::size_t offset = file_.size();
  if (too_large_ || offset + directory_.size() > kLargest_bytes) {
    return Error{ErrorKind::kOutput, name_ + ": more than the 4 GiB that an .npz file can hold"};
  }
  file_.add(directory_);
  ZipRecord end("PK\x05\x06");
  end.add16(0).add16(0).add16(entries_).add16(entries_);
  end.add32(directory_.size()).add32(offset).add16(0);
  file_.add(end.bytes());
  return file_.commit();
}

}  // namespace ygslam
