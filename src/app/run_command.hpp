// `ygslam run`: a recording in, a trajectory and a static map out.
#pragma once

namespace CLI {
class App;
}

namespace ygslam {

/// Registers the subcommand; it runs while the command line is parsed.
/// @param exit_code set where it is not 0; must outlive the parsing.
void add_run_command(CLI::App& app, int& exit_code);
void add_localize_command(CLI::App& app, int& exit_code);

}  // namespace ygslam
