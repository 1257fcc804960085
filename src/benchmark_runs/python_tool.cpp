#include "benchmark_runs/python_tool.hpp"

#include <cstdlib>

#include "benchmark_runs/child_process.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr int kLevelsUp = 4;  // build/release/ygslam lies two folders below the source tree

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

bool is_installed(const fs::path& path) {
  std::error_code code;
  return fs::exists(path, code);
}

fs::path interpreter(const fs::path& root) {
  if (const std::string given = environment("YGSLAM_PYTHON"); !given.empty()) return given;
  const fs::path own = root / ".venv" / "bin" / "python";
  return !root.empty() && is_installed(own) ? own : fs::path("python3");
}

}  // namespace

fs::path executable_path() {
  std::error_code code;
  return fs::read_symlink("/proc/self/exe", code);
}

Result<PythonTool> find_report_tool(const fs::path& executable, const std::string& script) {
  const std::string needed = script.empty() ? "__main__.py" : script;
  const auto tool = [&](const fs::path& folder, const fs::path& root) {
    return PythonTool{interpreter(root), script.empty() ? folder : folder / script};
  };
  fs::path root = executable.parent_path();
  const std::string given = environment("YGSLAM_REPORT");
  for (int level = 0; level < kLevelsUp && !root.empty(); ++level, root = root.parent_path()) {
    if (!given.empty()) {
      if (is_installed(root / "tools" / "report"))
        break;  // its interpreter is still the one to use
      continue;
    }
    const fs::path source = root / "tools" / "report";
    if (is_installed(source / needed)) return tool(source, root);
    const fs::path installed = root / "share" / "ygslam" / "report";
    if (is_installed(installed / needed)) return tool(installed, {});
  }
  if (!given.empty()) {
    if (is_installed(fs::path(given) / needed)) return tool(given, root);
    return Error{ErrorKind::kOutput, "$YGSLAM_REPORT: no " + (fs::path(given) / needed).string()};
  }
  return Error{ErrorKind::kOutput,
               "tools/report/" + needed + " found neither above " +
                   executable.parent_path().string() +
                   " nor in an installation's share/ygslam; set YGSLAM_REPORT to its folder"};
}

std::vector<std::string> tool_command(const PythonTool& tool,
                                      const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {tool.python.string(), "-B",  // writes no caches
                                      tool.script.string()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return command;
}

Status run_tool(const PythonTool& tool, const std::vector<std::string>& arguments,
                const std::string& what, const fs::path& input, const std::function<bool()>& stop) {
  const auto done = run_child(tool_command(tool, arguments), input, stop);
  if (!done.ok()) return done.error();
  if (done->exit_code == 0 && done->signal == 0) return Ok{};
  std::string why = last_error_line(done->errors);
  if (why.empty()) {
    why = done->signal != 0 ? "ended by signal " + std::to_string(done->signal)
                            : "exit code " + std::to_string(done->exit_code);
  }
  const bool lacks_package = why.find("No module named") != std::string::npos;
  // The program of a wheel is called with both set, by its package.
  const bool is_wheel = std::getenv("YGSLAM_REPORT") != nullptr && std::getenv("YGSLAM_PYTHON");
  const std::string mend =
      is_wheel ? tool.python.string() + " -m pip install \"ygslam[report]\"" : "`make setup`";
  return Error{ErrorKind::kOutput,
               what + " cannot be made: " + why +
                   (lacks_package ? " (python is " + tool.python.string() + "; " + mend +
                                        " installs what is needed, or set YGSLAM_PYTHON)"
                                  : std::string())};
}

}  // namespace ygslam
