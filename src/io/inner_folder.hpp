// Folders within a folder of results.
#pragma once

#include <filesystem>
#include <system_error>

#include "core/result.hpp"

namespace ygslam {

/// Whether all of `inner` below `outer`, as far as it is there, is a folder and no link: the user
/// named `outer`, and what goes into it shall lie there. @return kOutput.
[[nodiscard]] inline Status check_inner_folder(const std::filesystem::path& outer,
                                               const std::filesystem::path& inner) {
  std::error_code code;
  std::filesystem::path folder = outer;
  for (const std::filesystem::path& part : inner) {
    folder /= part;
    if (std::filesystem::is_symlink(folder, code))
      return Error{ErrorKind::kOutput, folder.string() +
                                           ": is a link: what is written there would not lie in " +
                                           outer.string()};
  }
  return Ok{};
}

/// Makes it, with those above. @return kOutput.
[[nodiscard]] inline Status make_inner_folder(const std::filesystem::path& outer,
                                              const std::filesystem::path& inner) {
  if (Status checked = check_inner_folder(outer, inner); !checked.ok()) return checked;
  std::error_code code;
  std::filesystem::create_directories(outer / inner, code);
  if (code) return Error{ErrorKind::kOutput, (outer / inner).string() + ": " + code.message()};
  return Ok{};
}

}  // namespace ygslam
