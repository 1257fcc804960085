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
bool may_be_replaced(const fs::path& path, const FileKind& kind) {
  std::error_code code;
  if (!fs::is_regular_file(path, code)) return false;
  std::string begin(kind.begin.size(), '\0');
  const FilePtr old(std::fopen(path.c_str(), "rb"));
  const std::size_t got = old ? std::fread(begin.data(), 1, begin.size(), old.get()) : 0;
  return got == 0 || begin == kind.begin;
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
  if (!may_be_replaced(path, kind))
    return growing_fault(path, "is there and no " + name + "; it is not replaced");
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
