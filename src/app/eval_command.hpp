// `ygslam eval`: estimated trajectories against the truth.
#pragma once

namespace CLI {
class App;
}

namespace ygslam {

/// Registers the subcommand. When it is chosen it runs while the command line is parsed: data goes
/// to stdout, errors and warnings to stderr.
/// @param exit_code set to the process's exit code where that is not 0; must outlive the parsing.
void add_eval_command(CLI::App& app, int& exit_code);

}  // namespace ygslam
