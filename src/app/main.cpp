#include <spdlog/sinks/stdout_color_sinks.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <opencv2/core/utility.hpp>
#include <span>

#include "app/commands.hpp"
#include "app/program_log.hpp"
#include "app/standard_streams.hpp"
#include "core/memory.hpp"
#include "io/text.hpp"
#include "system/failure.hpp"
#include "system/metrics.hpp"

namespace {

constexpr std::size_t kLeastMemory_bytes = std::size_t{16} << 20;  // without it: out of memory
constexpr std::size_t kLongestComplaint = 500;

/// Mostly a variable of a script that was never set: not to be taken for an option not given.
void refuse_empty_values(CLI::App& app) {
  for (CLI::Option* option : app.get_options())
    if (option->get_items_expected_max() > 0)
      option->check([](const std::string& value) { return value.empty() ? "is empty" : ""; });
  for (CLI::App* command : app.get_subcommands({})) refuse_empty_values(*command);
}

/// Of a word that stands where a command should; empty where it is one.
std::string unknown_command(const CLI::App& app, std::span<char* const> arguments) {
  const CLI::App* current = &app;
  for (const std::string word : arguments) {
    if (word.starts_with('-')) continue;
    const auto below = current->get_subcommands([](const CLI::App*) { return true; });
    if (below.empty()) return "";
    const auto found = std::find_if(below.begin(), below.end(),
                                    [&](const CLI::App* sub) { return sub->check_name(word); });
    if (found != below.end()) {
      current = *found;
      continue;
    }
    std::vector<std::string_view> names;
    for (const CLI::App* sub : below) names.push_back(sub->get_name());
    const std::string_view nearest = ygslam::nearest_word(word, names);
    return "no command '" + ygslam::printable(word) + "'" +
           (nearest.empty() ? "" : ": did you mean " + std::string(nearest) + "?");
  }
  return "";
}

/// Of a word that looks like an option of the command; empty where all are.
std::string unknown_option(const CLI::App& app, std::span<char* const> arguments) {
  const CLI::App* current = &app;
  for (const std::string word : arguments) {
    if (word == "--") break;
    if (!word.starts_with("--")) {
      const auto below = current->get_subcommands([](const CLI::App*) { return true; });
      const auto found =
          std::ranges::find_if(below, [&](const CLI::App* sub) { return sub->check_name(word); });
      if (found != below.end()) current = *found;
      continue;
    }
    const std::string name = word.substr(0, word.find('='));
    if (current->get_option_no_throw(name) != nullptr || app.get_option_no_throw(name) != nullptr)
      continue;
    std::vector<std::string> names;
    for (const CLI::Option* option : current->get_options())
      for (const std::string& one : option->get_lnames()) names.push_back("--" + one);
    const auto beginning =
        std::ranges::find_if(names, [&](const std::string& one) { return name.starts_with(one); });
    const std::vector<std::string_view> views(names.begin(), names.end());
    const std::string nearest(beginning != names.end() ? std::string_view(*beginning)
                                                       : ygslam::nearest_word(name, views));
    return "no option '" + ygslam::printable(name, kLongestComplaint) + "'" +
           (nearest.empty() ? "" : ": did you mean " + nearest + "?");
  }
  return "";
}

/// Whether the command's work is in files or on a page, so that it is done whether or not somebody
/// reads what it tells.
bool works_elsewhere(const CLI::App& app) {
  constexpr std::array kOfFiles = {"run", "localize", "simulate", "bench", "export", "render"};
  constexpr std::array kOfMaps = {"recover", "export", "merge"};
  constexpr std::array kPrinting = {"--list", "--compare", "--help"};
  for (const CLI::App* command : app.get_subcommands()) {
    if (command->get_name() == "map")
      return std::ranges::any_of(kOfMaps, [&](const char* sub) {
        return command->got_subcommand(command->get_subcommand(sub));
      });
    for (const char* option : kPrinting)
      if (const CLI::Option* printing = command->get_option_no_throw(option);
          printing != nullptr && printing->count() > 0)
        return false;
    return std::ranges::find(kOfFiles, command->get_name()) != kOfFiles.end();
  }
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  ygslam::settle_standard_streams();
  spdlog::set_default_logger(spdlog::stderr_color_mt("ygslam"));
  spdlog::set_pattern("%^%l%$: %v");
  const ygslam::log::ScopedSink log_sink(ygslam::program_log());
  try {
    // TBB, which OpenCV starts here, waits for itself without end where its first memory fails.
    ygslam::require_memory(kLeastMemory_bytes);
    ygslam::share_free_memory();
    cv::setNumThreads(1);  // the stages have threads of their own; a robot may have two cores
    CLI::App app{"RGB-D SLAM for rooms with people in them", "ygslam"};
    app.set_version_flag("--version", ygslam::version());
    app.require_subcommand(1);
    app.failure_message([&](const CLI::App*, const CLI::Error& e) {
      const std::span words{argv + 1, static_cast<std::size_t>(std::max(argc - 1, 0))};
      std::string unknown = unknown_command(app, words);
      if (unknown.empty()) unknown = unknown_option(app, words);
      // CLI11 quotes what was written, whatever bytes that are.
      return "error: " +
             (unknown.empty() ? ygslam::printable(e.what(), kLongestComplaint) : unknown) +
             " (see --help)\n";
    });
    app.fallthrough();
    app.add_flag_callback(
           "--quiet", [] { spdlog::set_level(spdlog::level::err); }, "Errors only")
        ->trigger_on_parse();
    const auto show_details = [&] {
      spdlog::set_level(spdlog::level::debug);
      ygslam::log_detail(fmt::format("version {}, called with {}", ygslam::version(),
                                     fmt::join(argv + 1, argv + argc, " ")));
    };
    app.add_flag_callback("-v,--verbose", show_details, "A line for the call and for every frame")
        ->trigger_on_parse();
    int exit_code = 0;
    ygslam::add_run_command(app, exit_code);
    ygslam::add_localize_command(app, exit_code);
    ygslam::add_eval_command(app, exit_code);
    ygslam::add_bench_command(app, exit_code);
    ygslam::add_calibrate_command(app, exit_code);
    ygslam::add_simulate_command(app, exit_code);
    ygslam::add_inspect_command(app, exit_code);
    ygslam::add_map_command(app, exit_code);
    ygslam::add_export_command(app, exit_code);
    ygslam::add_render_command(app, exit_code);
    ygslam::add_config_command(app);
    ygslam::add_completion_command(app);
    refuse_empty_values(app);
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
      const int usage = static_cast<int>(ygslam::ErrorKind::kUsage);
      return ygslam::finish_standard_output(app.exit(e) == 0 ? 0 : usage, true);
    }
    return ygslam::finish_standard_output(exit_code, !works_elsewhere(app));
  } catch (const std::exception& e) {
    ygslam::log::error("{}", ygslam::describe(e));
    return static_cast<int>(ygslam::ErrorKind::kInternal);
  }
}
