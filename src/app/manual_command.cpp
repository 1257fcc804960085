#include "app/manual_command.hpp"

#include <cstdio>
#include <sstream>

#include "app/command_table.hpp"
#include "app/run_options.hpp"
#include "system/metrics.hpp"

namespace ygslam {
namespace {

/// Text that roff takes as it is (groff_char(7), man(7)).
std::string plain(const std::string& text) {
  std::string safe;
  bool begins = true;
  for (const char c : text) {
    if (begins && (c == '.' || c == '\'')) safe += "\\&";
    begins = c == '\n';
    if (c == '\\') {
      safe += "\\e";
    } else if (c == '-') {
      safe += "\\-";
    } else {
      safe += c;
    }
  }
  return safe;
}

std::string bold(const std::string& text) { return "\\fB" + plain(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + plain(text) + "\\fR"; }

std::string ended(std::string sentence) {
  if (!sentence.empty() && sentence.back() != '.') sentence += '.';
  return sentence;
}

std::string usage(const Command& command) {
  std::string line = bold("ygslam" + (command.name.empty() ? "" : " " + command.name));
  for (const CommandOption& option : command.options) {
    if (option.is_positional) {
      const std::string name = italic(option.names.front());
      line += option.is_required ? " " + name : " [" + name + "]";
    } else if (option.is_required) {
      line += " " + bold(option.names.back()) + " " + italic(option.value);
    }
  }
  return line + " [" + italic("OPTIONS") + "]";
}

std::string option_text(const CommandOption& option) {
  std::string text = ".TP\n";
  for (std::size_t i = 0; i < option.names.size(); ++i)
    text += (i == 0 ? "" : ", ") +
            (option.is_positional ? italic(option.names[i]) : bold(option.names[i]));
  if (!option.value.empty() && !option.is_positional) text += " " + italic(option.value);
  text += "\n" + plain(ended(option.meaning));
  if (option.is_required && !option.is_positional) text += " Required.";
  if (!option.standing.empty()) text += " Default: " + plain(option.standing) + ".";
  return text + "\n";
}

std::string as_it_is(const std::string& text) {
  return text.empty() ? ""
                      : ".PP\n.nf\n" + plain(text) + (text.back() == '\n' ? "" : "\n") + ".fi\n";
}

std::string settings() {
  SlamConfig config;
  const ConfigSchema schema = schema_of(config);
  std::string text =
      ".SH SETTINGS\nOf " + bold("--set") + " and of the file of " + bold("--config") + ".\n";
  for (const ConfigKey& key : schema.keys())
    text += ".TP\n" + bold(key.name) + " = " +
            plain(key.get() + (key.unit.empty() ? "" : " " + key.unit)) + "\n" +
            plain(ended(key.meaning)) + " Allowed: " + plain(key.range) +
            ". Change it: " + plain(ended(key.when)) + "\n";
  return text;
}

std::string manual_page(const CLI::App& app) {
  const std::vector<Command> table = command_table(app);
  const Command& program = table.front();
  std::string text = ".TH YGSLAM 1 \"\" \"ygslam " + plain(version()) +
                     "\" \"User Commands\"\n.SH NAME\nygslam \\- " + plain(program.meaning) +
                     "\n.SH SYNOPSIS\n" + bold("ygslam") + " " + italic("COMMAND") + " [" +
                     italic("OPTIONS") + "]\n.SH OPTIONS\nOf every command:\n";
  for (const CommandOption& option : program.options) text += option_text(option);
  text += ".TP\n" + bold("-h") + ", " + bold("--help") + "\nTell all of this of one command.\n";
  text += ".SH COMMANDS\n";
  for (std::size_t i = 1; i < table.size(); ++i) {
    const Command& command = table[i];
    text += ".SS \"" + plain(command.name) + "\"\n" + usage(command) + "\n.PP\n" +
            plain(ended(command.meaning)) + "\n";
    for (const CommandOption& option : command.options) text += option_text(option);
    text += as_it_is(command.footer);
  }
  return text + settings();
}

}  // namespace

void add_manual_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("manual", "Print the manual page, for man(1)");
  command->footer("Example:\n  ygslam manual > ygslam.1; man ./ygslam.1");
  command->callback([&app] { std::fputs(manual_page(app).c_str(), stdout); });
}

}  // namespace ygslam
