#include "io/atomic_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace ygslam {
namespace fs = std::filesystem;
namespace {

Error output_error(const fs::path& path, int error_number) {
  return {ErrorKind::kOutput, path.string() + ": " + std::strerror(error_number)};
}

fs::path directory_of(const fs::path& target) {
  return target.has_parent_path() ? target.parent_path() : fs::path(".");
}

/// A device, a pipe, a link to one, a name for a standard stream: nothing that a file may replace.
bool is_no_place_for_files(const fs::path& target) {
  std::error_code code;
  if (fs::is_other(fs::status(target, code))) return true;
  const fs::path folder = fs::weakly_canonical(directory_of(fs::absolute(target, code)), code);
  return folder == "/dev" || folder == "/dev/fd" || folder.string().starts_with("/proc/");
}

struct Temporary {
  fs::path path;  // empty: it has no name
  int descriptor = -1;
  int error_number = 0;  // where descriptor < 0
};

/// Calls use() with names in the target's folder until one was not there: a killed run may have
/// left some. Of their own length: the target's may be as long as names can be.
/// @param use 0 or an error number. @return the name, or the error.
template <typename Use>
Result<fs::path> unused_name(const fs::path& target, const Use& use) {
  constexpr int kAttempts = 16;
  int error_number = EEXIST;
  for (int attempt = 0; attempt < kAttempts && error_number == EEXIST; ++attempt) {
    fs::path path = directory_of(target) / (".ygslam." + std::to_string(::getpid()) + "." +
                                            std::to_string(attempt) + ".tmp");
    error_number = use(path);
    if (error_number == 0) return path;
  }
  return output_error(target, error_number);
}

/// A new file in the target's folder: where the file system can, without a name until it is
/// finished, so that nothing of it remains however the process ends.
Temporary open_temporary(const fs::path& target) {
  Temporary file;
  const bool can_be_named = ::access("/proc/self/fd", X_OK) == 0;
  if (can_be_named)
    file.descriptor = ::open(directory_of(target).c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
  if (file.descriptor >= 0) return file;
  const auto named = unused_name(target, [&](const fs::path& path) {
    file.descriptor =
        ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0666);
    return file.error_number = file.descriptor < 0 ? errno : 0;
  });
  if (named.ok()) file.path = *named;
  return file;
}

/// A file without a name gets one.
Result<fs::path> name_beside(const fs::path& target, int descriptor) {
  const std::string file = "/proc/self/fd/" + std::to_string(descriptor);
  return unused_name(target, [&](const fs::path& path) {
    const int linked = ::linkat(AT_FDCWD, file.c_str(), AT_FDCWD, path.c_str(), AT_SYMLINK_FOLLOW);
    return linked == 0 ? 0 : errno;
  });
}

// " (process 123)", where the lock file says so.
std::string holder_of(int descriptor) {
  std::array<char, 16> text{};
  const ssize_t read = ::pread(descriptor, text.data(), text.size() - 1, 0);
  const int process = read > 0 ? std::atoi(text.data()) : 0;
  return process > 0 ? " (process " + std::to_string(process) + ")" : "";
}

}  // namespace

Status ensure_writable_directory(const fs::path& directory) {
  std::error_code code;
  fs::create_directories(directory, code);
  if (code) return Error{ErrorKind::kOutput, directory.string() + ": " + code.message()};
  if (!fs::is_directory(directory, code)) return output_error(directory, ENOTDIR);
  const Temporary probe = open_temporary(directory / "write_test");
  if (probe.descriptor < 0) return output_error(directory, probe.error_number);
  ::close(probe.descriptor);
  if (!probe.path.empty()) ::unlink(probe.path.c_str());
  return Ok{};
}

