#include "app/completion_command.hpp"

#include <fmt/ranges.h>

#include <cstdio>
#include <memory>
#include <set>

#include "app/command_table.hpp"
#include "app/run_options.hpp"
#include "simulation/world/world_config.hpp"

namespace ygslam {
namespace {

constexpr const char* kHead = R"(# bash completion for ygslam, made by `ygslam completion bash`.
_ygslam() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]}
  local command= word words= kind= key=
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    case "$command/$word" in
)";

// What the words are of, then: bash takes KEY=VALUE for three words.
constexpr const char* kMiddle = R"(    esac
  done
  if [[ $cur == = ]]; then
    key=$prev cur=
  elif [[ $prev == = ]]; then
    key=${COMP_WORDS[COMP_CWORD-2]}
  fi
  if [[ -n $key ]]; then
    case "$key" in
)";

constexpr const char* kOptions = R"(    esac
  else
    case "$command/$prev" in
)";

constexpr const char* kCommands = R"(      *)
        if [[ $cur == -* ]]; then
          case "$command" in
)";

constexpr const char* kPlaces = R"(          esac
        else
          case "$command" in
)";

constexpr const char* kTail = R"(          esac
        fi;;
    esac
  fi
  COMPREPLY=()
  if [[ -n $words ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$cur")
    [[ $kind == key ]] && compopt -o nospace 2>/dev/null
  fi
  if [[ $kind == file || $kind == folder ]]; then
    local paths=() actions=-f
    [[ $kind == folder ]] && actions=-d
    mapfile -t paths < <(compgen $actions -- "$cur")
    COMPREPLY+=("${paths[@]}")
    compopt -o filenames 2>/dev/null
  fi
  return 0
}
complete -F _ygslam ygslam
)";

std::string line(const std::string& pattern, const std::string& does) {
  return "      " + pattern + ") " + does + ";;\n";
}

std::string words(const std::vector<std::string>& words) {
  return fmt::format("words='{}'", fmt::join(words, " "));
}

/// What a value may be: a file, a folder, one of some words; otherwise nothing is offered.
std::string value_of(const CommandOption& option) {
  if (option.names.back() == "--set") return "kind=key words=$settings";
  if (!option.words.empty()) return words(option.words);
  if (option.value.starts_with("DIR")) return "kind=folder";
  const bool is_file = option.value.find("FILE") != std::string::npos || option.value == "NEW" ||
                       option.names.back() == "--out";
  return is_file ? "kind=file" : ":";
}

std::string bash_completion(const CLI::App& app) {
  const std::vector<Command> table = command_table(app);
  std::string script = kHead;
  for (const Command& command : table) {
    if (command.name.empty()) continue;
    const std::size_t blank = command.name.find(' ');
    const std::string above = blank == std::string::npos ? "" : command.name.substr(0, blank);
    const std::string own =
        blank == std::string::npos ? command.name : command.name.substr(blank + 1);
    script += line("'" + above + "/" + own + "'", "command='" + command.name + "'");
  }
  script += kMiddle;
  SlamConfig config;
  const ConfigSchema schema = schema_of(config);
  std::vector<std::string> keys;
  for (const ConfigKey& key : schema.keys()) {
    keys.push_back(key.name + "=");
    if (key.range.find(" | ") == std::string::npos) continue;
    std::string choices = key.range;
    for (std::size_t at; (at = choices.find(" | ")) != std::string::npos;)
      choices.replace(at, 3, " ");
    script += line(key.name, "words='" + choices + "'");
  }
  script += kOptions;
  std::string settings = "local settings='" + fmt::format("{}", fmt::join(keys, " ")) + "'\n  ";
  script.insert(script.find("local command="), settings);
  for (const Command& command : table)
    for (const CommandOption& option : command.options)
      if (!option.is_positional && !option.value.empty())
        for (const std::string& name : option.names)
          script += line("'" + command.name + "/" + name + "'", value_of(option));
  script += kCommands;
  const auto names_of = [&](const Command& command) {
    std::vector<std::string> names = {"--help"};
    for (const Command* told : {&table.front(), &command})
      for (const CommandOption& option : told->options)
        for (const std::string& name : option.names)
          if (name.starts_with("--")) names.push_back(name);
    std::set<std::string> once;
    std::erase_if(names, [&](const std::string& name) { return !once.insert(name).second; });
    return names;
  };
  for (const Command& command : table)
    script += "      " + line("'" + command.name + "'", words(names_of(command)));
  script += kPlaces;
  for (const Command& command : table) {
    std::vector<std::string> offered;
    const std::string prefix = command.name.empty() ? "" : command.name + " ";
    for (const Command& other : table)
      if (other.name.starts_with(prefix) && other.name.size() > prefix.size() &&
          other.name.find(' ', prefix.size()) == std::string::npos)
        offered.push_back(other.name.substr(prefix.size()));
    bool takes_file = false;
    for (const CommandOption& option : command.options) {
      if (!option.is_positional) continue;
      takes_file = takes_file || option.words.empty();
      offered.insert(offered.end(), option.words.begin(), option.words.end());
    }
    if (command.name == "simulate")
      for (const sim::WorldName& world : sim::known_worlds()) offered.push_back(world.name);
    script += "      " +
              line("'" + command.name + "'", (takes_file ? "kind=file " : "") + words(offered));
  }
  return script + kTail;
}

}  // namespace

void add_completion_command(CLI::App& app) {
  const auto shell = std::make_shared<std::string>();
  CLI::App* command =
      app.add_subcommand("completion", "Print what lets a shell complete commands and options");
  command->add_option("SHELL", *shell, "Which one")->required()->check(CLI::IsMember({"bash"}));
  command->footer("Example, for the shell that runs:\n  source <(ygslam completion bash)");
  command->callback([&app, shell] { std::fputs(bash_completion(app).c_str(), stdout); });
}

}  // namespace ygslam
