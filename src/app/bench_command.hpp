// `ygslam bench`: every sequence in every mode, several times, and a report.
#pragma once

namespace CLI {
class App;
}

namespace ygslam {

/// Registers the subcommand; it runs while the command line is parsed.
/// @param exit_code set where it is not 0; must outlive the parsing.
void add_bench_command(CLI::App& app, int& exit_code);

}  // namespace ygslam
