// The live page as a command was asked for it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "live/run_view.hpp"

namespace CLI {
class App;
}

namespace ygslam {

struct ViewOptions {
  std::optional<std::string> address{};  ///< where it listens; none = nowhere
  bool paused = false;                   ///< before the first frame
  bool stay = false;                     ///< after the end, until it is interrupted
  std::string token;                     ///< empty = a new one
  std::vector<std::string> origins;
};

/// --view and what belongs to it.
void add_view_options(CLI::App& command, ViewOptions& options);

/// Opens the page of --view and prints its address.
/// @param config without server and paused, which the options say.
/// @return kUsage of its options; see RunView::start().
[[nodiscard]] Result<std::unique_ptr<RunView>> start_page(const ViewOptions& options,
                                                          RunViewConfig config);

}  // namespace ygslam
