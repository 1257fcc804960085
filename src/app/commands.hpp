// The commands of `ygslam`. Each is registered as a subcommand and runs while the command line is
// parsed: data goes to stdout, errors, warnings and progress to stderr.
#pragma once

namespace CLI {
class App;
}

namespace ygslam {

/// @param exit_code set where it is not 0; must outlive the parsing.
void add_run_command(CLI::App& app, int& exit_code);
void add_localize_command(CLI::App& app, int& exit_code);
void add_eval_command(CLI::App& app, int& exit_code);
void add_bench_command(CLI::App& app, int& exit_code);
void add_calibrate_command(CLI::App& app, int& exit_code);
void add_simulate_command(CLI::App& app, int& exit_code);
void add_inspect_command(CLI::App& app, int& exit_code);
void add_map_command(CLI::App& app, int& exit_code);
void add_export_command(CLI::App& app, int& exit_code);
void add_render_command(CLI::App& app, int& exit_code);
void add_config_command(CLI::App& app);
/// @param app all of whose commands it tells of; to be added last.
void add_completion_command(CLI::App& app);

}  // namespace ygslam
