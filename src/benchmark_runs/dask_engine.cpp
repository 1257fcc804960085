#include "benchmark_runs/dask_engine.hpp"

#include "benchmark_runs/python_tool.hpp"
#include "io/json_text.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

Result<PythonTool> find_tool() { return find_report_tool(executable_path(), "dask_engine.py"); }

// The tool's last line on stderr, as JSON.
Result<nlohmann::json> outcome_of(const ChildExit& exit) {
  std::string said = exit.errors;
  while (said.ends_with('\n')) said.pop_back();
  said.erase(0, said.rfind('\n') + 1);
  if (exit.exit_code == 0 && exit.signal == 0) {
    auto json = parse_json(said, "the engine's tool");
    if (json.ok() && json->is_object()) return json;
  }
  std::string why = last_error_line(exit.errors);
  if (why.empty()) why = "its tool ended without a word";
  const bool lacks_package = why.find("No module named") != std::string::npos;
  return Error{ErrorKind::kOutput, "the engine cannot be used: " + why +
                                       (lacks_package ? " (`pip install distributed`, or set "
                                                        "YGSLAM_PYTHON to a Python that has it)"
                                                      : "")};
}

}  // namespace

Result<int> engine_slots(const SweepOptions& options, const std::vector<BenchSequence>& sequences,
                         const std::function<bool()>& stop) {
  const auto tool = find_tool();
  if (!tool.ok()) return tool.error();
  auto command = tool_command(
      *tool, {"check", options.engine, options.out.string(), options.program.string()});
  if (!options.model.empty()) command.push_back(options.model.string());
  for (const BenchSequence& sequence : sequences) {
    if (sequence.error) continue;
    command.push_back(sequence.folder.string());
    const auto masks = masks_folder(options, sequence);
    if (masks && any_uses_masks(options.modes)) command.push_back(masks->string());
  }
  const auto done = run_child(command, {}, stop);
  if (!done.ok()) return done.error();
  const auto outcome = outcome_of(*done);
  if (!outcome.ok()) return outcome.error();
  return outcome->value("slots", 1);
}

Result<std::vector<std::string>> engine_command(const SweepOptions& options, const fs::path& folder,
                                                double limit_s,
                                                const std::vector<std::string>& command) {
  const auto tool = find_tool();
  if (!tool.ok()) return tool.error();
  auto words =
      tool_command(*tool, {"run", options.engine, folder.string(), std::to_string(limit_s)});
  words.insert(words.end(), command.begin(), command.end());
  return words;
}

Result<ChildExit> exit_on_worker(const ChildExit& handing) {
  const auto outcome = outcome_of(handing);
  if (!outcome.ok()) return outcome.error();
  try {
    ChildExit exit;
    exit.exit_code = outcome->at("exit_code");
    exit.signal = outcome->at("signal");
    exit.wall_s = outcome->at("wall_s");
    exit.timed_out = outcome->at("timed_out");
    exit.errors = outcome->at("errors");
    return exit;
  } catch (const nlohmann::json::exception& fault) {
    return Error{ErrorKind::kOutput, std::string("the engine cannot be used: ") + fault.what()};
  }
}

}  // namespace ygslam
