// `ygslam map`: looks into map files, checks them, saves what is left of damaged ones.
#pragma once

namespace CLI {
class App;
}

namespace ygslam {

/// Registers the subcommand; it runs while the command line is parsed.
/// @param exit_code set where it is not 0; must outlive the parsing.
void add_map_command(CLI::App& app, int& exit_code);

}  // namespace ygslam
