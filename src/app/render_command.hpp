// `ygslam render`: pictures of a scene's files.
#pragma once

namespace CLI {
class App;
}

namespace ygslam {

void add_render_command(CLI::App& app, int& exit_code);

}  // namespace ygslam
