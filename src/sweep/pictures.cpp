#include "sweep/pictures.hpp"

#include <algorithm>

namespace ygslam {

std::filesystem::path pictures_folder(const SweepOptions& options, const BenchSequence& sequence) {
  return options.out / "sequences" / sequence.id / "inspect";
}

std::vector<std::string> inspect_command(const SweepOptions& o, const BenchSequence& sequence) {
  std::vector<std::string> words = {o.program.string(),
                                    "inspect",
                                    sequence.folder.string(),
                                    "--out",
                                    pictures_folder(o, sequence).string(),
                                    "--seed",
                                    std::to_string(o.seed)};
  const bool full = std::find(o.modes.begin(), o.modes.end(), "full") != o.modes.end();
  words.insert(words.end(), {"--checks", full ? "classic,improved,full" : "classic,improved"});
  if (full) {
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
