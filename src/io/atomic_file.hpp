// Output that is either the complete new file or the untouched old one.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "core/result.hpp"

namespace ygslam {

/// Creates the directory (and its parents) if need be and tries to create a file in it.
/// @return kOutput naming the path and the system's reason.
Status ensure_writable_directory(const std::filesystem::path& directory);

/// A file without a name (where that can be, else a temporary one) until commit() flushes it to the
/// disk and renames it over the target. Without commit() nothing remains and an earlier file stays.
/// A target that is a symbolic link is replaced, not written through.
class AtomicFile {
 public:
  static Result<AtomicFile> create(const std::filesystem::path& target);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&& other) noexcept;
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  Status write(std::string_view bytes);
  /// Renames it over the target now; what is written later goes into the file in its place.
  Status place();
  Status commit();

 private:
  AtomicFile(std::filesystem::path target, std::filesystem::path temporary, int descriptor);
  void abandon() noexcept;

  std::filesystem::path target_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;
  bool placed_ = false;
};

/// The whole content at once, atomically.
Status write_file_atomically(const std::filesystem::path& target, std::string_view content);

/// Keeps a second process (or run) out of an output directory or file while it lives: flock on
/// DIR/.lock or FILE.lock, which names the process and goes with it.
class OutputLock {
 public:
  /// @return kOutput "locked" if another holds it.
  static Result<OutputLock> acquire(const std::filesystem::path& directory);
  static Result<OutputLock> acquire_beside(const std::filesystem::path& file);
  OutputLock(OutputLock&& other) noexcept;
  OutputLock& operator=(OutputLock&& other) noexcept;
  OutputLock(const OutputLock&) = delete;
  OutputLock& operator=(const OutputLock&) = delete;
  ~OutputLock();

 private:
  static Result<OutputLock> acquire(const std::filesystem::path& path, const std::string& name);
  OutputLock(std::filesystem::path path, int descriptor)
      : path_(std::move(path)), descriptor_(descriptor) {}
  std::filesystem::path path_;
  int descriptor_ = -1;
};

}  // namespace ygslam
