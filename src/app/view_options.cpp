#include "app/view_options.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>

#include "core/printable.hpp"

namespace ygslam {

void add_view_options(CLI::App& command, ViewOptions& o) {
  const auto watching = [](CLI::Option* option) { return option->group("Watching"); };
  CLI::Option* view =
      watching(command.add_option("--view", o.address,
                                  "Show it on a page, by default at 127.0.0.1:8765 (docs/live.md)"))
          ->type_name("[[ADDRESS:]PORT]")
          ->expected(0, 1)
          ->check(CLI::Validator(
              [](const std::string& text) {
                return parse_view_address(text).ok()
                           ? std::string()
                           : "'" + text +
                                 "': PORT or ADDRESS:PORT is meant (a SEQUENCE goes before)";
              },
              ""))
          ->default_str("");
  watching(
      command.add_flag("--view-paused", o.paused, "Wait before the first frame for Resume or Step"))
      ->needs(view);
  watching(command.add_flag("--view-stay", o.stay, "Keep the page after the end, until Ctrl-C"))
      ->needs(view);
  watching(command.add_option(
               "--view-token", o.token,
               "Whoever knows it may drive the run; needed to look on from other machines "
               "(default: a new one)"))
      ->type_name("TEXT")
      ->needs(view);
  watching(command.add_option("--view-origin", o.origins,
                              "Page of another program that may connect, e.g. "
                              "https://app.example.org"))
      ->type_name("ORIGIN")
      ->needs(view);
}

Result<std::unique_ptr<RunView>> start_page(const ViewOptions& o, RunViewConfig config) {
  auto server = parse_view_address(*o.address);
  if (!server.ok()) return server.error();
  constexpr const char* kOfTokens =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";  // as in addresses
  if (o.token.find_first_not_of(kOfTokens) != std::string::npos)
    return Error{ErrorKind::kUsage, "--view-token: letters, digits and -._~ only"};
  config.server = *server;
  config.server.token = o.token;
  config.server.origins = o.origins;
  config.paused = o.paused;
  auto view = RunView::start(config);
  if (!view.ok()) return view.error();
  std::fprintf(stderr, "look at %s\n", one_line((*view)->url()).c_str());
  return view;
}

}  // namespace ygslam
