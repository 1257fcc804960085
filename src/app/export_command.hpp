// `ygslam export`: the static scene of a saved map.
#pragma once

namespace CLI {
class App;
}

namespace ygslam {

/// @param exit_code set by the command.
void add_export_command(CLI::App& app, int& exit_code);

}  // namespace ygslam
