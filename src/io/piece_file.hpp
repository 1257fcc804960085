// Large output record by record: whole or not at all, and a megabyte in memory at a time.
#pragma once

#include <bit>
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>

#include "io/atomic_file.hpp"

namespace ygslam {

/// An AtomicFile that gathers small records into pieces. The first failure stays, and commit()
/// tells it, so that writers need not look after every record.
class PieceFile {
 public:
  [[nodiscard]] static Result<PieceFile> create(const std::filesystem::path& target);

  void add(std::string_view bytes);
  /// The value as it lies in memory, little-endian.
  template <typename T>
  void add_value(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && std::endian::native == std::endian::little);
    add({reinterpret_cast<const char*>(&value), sizeof value});
  }
  /// Bytes added so far.
  [[nodiscard]] std::size_t size() const { return size_; }
  /// @return kOutput naming the file.
  Status commit();

 private:
  explicit PieceFile(AtomicFile file) : file_(std::move(file)) {}
  void flush();

  AtomicFile file_;
  std::string piece_;
  std::size_t size_ = 0;
  Status status_ = Ok{};
};

}  // namespace ygslam
