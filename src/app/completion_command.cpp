#include "app/commands.hpp"

#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "app/run_options.hpp"
#include "app/standard_streams.hpp"
#include "simulation/world/world_config.hpp"

namespace ygslam {
namespace {

/// What is of one shell alone; the cases between these are the same for all.
struct Shell {
  const char* head;   ///< the words before the one in question
  const char* value;  ///< `key` where the word is the value of KEY=VALUE
  const char* tail;   ///< offers what was found
};

// It takes KEY=VALUE for three words.
constexpr Shell kBash = {R"(# bash completion for ygslam, made by `ygslam completion bash`.
_ygslam() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]}
  local command= word offers= kind= key=
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
)",
                         R"(  if [[ $cur == = ]]; then
    key=$prev cur=
  elif [[ $prev == = ]]; then
    key=${COMP_WORDS[COMP_CWORD-2]}
  fi
)",
                         R"(  COMPREPLY=()
  if [[ -n $offers ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$offers" -- "$cur")
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
)"};

// Its file is found by its first line and is then itself the function; or it is sourced.
constexpr Shell kZsh = {R"(#compdef ygslam
# zsh completion for ygslam, made by `ygslam completion zsh`.
_ygslam() {
  local cur=${words[CURRENT]} prev=${words[CURRENT-1]}
  local command= word= offers= kind= key=
  for word in "${(@)words[2,CURRENT-1]}"; do
)",
                        R"(  if [[ $cur == *=* ]]; then
    key=${${cur%=*}##*=}
    compset -P '*='
  fi
)",
                        R"(  local ended=1 after=' '
  [[ $kind == key ]] && after=
  compadd -S "$after" -- ${=offers} && ended=0
  [[ $kind == file ]] && _files && ended=0
  [[ $kind == folder ]] && _files -/ && ended=0
  return ended
}
if [[ $funcstack[1] == _ygslam ]]; then
  _ygslam "$@"
else
  compdef _ygslam ygslam
fi
)"};

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

constexpr const char* kEnd = R"(          esac
        fi;;
    esac
  fi
)";

struct CommandOption {
  std::vector<std::string> names;  // "-o", "--out"; of a positional one none
  std::string value;               // what it takes, as --help calls it; empty = a flag
  std::vector<std::string> words;  // those it takes, where they are few
};

struct Command {
  std::string name;  // "run", "map info"; of the program itself empty
  std::vector<CommandOption> options;
};

std::vector<std::string> split(const std::string& text, char separator) {
  std::istringstream words(text);
  std::vector<std::string> all;
  for (std::string word; std::getline(words, word, separator);)
    if (!word.empty()) all.push_back(word);
  return all;
}

/// "TEXT:{jpg,png}", "model|none|masks:DIR": of the last one what stands before what follows it.
std::vector<std::string> words_of(const std::string& type) {
  const std::size_t open = type.find('{');
  const std::size_t close = type.find('}');
  if (open != std::string::npos && close != std::string::npos)
    return split(type.substr(open + 1, close - open - 1), ',');
  if (type.find('|') == std::string::npos) return {};
  std::vector<std::string> words = split(type, '|');
  for (std::string& word : words)
    if (const std::size_t colon = word.find(':'); colon != std::string::npos) word.erase(colon + 1);
  return words;
}

CommandOption described(const CLI::Option& option) {
  CommandOption told;
  for (const std::string& name : option.get_snames()) told.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) told.names.push_back("--" + name);
  if (option.get_items_expected_max() > 0) {
    told.value = option.get_type_name();
    told.words = words_of(told.value);
  }
  return told;
}

/// The command, then those below it in their order.
void append(const CLI::App& app, const std::string& name, std::vector<Command>& table) {
  Command& command = table.emplace_back();
  command.name = name;
  for (const CLI::Option* option : app.get_options())
    if (option != app.get_help_ptr() && !option->get_group().empty())
      command.options.push_back(described(*option));
  for (const CLI::App* sub : app.get_subcommands(nullptr))
    append(*sub, name.empty() ? sub->get_name() : name + " " + sub->get_name(), table);
}

std::vector<Command> command_table(const CLI::App& app) {
  std::vector<Command> table;
  append(app, "", table);
  return table;
}

std::string line(const std::string& pattern, const std::string& does) {
  return "      " + pattern + ") " + does + ";;\n";
}

std::string words(const std::vector<std::string>& words) {
  return fmt::format("offers='{}'", fmt::join(words, " "));
}

/// What a value may be: a file, a folder, one of some words; otherwise nothing is offered.
std::string value_of(const CommandOption& option) {
  if (option.names.back() == "--set") return "kind=key offers=$settings";
  if (!option.words.empty()) return words(option.words);
  if (option.value.starts_with("DIR")) return "kind=folder";
  const bool is_file = option.value.find("FILE") != std::string::npos ||
                       option.value.starts_with("NEW") || option.names.back() == "--out";
  return is_file ? "kind=file" : ":";
}

std::string completion(const CLI::App& app, const Shell& shell) {
  const std::vector<Command> table = command_table(app);
  SlamConfig config;
  const ConfigSchema schema = schema_of(config);
  std::vector<std::string> keys;
  for (const ConfigKey& key : schema.keys()) keys.push_back(key.name + "=");
  std::string script = shell.head;
  const std::string settings = fmt::format("local settings='{}'\n  ", fmt::join(keys, " "));
  script.insert(script.find("local command="), settings);
  script += "    case \"$command/$word\" in\n";
  for (const Command& command : table) {
    if (command.name.empty()) continue;
    const std::size_t blank = command.name.find(' ');
    const std::string above = blank == std::string::npos ? "" : command.name.substr(0, blank);
    const std::string own =
        blank == std::string::npos ? command.name : command.name.substr(blank + 1);
    script += line("'" + above + "/" + own + "'", "command='" + command.name + "'");
  }
  script += "    esac\n  done\n" + std::string(shell.value) +
            "  if [[ -n $key ]]; then\n    case \"$key\" in\n";
  for (const ConfigKey& key : schema.keys()) {
    if (key.range.find(" | ") == std::string::npos) continue;
    std::string choices = key.range;
    for (std::size_t at; (at = choices.find(" | ")) != std::string::npos;)
      choices.replace(at, 3, " ");
    script += line(key.name, "offers='" + choices + "'");
  }
  script += kOptions;
  for (const Command& command : table)
    for (const CommandOption& option : command.options)
      if (!option.value.empty())
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
      if (!option.names.empty()) continue;
      takes_file = takes_file || option.words.empty();
      offered.insert(offered.end(), option.words.begin(), option.words.end());
    }
    if (command.name == "simulate")
      for (const sim::WorldName& world : sim::known_worlds()) offered.push_back(world.name);
    script += "      " +
              line("'" + command.name + "'", (takes_file ? "kind=file " : "") + words(offered));
  }
  return script + kEnd + shell.tail;
}

}  // namespace

void add_completion_command(CLI::App& app) {
  const auto shell = std::make_shared<std::string>();
  CLI::App* command =
      app.add_subcommand("completion", "Print what lets a shell complete commands and options");
  command->add_option("SHELL", *shell, "Which one")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh"}));
  command->footer("Example, for the shell that runs:\n  source <(ygslam completion bash)");
  command->callback([&app, shell] { print_text(completion(app, *shell == "zsh" ? kZsh : kBash)); });
}

}  // namespace ygslam
