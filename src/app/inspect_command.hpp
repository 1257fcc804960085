// `ygslam inspect`: classic check, improved check and full system side by side (the paper's Fig.
// 5), and how right they are where the truth is known.
#pragma once

namespace CLI {
class App;
}

namespace ygslam {

void add_inspect_command(CLI::App& app, int& exit_code);

}  // namespace ygslam
