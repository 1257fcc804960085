// A file that grows under its own name while it is written, so that something of it is there
// whatever ends the program.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>

#include "core/result.hpp"

namespace ygslam {

/// What a file is, and how each of its kind begins.
struct FileKind {
  std::string_view name;  ///< "recording"
  std::string_view begin;
};

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using FilePtr = std::unique_ptr<std::FILE, CloseFile>;

/// Whether create_growing_file() can be expected to do; nothing is written.
/// @return kOutput where a file cannot be written, or one of another kind is there; kUsage for "-".
[[nodiscard]] Status check_growing_file(const std::filesystem::path& path, const FileKind& kind);

/// An empty file in place of an older one of its kind, or of that which a link of that name leads
/// to. Whoever has the old one open, or under another name, keeps it.
/// @return as check_growing_file().
[[nodiscard]] Result<FilePtr> create_growing_file(const std::filesystem::path& path,
                                                  const FileKind& kind);

}  // namespace ygslam
