// The parts of the program that are written in Python: where they lie, and how they are run.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace ygslam {

/// A Python program of the folder tools/report and the interpreter for it.
struct PythonTool {
  std::filesystem::path python;
  std::filesystem::path script;  ///< a file or a folder with __main__.py
};

/// This program's own file.
[[nodiscard]] std::filesystem::path executable_path();

/// Looks for the folder of the report tools: $YGSLAM_REPORT; else tools/report of the source tree
/// above the executable; else share/ygslam/report of the installation. The interpreter is
/// $YGSLAM_PYTHON; else .venv/bin/python of the source tree; else python3 of the PATH.
/// @param script a file of that folder; empty: the folder itself.
/// @return kOutput saying what was looked for.
[[nodiscard]] Result<PythonTool> find_report_tool(const std::filesystem::path& executable,
                                                  const std::string& script = {});

/// Its command line.
[[nodiscard]] std::vector<std::string> tool_command(const PythonTool& tool,
                                                    const std::vector<std::string>& arguments);

/// Runs it to its end. @param what it makes, for the message, e.g. "the report".
/// @param stop asked a few times a second; true ends it.
/// @return kOutput with the last line it said, if it fails.
[[nodiscard]] Status run_tool(const PythonTool& tool, const std::vector<std::string>& arguments,
                              const std::string& what, const std::filesystem::path& input = {},
                              const std::function<bool()>& stop = {});

}  // namespace ygslam
