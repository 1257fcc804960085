// Where a run writes beside its results: looked at before the first frame, named at the end.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/run_options.hpp"

namespace ygslam {

/// @return kUsage where a file would be written twice, or is read; kOutput where --mcap or --trace
/// cannot be written, or a folder of --background is a link. Nothing is written.
[[nodiscard]] Status check_targets(const RunOptions& options, const Sequence& sequence);

/// Whether --save-map names a file that is there and that --load-map does not go on with.
[[nodiscard]] bool replaces_map(const RunOptions& options);

/// Folders that were not there before: in the end those that are empty go again.
class NewFolders {
 public:
  explicit NewFolders(const RunOptions& options);
  NewFolders(std::initializer_list<std::string> folders);
  NewFolders(const NewFolders&) = delete;
  NewFolders& operator=(const NewFolders&) = delete;
  ~NewFolders();

 private:
  std::vector<std::filesystem::path> folders_;
};

/// "written: out, scene (--export), ...". @param has_dense a dense map lies beside --save-map.
/// @param has_background --background was drawn, which an interrupted run does not.
[[nodiscard]] std::string targets_text(const RunOptions& options, bool has_dense,
                                       bool has_background);

}  // namespace ygslam
