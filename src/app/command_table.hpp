// The commands and options as they were declared, for the manual page and for shells.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace ygslam {

struct CommandOption {
  std::vector<std::string> names;  ///< "-o", "--out"; of a positional one its name
  bool is_positional = false;
  std::string value;               ///< what it takes, as --help calls it; empty = a flag
  std::vector<std::string> words;  ///< those it takes, where they are few
  std::string meaning;
  std::string standing;  ///< default; empty = none
  bool is_required = false;
};

struct Command {
  std::string name;  ///< "run", "map info"; of the program itself empty
  std::string meaning, footer;
  std::vector<CommandOption> options;  ///< without --help
};

/// The program itself, then its commands in their order, each before those below it.
[[nodiscard]] std::vector<Command> command_table(const CLI::App& app);

}  // namespace ygslam
