#include "map_file/replace_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace ygslam::map_file {
namespace fs = std::filesystem;
namespace {

Error output_error(const fs::path& path, const std::string& what) {
  return {ErrorKind::kOutput, path.string() + ": " + what};
}

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

bool flush(const fs::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool ok = ::fsync(descriptor) == 0 || errno == EINVAL || errno == EROFS;
  const int reason = errno;
  ::close(descriptor);
  errno = reason;
  return ok;
}

}  // namespace

Result<fs::path> target_of(const fs::path& path) {
  std::error_code code;
  fs::path target = path;
  if (fs::is_symlink(path, code)) {
    target = fs::canonical(path, code);
    if (code) return output_error(path, "is a link to nowhere");
  }
  const fs::file_status status = fs::status(target, code);
  if (fs::is_directory(status)) return output_error(path, "is a folder");
  if (fs::exists(status) && !fs::is_regular_file(status))
    return output_error(path, "is no regular file");
  return target;
}

Result<fs::path> unused_name_beside(const fs::path& target) {
  constexpr int kAttempts = 16;  // in case a killed process left some behind
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    fs::path path = folder_of(target) / (".ygslam-map." + std::to_string(::getpid()) + "." +
                                         std::to_string(attempt) + ".tmp");
    const int descriptor =
        ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (descriptor >= 0) {
      ::close(descriptor);
      return path;
    }
    if (errno != EEXIST) return output_error(target, std::strerror(errno));
  }
  return output_error(target, "no name for a temporary file is free");
}

Status replace_file(const fs::path& finished, const fs::path& target) {
  if (!flush(finished, O_RDONLY) || ::rename(finished.c_str(), target.c_str()) != 0)
    return output_error(target, std::strerror(errno));
  // The new file is in place; this makes the renaming itself survive a loss of power.
  (void)flush(folder_of(target), O_RDONLY | O_DIRECTORY);
  return Ok{};
}

void remove_companions(const fs::path& path) {
  for (const char* ending : {"-wal", "-shm"}) {
    fs::path companion = path;
    companion += ending;
    std::error_code ignored;
    fs::remove(companion, ignored);
  }
}

}  // namespace ygslam::map_file
