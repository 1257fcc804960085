// `ygslam config`: every setting with its default, unit, range and meaning.
#pragma once

namespace CLI {
class App;
}

namespace ygslam {

void add_config_command(CLI::App& app);

}  // namespace ygslam
