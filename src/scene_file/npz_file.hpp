// NumPy's archive of arrays: a ZIP file of .npy files.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/piece_file.hpp"

namespace ygslam {

/// Arrays are compressed one by one, so that memory holds one compressed array at a time; the same
/// arrays give the same bytes.
class NpzFile {
 public:
  [[nodiscard]] static Result<NpzFile> create(const std::filesystem::path& target);

  using ByteSink = std::function<void(std::string_view)>;
  /// @param type NumPy's, as "<f4". @param shape empty for a single number.
  /// @param write gives the elements, in C order, in as many pieces as it likes.
  void add_array(std::string_view name, std::string_view type, std::span<const std::size_t> shape,
                 const std::function<void(const ByteSink&)>& write);
  /// @return kOutput naming the file; also where it is beyond the 4 GiB of a plain ZIP file.
  Status commit();

 private:
  NpzFile(PieceFile file, std::string name) : file_(std::move(file)), name_(std::move(name)) {}

  PieceFile file_;
  std::string name_;
  std::string directory_;
  std::uint16_t entries_ = 0;
  bool too_large_ = false;
};

}  // namespace ygslam
