#include "app/commands.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>

#include "app/run_options.hpp"

namespace ygslam {

void add_config_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "config", "List every setting: default, range, meaning, and when to change it");
  command->footer(
      "Use one with `ygslam run ... --set motion.tau_px=1.5`, or several in a YAML file:\n"
      "  motion:\n    tau_px: 1.5\n");
  command->callback([] {
    SlamConfig config;
    const ConfigSchema schema = schema_of(config);
    for (const ConfigKey& key : schema.keys()) {
      const std::string value = key.get() + (key.unit.empty() ? "" : " " + key.unit);
      std::printf("%-30s %-16s %s (%s)\n%-47s change it: %s\n", key.name.c_str(), value.c_str(),
                  key.meaning.c_str(), key.range.c_str(), "", key.when.c_str());
    }
  });
}

}  // namespace ygslam
