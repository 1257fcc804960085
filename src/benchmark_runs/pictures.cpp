#include "benchmark_runs/pictures.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "io/atomic_file.hpp"
#include "io/text.hpp"

namespace ygslam {

std::filesystem::path pictures_folder(const SweepOptions& options, const BenchSequence& sequence) {
  return options.out / "sequences" / sequence.id / "inspect";
}

namespace {

std::string checks_of(const SweepOptions& o) {
  const bool full = std::find(o.modes.begin(), o.modes.end(), "full") != o.modes.end();
  return full ? "classic,improved,full" : "classic,improved";
}

// What was drawn; beside the pictures.
std::string mark_of(const SweepOptions& o, const BenchSequence& sequence) {
  nlohmann::ordered_json mark = {
      {"checks", checks_of(o)}, {"version", o.version}, {"sequence", sequence.fingerprint}};
  if (!sequence.masks_fingerprint.empty()) mark["masks"] = sequence.masks_fingerprint;
  return mark.dump(2) + "\n";
}

}  // namespace

bool has_pictures(const SweepOptions& options, const BenchSequence& sequence) {
  const auto mark = read_file(pictures_folder(options, sequence) / "drawn.json");
  return mark.ok() && *mark == mark_of(options, sequence);
}

Status mark_pictures(const SweepOptions& options, const BenchSequence& sequence) {
  return write_file_atomically(pictures_folder(options, sequence) / "drawn.json",
                               mark_of(options, sequence));
}

std::vector<std::string> inspect_command(const SweepOptions& o, const BenchSequence& sequence) {
  std::vector<std::string> words = {o.program.string(),
                                    "inspect",
                                    sequence.folder.string(),
                                    "--out",
                                    pictures_folder(o, sequence).string(),
                                    "--seed",
                                    std::to_string(o.seed)};
  words.insert(words.end(), {"--checks", checks_of(o)});
  if (checks_of(o).ends_with("full")) {
    const auto masks = mask_options(o, sequence);
    words.insert(words.end(), masks.begin(), masks.end());
  }
  for (const auto& [name, value] : o.config) {
    words.emplace_back("--set");
    words.push_back(name + "=" + value);
  }
  return words;
}

}  // namespace ygslam
