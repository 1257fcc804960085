#include "io/growing_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace ygslam {
namespace fs = std::filesystem;
namespace {

Error growing_fault(const fs::path& path, const std::string& what) {
  return {ErrorKind::kOutput, path.string() + ": " + what};
}

/// The file that a path means: what a link points to. @return empty where that is nowhere.
fs::path growing_target(const fs::path& path) {
  std::error_code code;
  if (!fs::is_symlink(path, code)) return path;
  fs::path target = fs::canonical(path, code);
  return code ? fs::path() : target;
}

/// Empty, or of that kind. Before it is opened: a pipe that nobody writes to would be waited for.
Status check_replaceable(const fs::path& path, const FileKind& kind) {
  const auto keep = [&](const std::string& why) {
    return growing_fault(path, "is there and " + why + "; it is not replaced");
  };
  const std::string other = "no " + std::string(kind.name);
  std::error_code code;
  if (!fs::is_regular_file(path, code)) return keep(other);
  std::string begin(kind.begin.size(), '\0');
  const FilePtr old(std::fopen(path.c_str(), "rb"));
  const std::size_t got = old ? std::fread(begin.data(), 1, begin.size(), old.get()) : 0;
  if (!old || std::ferror(old.get()) != 0)
    return keep("cannot be read (" + std::string(std::strerror(errno)) + ")");
  if (got > 0 && begin != kind.begin) return keep(other);
  return Ok{};
}

}  // namespace

Status check_growing_file(const fs::path& path, const FileKind& kind) {
  const std::string name(kind.name);
  if (path == "-")
    return Error{ErrorKind::kUsage,
                 "-: a " + name + " is not written to standard output, give a file"};
  std::error_code code;
  const fs::path file = growing_target(path);
  if (file.empty()) return growing_fault(path, "is a link to nowhere");
  const auto folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  if (::access(folder.c_str(), W_OK) != 0) return growing_fault(path, std::strerror(errno));
  if (!fs::exists(path, code)) return Ok{};
  if (Status checked = check_replaceable(path, kind); !checked.ok()) return checked;
  if (::access(path.c_str(), W_OK) != 0) return growing_fault(path, std::strerror(errno));
  return Ok{};
}

Result<FilePtr> create_growing_file(const fs::path& path, const FileKind& kind) {
  if (Status checked = check_growing_file(path, kind); !checked.ok()) return checked.error();
  const fs::path target = growing_target(path);
  std::error_code ignored;
  fs::remove(target, ignored);
  FilePtr file(std::fopen(target.c_str(), "wbx"));
  if (!file) return growing_fault(path, std::strerror(errno));
  return file;
}

}  // namespace ygslam
