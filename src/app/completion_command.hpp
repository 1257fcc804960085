// `ygslam completion`.
#pragma once

namespace CLI {
class App;
}

namespace ygslam {

/// @param app all of whose commands it tells of; to be added last.
void add_completion_command(CLI::App& app);

}  // namespace ygslam