AtomicFile::AtomicFile(fs::path target, fs::path temporary, int descriptor)
    : target_(std::move(target)), temporary_(std::move(temporary)), descriptor_(descriptor) {}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : target_(std::move(other.target_)),
      temporary_(std::move(other.temporary_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      placed_(other.placed_) {}

AtomicFile& AtomicFile::operator=(AtomicFile&& other) noexcept {
  if (this == &other) return *this;
  abandon();
  target_ = std::move(other.target_);
  temporary_ = std::move(other.temporary_);
  descriptor_ = std::exchange(other.descriptor_, -1);
  placed_ = other.placed_;
  return *this;
}

AtomicFile::~AtomicFile() { abandon(); }

void AtomicFile::abandon() noexcept {
  if (descriptor_ < 0) return;
  ::close(std::exchange(descriptor_, -1));
  if (!placed_ && !temporary_.empty()) ::unlink(temporary_.c_str());
}

Result<AtomicFile> AtomicFile::create(const fs::path& target) {
  std::error_code code;
  if (fs::is_directory(target, code)) return output_error(target, EISDIR);
  if (is_no_place_for_files(target)) {
    return Error{ErrorKind::kOutput, target.string() + ": is not a regular file"};
  }
  const Temporary file = open_temporary(target);
  if (file.descriptor < 0) return output_error(target, file.error_number);
  return AtomicFile(target, file.path, file.descriptor);
}

Status AtomicFile::write(std::string_view bytes) {
  CHECK(descriptor_ >= 0, "write after commit");
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return output_error(target_, errno);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return Ok{};
}

Status AtomicFile::place() {
  CHECK(descriptor_ >= 0, "place after commit");
  if (placed_) return Ok{};
  if (temporary_.empty()) {
    auto named = name_beside(target_, descriptor_);
    if (!named.ok()) return named.error();
    temporary_ = std::move(*named);
  }
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) return output_error(target_, errno);
  placed_ = true;
  return Ok{};
}

Status AtomicFile::commit() {
  CHECK(descriptor_ >= 0, "commit twice");
  if (::fsync(descriptor_) != 0 && errno != EINVAL && errno != EROFS) {
    return output_error(target_, errno);
  }
  if (Status placed = place(); !placed.ok()) return placed;
  // The new file is in place. What may still fail is making the rename itself survive a power cut.
  if (::close(std::exchange(descriptor_, -1)) != 0) return output_error(target_, errno);
  const int directory = ::open(directory_of(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (directory >= 0) {
    ::fsync(directory);
    ::close(directory);
  }
  return Ok{};
}

Status write_file_atomically(const fs::path& target, std::string_view content) {
  auto file = AtomicFile::create(target);
  if (!file.ok()) return file.error();
  if (Status written = file->write(content); !written.ok()) return written;
  return file->commit();
}

Result<OutputLock> OutputLock::acquire(const fs::path& directory) {
  return acquire(directory / ".lock", directory.string());
}

Result<OutputLock> OutputLock::acquire_beside(const fs::path& file) {
  fs::path path = file;
  path += ".lock";
  return acquire(path, file.string());
}

Result<OutputLock> OutputLock::acquire(const fs::path& path, const std::string& name) {
  while (true) {
    const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (descriptor < 0) {
      const int error_number = errno;
      std::error_code ignored;
      const bool is_there = fs::exists(fs::symlink_status(path, ignored));
      return output_error(is_there ? path : fs::path(name), error_number);
    }
    OutputLock lock(path, descriptor);
    if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
      const int error_number = errno;
      lock.path_.clear();  // another's
      if (error_number != EWOULDBLOCK) return output_error(path, error_number);
      return Error{ErrorKind::kOutput, name + ": locked by another run" + holder_of(descriptor)};
    }
    // The file may have gone between the two calls, with the run that held it.
    struct stat held {
    }, there{};
    if (::fstat(descriptor, &held) == 0 && ::stat(path.c_str(), &there) == 0 &&
        held.st_dev == there.st_dev && held.st_ino == there.st_ino) {
      // For the message of another alone: where it cannot be written the lock holds all the same.
      const std::string process = std::to_string(::getpid()) + "\n";
      if (::ftruncate(descriptor, 0) == 0)
        (void)!::pwrite(descriptor, process.data(), process.size(), 0);
      return lock;
    }
    lock.path_.clear();
  }
}

OutputLock::OutputLock(OutputLock&& other) noexcept
    : path_(std::exchange(other.path_, {})), descriptor_(std::exchange(other.descriptor_, -1)) {}

OutputLock& OutputLock::operator=(OutputLock&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

OutputLock::~OutputLock() {
  if (descriptor_ < 0) return;
  if (!path_.empty()) ::unlink(path_.c_str());  // while it is still held
  ::close(descriptor_);                         // releases the lock
}

}  // namespace ygslam
