// `ygslam simulate`: rendered worlds as sequences with exact truth.
#pragma once

namespace CLI {
class App;
}

namespace ygslam {

/// Registers the subcommand. When it is chosen it runs while the command line is parsed: data goes
/// to stdout, log and progress bar to stderr.
/// @param exit_code set to the process's exit code where that is not 0; must outlive the parsing.
void add_simulate_command(CLI::App& app, int& exit_code);

}  // namespace ygslam
