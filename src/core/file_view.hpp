// A file's bytes without reading them: the system brings pages as they are looked at.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string_view>

namespace ygslam {

class FileView {
 public:
  /// @return null where the file cannot be had so: none, empty, no ordinary file.
  [[nodiscard]] static std::shared_ptr<const FileView> open(const std::filesystem::path& file);
  ~FileView();
  FileView(const FileView&) = delete;
  FileView& operator=(const FileView&) = delete;

  /// A file that somebody cuts short meanwhile ends the process where its lost bytes are looked at.
  [[nodiscard]] std::string_view bytes() const { return {bytes_, size_}; }
  /// The pages that memory holds. One that is looked at again is brought again.
  void give_back() const;

 private:
  FileView(const char* bytes, std::size_t size) : bytes_(bytes), size_(size) {}

  const char* bytes_;
  std::size_t size_;
};

}  // namespace ygslam
