#include "app/command_table.hpp"

namespace ygslam {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> words;
  std::size_t from = 0;
  while (from <= text.size()) {
    const std::size_t to = std::min(text.find(separator, from), text.size());
    if (to > from) words.push_back(text.substr(from, to - from));
    from = to + 1;
  }
  return words;
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
  told.is_positional = told.names.empty();
  if (told.is_positional) told.names.push_back(option.get_name(true));
  if (option.get_items_expected_max() > 0) {
    told.value = option.get_type_name();
    told.words = words_of(told.value);
    // What follows a colon is how the value is checked, unless the words say it.
    const std::size_t check = told.value.find(told.words.empty() ? ":" : ":{");
    if (check != std::string::npos) told.value.erase(check);
    if (told.value == "TEXT" && !told.words.empty()) {
      told.value.clear();
      for (const std::string& word : told.words)
        told.value += (told.value.empty() ? "" : "|") + word;
    }
    told.standing = option.get_default_str();
  }
  told.meaning = option.get_description();
  told.is_required = option.get_required();
  return told;
}

void append(const CLI::App& app, const std::string& name, std::vector<Command>& table) {
  Command& command = table.emplace_back();
  command.name = name;
  command.meaning = app.get_description();
  command.footer = app.get_footer();
  for (const CLI::Option* option : app.get_options())
    if (option != app.get_help_ptr() && !option->get_group().empty())
      command.options.push_back(described(*option));
  for (const CLI::App* sub : app.get_subcommands(nullptr))
    append(*sub, name.empty() ? sub->get_name() : name + " " + sub->get_name(), table);
}

}  // namespace

std::vector<Command> command_table(const CLI::App& app) {
  std::vector<Command> table;
  append(app, "", table);
  return table;
}

}  // namespace ygslam
